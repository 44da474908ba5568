"""Catches what OpenUSD writes to stderr by itself: the same facts come as diagnostics, once and readable."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from typing import TYPE_CHECKING

from tyndall_usd.cli.log import LOG

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextlib.contextmanager
def caught_stderr() -> Iterator[None]:
    """Keep the process's stderr out of sight; it is logged at debug level afterwards."""
    try:
        saved = os.dup(2)
    except OSError:
        yield
        return
    sys.stderr.flush()
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), 2)
        try:
            yield
        finally:
            sys.stderr.flush()
            os.dup2(saved, 2)
            os.close(saved)
            file.seek(0)
            for line in file.read().decode(errors="replace").splitlines():
                LOG.debug("usd: %s", line)
