# SPDX-License-Identifier: GPL-3.0-or-later
"""What could not be rendered as asked: by what, where, how often; shown in a panel and on the console."""

from __future__ import annotations

import logging
from collections import Counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    import tyndall

LOG = logging.getLogger("tyndall")
_ORDER = ("error", "warning", "info")


class Report:
    """The diagnostics of the last render or viewport of a scene, equal ones counted."""

    def __init__(self, diagnostics: Iterable[tyndall.Diagnostic]) -> None:
        texts: dict[tuple[str, str, str], list[str]] = {}
        for d in diagnostics:
            texts.setdefault((d.severity, d.what, d.action), []).append(d.path.lstrip("/"))
        self._entries = sorted(texts.items(), key=lambda item: _ORDER.index(item[0][0]))

    def count(self, severity: str) -> int:
        """Return how many different messages there are of a severity."""
        return sum(kind == severity for (kind, _, _), _ in self._entries)

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Return severity, what, where (with counts) and what was done, worst first."""
        return [
            (severity, what, _where(places), action) for (severity, what, action), places in self._entries
        ]

    def text(self) -> str:
        """Return all of it, one message a line."""
        lines = []
        for severity, what, where, action in self.rows():
            place = f"{where}: " if where else ""
            lines.append(f"{severity}: {place}{what}" + (f" ({action})" if action else ""))
        return "\n".join(lines)

    def log(self) -> None:
        """Write warnings and errors to the console."""
        for line in self.text().splitlines():
            if not line.startswith("info"):
                LOG.warning("Tyndall: %s", line)


def _where(places: list[str]) -> str:
    named = [
        name if count == 1 else f"{name} ({count} times)" for name, count in Counter(places).items() if name
    ]
    shown = ", ".join(named[:5])
    return shown if len(named) <= 5 else f"{shown} and {len(named) - 5} more"


EMPTY = Report(())
_LAST: dict[str, Report] = {}


def publish(scene_name: str, report: Report) -> None:
    """Make `report` the one that the panel of a scene shows."""
    _LAST[scene_name] = report


def last(scene_name: str) -> Report:
    """Return the last report of a scene."""
    return _LAST.get(scene_name, EMPTY)
