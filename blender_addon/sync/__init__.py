# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's evaluated scene to prims: one module a kind, `scene.py` walks."""
