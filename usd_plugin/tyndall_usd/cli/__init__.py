"""The command line ``tyndall``: argument parsing first, so that help and usage errors cost no USD import."""

from __future__ import annotations

from tyndall_usd.cli.main import main

__all__ = ["main"]
