"""Shader networks of USD to the core's shading graph: one converter a source node, in `table.py`."""
