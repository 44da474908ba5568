"""Saving a render while it runs, and going on from there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import tyndall
from tyndall.messages import Message

from tyndall_usd.cli.exit_codes import StrictError
from tyndall_usd.cli.film_state import checkpoint_file, read_film_state
from tyndall_usd.cli.log import LOG

if TYPE_CHECKING:
    import argparse
    from pathlib import Path

    from tyndall_usd.cli.film_state import Description
    from tyndall_usd.cli.log import DiagnosticLog


class Checkpoint:
    """The checkpoint of one render; does nothing unless it is asked for."""

    def __init__(
        self,
        image: Path,
        description: Description,
        options: argparse.Namespace,
        diagnostics: DiagnosticLog,
    ) -> None:
        self._path = checkpoint_file(image)
        self._description = description
        self._seconds: float | None = options.checkpoint
        self._resumes: bool = options.resume
        self._strict: bool = options.strict
        self._diagnostics = diagnostics

    @property
    def request(self) -> tuple[Path, float, str] | None:
        """What a session needs to know to save itself."""
        if self._seconds is None:
            return None
        return self._path, self._seconds, self._description.to_json()

    def resume(self, session: tyndall.Session) -> None:
        """Let `session` go on from the checkpoint; one that cannot be used is reported and left out.

        Raises
        ------
        StrictError
            It cannot be used as it is, and ``--strict`` is given.
        """
        if not self._resumes:
            return
        if not self._path.exists():
            LOG.info("%s: no checkpoint; the render begins anew", self._path)
            return
        try:
            state = read_film_state(self._path)
        except tyndall.FileError as error:
            self._warn(f"the checkpoint cannot be used: {error}", "the render begins anew")
            return
        difference = self._description.difference(state.description)
        if difference:
            self._warn(f"{self._path} is of another render: {difference}", "the render begins anew")
            return
        try:
            session.resume(state.film)
        except tyndall.RenderError as error:
            self._warn(f"{self._path} cannot be used: {error}", "the render begins anew")
            return
        LOG.info("%s: going on after %d samples", self._path, state.film.samples)

    def conclude(self, session: tyndall.Session) -> None:
        """Save what was stopped; remove the checkpoint of what is complete and written."""
        if session.is_complete:
            if self._seconds is not None or self._resumes:
                self._path.unlink(missing_ok=True)
        elif self._seconds is not None:
            session.write_state(self._path, self._description.to_json())
        if session.checkpoint_failure:
            self._warn(
                f"no checkpoint was written: {session.checkpoint_failure}", "the image is not affected"
            )

    def _warn(self, what: str, action: str) -> None:
        if self._strict:
            raise StrictError(f"{what} (without --strict: {action})")
        self._diagnostics.show([Message("warning", "", what, action)])
