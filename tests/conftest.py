"""What happens around every run of the whole-system tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

from support.shared import OUT

if TYPE_CHECKING:
    import pytest


def pytest_sessionstart(session: pytest.Session) -> None:
    """Begin the list of measured figures anew (in the process that starts the workers, if there are any)."""
    if not hasattr(session.config, "workerinput"):
        OUT.mkdir(parents=True, exist_ok=True)
        (OUT / "figures.txt").unlink(missing_ok=True)
