"""Messages about what could not be rendered as asked, collected while a front end reads its scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tyndall.delegate import Severity


class Reporter(Protocol):
    """Whatever takes diagnostics: the render delegate."""

    def report(self, severity: Severity, path: str, what: str, action: str = "") -> None:
        """Add a message about the prim at `path`."""


@dataclass(frozen=True, slots=True)
class Message:
    """One message: which prim, what is wrong, what to do."""

    severity: Severity
    path: str
    what: str
    action: str = ""

    def __str__(self) -> str:
        at = f" at <{self.path}>" if self.path else ""
        action = f" ({self.action})" if self.action else ""
        return f"{self.severity}{at}: {self.what}{action}"


class Messages:
    """Messages in the order they came, each kept once."""

    __slots__ = ("_messages",)

    def __init__(self) -> None:
        self._messages: dict[Message, None] = {}

    def info(self, path: object, what: str, action: str = "") -> None:
        """Add what is worth knowing and costs nothing."""
        self._messages[Message("info", str(path), what, action)] = None

    def warning(self, path: object, what: str, action: str = "") -> None:
        """Add a way in which the picture differs from what the scene asks for."""
        self._messages[Message("warning", str(path), what, action)] = None

    def error(self, path: object, what: str, action: str = "") -> None:
        """Add something that was asked for and is missing from the picture."""
        self._messages[Message("error", str(path), what, action)] = None

    def extend(self, other: Messages) -> None:
        """Add every message of `other`."""
        self._messages.update(other._messages)

    def send(self, reporter: Reporter) -> None:
        """Hand every message to `reporter`."""
        for message in self._messages:
            reporter.report(message.severity, message.path, message.what, message.action)

    def __iter__(self) -> Iterator[Message]:
        return iter(self._messages)

    def __len__(self) -> int:
        return len(self._messages)
