"""``tyndall inspect``: a picture of what a render learns of the light."""

from __future__ import annotations

from tyndall_usd.cli.inspect.command import run_inspect

__all__ = ["run_inspect"]
