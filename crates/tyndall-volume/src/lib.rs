//! Media: brick grids, majorants, phase functions, walks, transmittance.
