"""Exit codes of the command line."""

from __future__ import annotations

import enum


class ExitCode(enum.IntEnum):
    """What the shell and render farms see."""

    DONE = 0
    FAILED = 1  #: Nothing or less than asked was written.
    USAGE = 2
    DIAGNOSTICS = 3  #: ``--strict`` and there were warnings or errors.
    INTERRUPTED = 130  #: A partial image was written.


class UsageError(Exception):
    """What was asked for makes no sense; the text says why and what does."""


class StrictError(Exception):
    """What would be a warning, under ``--strict``."""
