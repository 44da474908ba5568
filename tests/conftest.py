"""What happens around every run of the whole-system tests."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from support.shared import OUT

if TYPE_CHECKING:
    import pytest


def pytest_sessionstart(session: pytest.Session) -> None:
    """Begin the list of measured figures anew (in the process that starts the workers, if there are any)."""
    if not hasattr(session.config, "workerinput"):
        OUT.mkdir(parents=True, exist_ok=True)
        (OUT / "figures.txt").unlink(missing_ok=True)
    # Started in the background, this ignores Ctrl-C, and so would the commands that tests interrupt.
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
