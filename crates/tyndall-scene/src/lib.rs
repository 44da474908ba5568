//! The shot as plain data: prims as a delegate receives them, dirty bits, validation, diagnostics.
