"""Where bpy is, tests run; where it is not, they say so."""

from __future__ import annotations

import importlib.util

import pytest

needs_bpy = pytest.mark.skipif(
    importlib.util.find_spec("bpy") is None,
    reason="bpy is not installed: pip install -r scripts/requirements/blender.txt (Python 3.11)",
)
