//! Rays against meshes, instances and boundaries.

mod boundaries;
mod brute_force;
mod degenerate;
mod instances;
mod leaks;
mod moving;
mod shapes;
mod surface_points;
