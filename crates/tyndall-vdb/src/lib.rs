//! OpenVDB bytes into typed sparse grids and back; never panics on any input.
