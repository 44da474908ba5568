//! The Python module: arrays in, arrays out, errors, progress, cancellation.
