"""Fixtures of every whole-system test."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.shared import OUT


@pytest.fixture
def out() -> Path:
    """Return the folder for pictures of failures; not removed after the run."""
    OUT.mkdir(parents=True, exist_ok=True)
    return OUT
