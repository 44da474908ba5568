//! Image, texture and grid files in; EXR and PNG out.
