"""Fixtures of every whole-system test."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from support.shared import OUT

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def out() -> Path:
    """Return the folder for pictures of failures; not removed after the run."""
    OUT.mkdir(parents=True, exist_ok=True)
    return OUT
