"""Runs ``tyndall`` for a process that may be killed: the command ends when its parent does.

Without it, a worker that is killed would leave its render running beside the one that takes its place.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

from tyndall_usd.cli.exit_codes import ExitCode

if TYPE_CHECKING:
    from collections.abc import Sequence


def run_leashed(arguments: Sequence[str]) -> tuple[int, str]:
    """Run ``tyndall`` with `arguments`; return its exit code, negative for a signal, and what it logged."""
    command = [sys.executable, "-m", __name__, *arguments]
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    ) as process:
        assert process.stderr is not None
        # The leash is the input: nothing is ever written to it, and it ends with this process.
        text = process.stderr.read()
        return process.wait(), text


def _end_with_parent() -> None:
    os.read(sys.stdin.fileno(), 1)
    os._exit(ExitCode.INTERRUPTED)


def _main() -> int:
    from tyndall_usd.cli.main import main

    threading.Thread(target=_end_with_parent, daemon=True).start()
    return main(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(_main())
