"""The figures of a run, for ``--stats`` and for the closing line."""

from __future__ import annotations

import contextlib
import json
import resource
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyndall
from tyndall.cache import status

from tyndall_usd.cli.log import LOG

if TYPE_CHECKING:
    from collections.abc import Iterator


class Stats:
    """Seconds by phase, and one entry a rendered frame."""

    def __init__(self) -> None:
        self._start = time.monotonic()
        self.seconds: dict[str, float] = dict.fromkeys(("load", "translate", "build", "render", "write"), 0.0)
        self.frames: list[dict[str, Any]] = []

    @contextlib.contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Count the time spent inside."""
        start = time.monotonic()
        try:
            yield
        finally:
            self.seconds[name] += time.monotonic() - start

    def wall(self) -> float:
        """Return the seconds since the start."""
        return time.monotonic() - self._start

    def _training(self) -> dict[str, float]:
        """Return the part of the rendering seconds that learning took; nothing if nothing was guided."""
        seconds = [frame["statistics"]["seconds"].get("train") for frame in self.frames]
        guided = [value for value in seconds if value is not None]
        return {"train": sum(guided)} if guided else {}

    def write(self, path: str, *, source: str, diagnostics: list[dict[str, str]]) -> None:
        """Write everything to the JSON file `path`."""
        usage = resource.getrusage(resource.RUSAGE_SELF)
        kibibyte = 1 if sys.platform == "darwin" else 1024
        report = {
            "version": tyndall.version,
            "input": source,
            "seconds": {
                **self.seconds,
                **self._training(),
                "wall": self.wall(),
                "cpu": usage.ru_utime + usage.ru_stime,
            },
            "peakMemoryBytes": usage.ru_maxrss * kibibyte,
            "spp": min((frame["spp"] for frame in self.frames), default=0),
            "statistics": self.frames[-1]["statistics"] if self.frames else {},
            "frames": self.frames,
            "diagnostics": diagnostics,
        }
        try:
            Path(path).write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
        except OSError as error:
            raise tyndall.FileError(f"--stats: {path} cannot be written: {error.strerror}") from None


def guide_metadata(statistics: dict[str, Any]) -> dict[str, str]:
    """Return what an image says about how it was guided; nothing if it was not."""
    if "guide" not in statistics:
        return {}
    sizes = {key: value for key, value in statistics["guide"].items() if key != "field"}
    sizes |= {f"field:{key}": value for key, value in statistics["guide"].get("field", {}).items()}
    sizes["trainSeconds"] = f"{statistics['seconds']['train']:.3f}"
    sizes["candidatesPerRay"] = f"{statistics['candidatesPerRay']:.3f}"
    return {f"tyndall:guide:{name}": str(value) for name, value in sizes.items()}


def tell_cache(statistics: dict[str, Any]) -> None:
    """Log one line about the guiding cache, if there was one."""
    cache = statistics.get("cache")
    if cache is None:
        return
    if "guide" not in statistics:
        LOG.warning(
            "cache %s: not used, nothing is guided in this render; see --guiding and --distance-sampling",
            cache["file"],
        )
        return
    LOG.info("cache %s: %s", cache["file"], status(statistics))
