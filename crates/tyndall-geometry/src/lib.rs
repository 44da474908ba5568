//! Meshes, instances and their watertight intersection.
