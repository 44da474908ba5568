//! Materials, textures, the shading graph, and lights.
