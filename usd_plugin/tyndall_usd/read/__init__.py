"""Readers: one prim family per file, pure functions from a USD prim to the prim of the delegate."""
