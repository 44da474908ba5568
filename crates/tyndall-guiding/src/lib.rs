//! What is learned: scattering odds, image-space guide, directional lobes.
