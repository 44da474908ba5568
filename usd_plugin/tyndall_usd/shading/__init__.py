"""Shader networks of USD to the core's shading graph: one converter per source node, in one table (`table.py`)."""
