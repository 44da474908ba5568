"""Test data that is not part of this repository: scenes, references and files of other projects."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parents[2]
TESTS = REPO / "tests"
OUT = REPO / "out" / "tests"


def shared_root() -> Path:
    """Return the folder of shared data: ``TYNDALL_SHARED``, or a folder `shared` beside the repository."""
    return Path(os.environ.get("TYNDALL_SHARED", REPO.parent / "shared"))


def shared(*parts: str) -> Path:
    """Return a path below the shared data, or skip the test if it is not there."""
    path = shared_root().joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{path} is absent: set TYNDALL_SHARED to the folder with the shared test data")
    return path


def has_shared(*parts: str) -> bool:
    """Say whether a path below the shared data exists; for building parameter lists."""
    return shared_root().joinpath(*parts).exists()
