"""``tyndall cluster render``: the steps of a job on the workers of a Dask scheduler.

A task is one ``tyndall`` command in its own process on a worker. A worker that dies takes nothing along but
the time: the scheduler gives its task to another, which writes the same bits.
"""

from __future__ import annotations

import json
import logging
import socket
from concurrent.futures import CancelledError
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyndall

from tyndall_usd.cli.exit_codes import ExitCode
from tyndall_usd.cli.film_state import part_file
from tyndall_usd.cli.frames import insert_frame, parse_frames
from tyndall_usd.cli.job import Step, part_images, plan_steps
from tyndall_usd.cli.leash import run_leashed
from tyndall_usd.cli.log import LOG

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from distributed import Client, Future

_SECONDS_TO_CONNECT = 15
#: How often a command that was killed by a signal, as for lack of memory, is run again.
_RETRIES = 2


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a command came to, and where."""

    code: int
    lines: list[str]
    host: str


class _KilledError(Exception):
    """The command was ended by a signal: another worker may have better luck."""


def run_command(arguments: list[str]) -> Outcome:
    """Run ``tyndall`` with `arguments` on a worker."""
    code, text = run_leashed([*arguments, "--log-json"])
    host = socket.gethostname()
    if code < 0:
        raise _KilledError(f"ended by signal {-code} on {host}")
    return Outcome(code, text.splitlines(), host)


def run_cluster(options: argparse.Namespace) -> int:
    """Render what `options` ask for on a cluster and return the exit code."""
    steps = plan_steps(options)
    client = _connect(options.scheduler)
    try:
        run = _Run(client, options.input)
        for step in steps:
            run.run_step(step)
    finally:
        client.close()
    if options.splits > 1:
        _remove_parts(options)
    return run.code


def _connect(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError as error:
        raise tyndall.Error(
            f"cluster needs Dask's scheduler: {error}; pip install 'tyndall-usd[cluster]'"
        ) from None
    # They would report each lost connection with a traceback; what matters is told here.
    for chatty in ("distributed", "distributed.client", "tornado.application", "asyncio"):
        logging.getLogger(chatty).setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=_SECONDS_TO_CONNECT)
    except (OSError, ValueError, TypeError) as error:
        raise tyndall.Error(
            f"--scheduler: no Dask scheduler answers at {address}: {error}; start one by `dask scheduler`"
        ) from None
    if not client.scheduler_info(n_workers=-1)["workers"]:
        LOG.warning(
            "the scheduler at %s has no workers; waiting for them (`dask worker %s`)", address, address
        )
    return client


class _Run:
    """The commands of one shot on their way."""

    def __init__(self, client: Client, stage: str) -> None:
        self.code = ExitCode.DONE
        self._client = client
        self._stage = stage
        self._shown: set[str] = set()

    def run_step(self, step: Step) -> None:
        """Run the commands of `step` side by side to their end.

        Raises
        ------
        tyndall.Error
            One of them failed; the others are not waited for.
        """
        commands = step.tasks()
        futures = self._client.map(run_command, commands, pure=False, retries=_RETRIES)
        labels = {future.key: _label(step, task) for task, future in enumerate(futures)}
        try:
            for done, future in enumerate(_completed(futures), start=1):
                outcome = self._outcome(future, labels[future.key])
                LOG.info("%s on %s: done (%d of %d)", labels[future.key], outcome.host, done, len(futures))
        finally:
            self._client.cancel(futures)

    def _outcome(self, future: Future[Outcome], label: str) -> Outcome:
        where = f"{self._stage}: {label}"
        try:
            outcome: Outcome = future.result()
        except CancelledError as error:
            raise tyndall.Error(
                f"{where}: the scheduler ended or lost its workers' results: {error}"
            ) from None
        except ImportError as error:
            raise tyndall.Error(f"{where}: a worker lacks the renderer: {error}; install it there") from None
        except Exception as error:
            # What Dask raises for a task whose workers all died, and `_KilledError`.
            raise tyndall.Error(f"{where}: given up: {error}") from None
        last = self._relay(outcome)
        if outcome.code not in (ExitCode.DONE, ExitCode.DIAGNOSTICS):
            raise tyndall.Error(f"{where}: exit code {outcome.code} on {outcome.host}: {last}")
        self.code = max(self.code, ExitCode(outcome.code))
        return outcome

    def _relay(self, outcome: Outcome) -> str:
        """Log what the command logged, each line once for all commands; return its last line."""
        message = "it said nothing"
        for line in outcome.lines:
            level, message, fields = _parsed(line)
            if line not in self._shown and message.strip():
                self._shown.add(line)
                LOG.log(level, "%s", message, extra={"fields": fields})
        return message.removeprefix("tyndall: ")


def _completed(futures: list[Future[Outcome]]) -> Iterator[Future[Outcome]]:
    from distributed import as_completed

    return iter(as_completed(futures))


def _label(step: Step, task: int) -> str:
    values = ", ".join(f"{name.lower()} {values[task]}" for name, values in step.parameters.items())
    return f"{step.name.lower()} {values}".rstrip()


def _parsed(line: str) -> tuple[int, str, dict[str, str]]:
    """Return level, text and fields of a line of ``--log-json``; what else is printed is a warning."""
    try:
        record = json.loads(line)
        level = logging.getLevelNamesMapping()[record.pop("level").upper()]
        return level, record.pop("message"), record
    except (ValueError, KeyError, AttributeError):
        return logging.WARNING, line, {}


def _remove_parts(options: argparse.Namespace) -> None:
    for frame in parse_frames(options.frames):
        image = insert_frame(str(Path(options.output).resolve()), frame)
        for part in map(Path, part_images(image, options.splits)):
            part.unlink(missing_ok=True)
            part_file(part).unlink(missing_ok=True)
