"""Logging of the command line: messages for people, or one JSON object a line."""

from __future__ import annotations

import json
import logging
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import argparse
    from typing import Protocol

    class Diagnostic(Protocol):
        """A message of the front end or of the core."""

        severity: str
        path: str
        what: str
        action: str


LOG = logging.getLogger("tyndall")
_LEVELS = {"info": logging.DEBUG, "warning": logging.WARNING, "error": logging.ERROR}


class _JsonFormatter(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        line = {
            "level": record.levelname.lower(),
            "message": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        return json.dumps(line, ensure_ascii=False)


def set_up(*, verbose: int, quiet: bool, as_json: bool) -> None:
    """Send messages to stderr."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_JsonFormatter() if as_json else logging.Formatter("%(message)s"))
    LOG.handlers[:] = [handler]
    LOG.propagate = False
    LOG.setLevel(logging.ERROR if quiet else logging.DEBUG if verbose else logging.INFO)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what decides how much is logged, and how."""
    parser.add_argument("-v", "--verbose", action="count", default=0, help="say more; -vv shows tracebacks")
    parser.add_argument("-q", "--quiet", action="store_true", help="show only errors")
    parser.add_argument("--log-json", action="store_true", help="log as one JSON object a line")


def fail(text: str) -> None:
    """Log why the command ends."""
    LOG.error("tyndall: %s", text)


class DiagnosticLog:
    """Shows every diagnostic once and counts them."""

    def __init__(self) -> None:
        self._seen: dict[str, Diagnostic] = {}

    def show(self, diagnostics: object) -> None:
        """Log the diagnostics that have not been shown."""
        for diagnostic in diagnostics:  # type: ignore[attr-defined]
            text = str(diagnostic)
            if text not in self._seen:
                self._seen[text] = diagnostic
                LOG.log(_LEVELS[diagnostic.severity], "%s", text, extra={"fields": as_dict(diagnostic)})

    def count(self, severity: str) -> int:
        """Return how many of `severity` were shown."""
        return sum(d.severity == severity for d in self._seen.values())

    def as_list(self) -> list[dict[str, str]]:
        """Return all of them for JSON."""
        return [as_dict(d) for d in self._seen.values()]


def as_dict(diagnostic: Diagnostic) -> dict[str, str]:
    """Return `diagnostic` for JSON."""
    return {name: str(getattr(diagnostic, name)) for name in ("severity", "path", "what", "action")}
