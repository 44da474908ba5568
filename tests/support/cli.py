"""Running the command as a user does: its own process, its own exit code."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

# Words of a crash; no message to a user contains them.
CRASH_WORDS = ("Traceback", "panicked", "RUST_BACKTRACE", "Segmentation fault", "core dumped", "pyo3_runtime")


def command() -> Path:
    """Return the installed command, or skip the test."""
    path = Path(sys.executable).parent / "tyndall"
    if not path.exists():
        pytest.skip(f"{path} is absent: run `make build`")
    return path


@dataclass(frozen=True, slots=True)
class Run:
    """A finished run of the command."""

    code: int
    out: str
    err: str
    seconds: float

    @property
    def text(self) -> str:
        """Everything that was printed."""
        return self.out + self.err

    def assert_no_crash(self) -> None:
        """Fail if the output looks like a crash rather than a message."""
        found = [word for word in CRASH_WORDS if word in self.text]
        assert not found, f"{found} in the output:\n{self.text}"
        assert self.code >= 0, f"ended by signal {-self.code}:\n{self.text}"


def _environment(extra: dict[str, str] | None) -> dict[str, str]:
    return {**os.environ, "NO_COLOR": "1", **(extra or {})}


def tyndall(*arguments: str | Path, timeout: float = 120, env: dict[str, str] | None = None) -> Run:
    """Run the command to its end; a run beyond `timeout` seconds is a failure."""
    start = time.monotonic()
    try:
        done = subprocess.run(
            [command(), *map(str, arguments)],
            capture_output=True,
            text=True,
            timeout=timeout,
            env=_environment(env),
            check=False,
        )
    except subprocess.TimeoutExpired as expired:
        pytest.fail(f"no end within {timeout} s: tyndall {' '.join(map(str, arguments))}\n{expired.stderr}")
    run = Run(done.returncode, done.stdout, done.stderr, time.monotonic() - start)
    run.assert_no_crash()
    return run


def tyndall_interrupted(*arguments: str | Path, after: float, timeout: float = 60) -> Run:
    """Run the command, send it SIGINT after so many seconds of rendering, and return what it did.

    Rendering counts from the first line of `--progress lines`, so that loading does not eat the time.
    """
    start = time.monotonic()
    with subprocess.Popen(
        [command(), *map(str, arguments), "--progress", "lines"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=_environment(None),
    ) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        time.sleep(after)
        process.send_signal(signal.SIGINT)
        try:
            rest, _ = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            process.kill()
            pytest.fail(f"no end within {timeout} s of SIGINT")
        run = Run(process.returncode, first + rest, "", time.monotonic() - start)
    run.assert_no_crash()
    return run


def read_stats(path: Path) -> dict[str, Any]:
    """Return the JSON a run wrote with `--stats`."""
    stats: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return stats
