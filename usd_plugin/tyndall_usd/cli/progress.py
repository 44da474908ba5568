"""Ways to show progress: a bar, lines, the lines that render farms read, or nothing."""

from __future__ import annotations

import contextlib
import sys
from typing import TYPE_CHECKING

from tyndall_usd.cli.log import LOG

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tyndall import Progress

    Report = Callable[[Progress], bool | None]


@contextlib.contextmanager
def progress_reporter(style: str, title: str) -> Iterator[Report | None]:
    """Give the callback that shows progress in `style` (auto, bar, lines, alfred, none) under `title`."""
    if style == "auto":
        style = "bar" if sys.stderr.isatty() else "none"
    if style == "bar":
        with _bar(title) as report:
            yield report
    elif style == "lines":
        yield _Steps(lambda percent, p: LOG.info("%s: %d %% (%s)", title, percent, _describe(p)), step=10)
    elif style == "alfred":
        yield _Steps(lambda percent, _: _write_alfred(percent), step=1)
    else:
        yield None


def _write_alfred(percent: int) -> None:
    sys.stdout.write(f"ALF_PROGRESS {percent}%\n")
    sys.stdout.flush()


def _describe(progress: Progress) -> str:
    left = "" if progress.remaining_secs is None else f", {progress.remaining_secs:.0f} s left"
    return f"{progress.elapsed_secs:.1f} s{left}"


class _Steps:
    """Calls `show` whenever another `step` percent are done."""

    def __init__(self, show: Callable[[int, Progress], None], *, step: int) -> None:
        self._show = show
        self._step = step
        self._shown = -1

    def __call__(self, progress: Progress) -> None:
        percent = int(progress.fraction * 100 + 1e-9) // self._step * self._step
        if percent > self._shown:
            self._shown = percent
            self._show(percent, progress)


@contextlib.contextmanager
def _bar(title: str) -> Iterator[Report]:
    from rich import progress as rich
    from rich.console import Console

    columns = (
        rich.TextColumn("{task.description}"),
        rich.BarColumn(),
        rich.TextColumn("{task.percentage:>3.0f} %"),
        rich.TimeElapsedColumn(),
        rich.TimeRemainingColumn(),
    )
    with rich.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=1.0)

        def report(progress: Progress) -> None:
            bar.update(task, completed=progress.fraction)

        yield report
