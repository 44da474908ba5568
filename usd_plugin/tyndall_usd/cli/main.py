"""Entry point: one clear line and an exit code for everything that can go wrong."""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
from typing import TYPE_CHECKING

from tyndall_usd.cli import log
from tyndall_usd.cli.arguments import make_parser, parse
from tyndall_usd.cli.exit_codes import ExitCode, StrictError, UsageError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    log.set_up(verbose=0, quiet=False, as_json=False)
    try:
        options = parse(arguments)
    except UsageError as error:
        log.fail(str(error))
        return ExitCode.USAGE
    except SystemExit as stop:  # --help
        return int(stop.code or 0)
    verbose = getattr(options, "verbose", 0)
    log.set_up(
        verbose=verbose, quiet=getattr(options, "quiet", False), as_json=getattr(options, "log_json", False)
    )
    wants_traceback = verbose > 1 or bool(os.environ.get("TYNDALL_DEBUG"))
    try:
        return _run(options)
    except UsageError as error:
        log.fail(str(error))
        return ExitCode.USAGE
    except StrictError as error:
        log.fail(str(error))
        return ExitCode.DIAGNOSTICS
    except KeyboardInterrupt:
        log.fail("interrupted")
        return ExitCode.INTERRUPTED
    except BrokenPipeError:
        return ExitCode.FAILED
    except Exception as error:
        if wants_traceback:
            traceback.print_exc()
        return _explain(error)


def _run(options: argparse.Namespace) -> int:
    if options.version:
        return _print_version()
    if options.list_aovs:
        return _print_aovs()
    if options.command is None:
        make_parser().print_help()
        return ExitCode.USAGE
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, lambda *_: _interrupt())
    if options.command == "info":
        from tyndall_usd.cli.info import run_info

        return run_info(options)
    if options.command == "cache":
        from tyndall_usd.cli.cache import run_cache

        return run_cache(options)
    if options.command == "cluster":
        from tyndall_usd.cli.cluster import run_cluster

        return run_cluster(options)
    if options.command == "inspect":
        from tyndall_usd.cli.inspect import run_inspect

        return run_inspect(options)
    if options.command == "job":
        from tyndall_usd.cli.job import run_job

        return run_job(options)
    if options.command == "merge":
        from tyndall_usd.cli.merge import run_merge

        return run_merge(options)
    from tyndall_usd.cli.render import run_render

    return run_render(options)


def _interrupt() -> None:
    """Farms stop jobs by SIGTERM: what is done is written, as for Ctrl-C."""
    raise KeyboardInterrupt


def _explain(error: Exception) -> int:
    """Log one line about `error` and return the exit code for it."""
    try:
        import tyndall
    except ImportError:
        log.fail(f"the renderer is not installed: {error}; run `make build`")
        return ExitCode.FAILED
    if isinstance(error, tyndall.SettingsError):
        log.fail(str(error))
        return ExitCode.USAGE
    if isinstance(error, tyndall.Error):
        log.fail(str(error))
    elif isinstance(error, ImportError):
        log.fail(f"{error}; install usd-core")
    elif isinstance(error, (OSError, MemoryError)):
        log.fail(str(error) or type(error).__name__)
    else:
        log.fail(f"internal error: {type(error).__name__}: {error}; -vv shows where, please report it")
    return ExitCode.FAILED


def _print_version() -> int:
    import tyndall

    sys.stdout.write(f"tyndall {tyndall.version}\n")
    return ExitCode.DONE


def _print_aovs() -> int:
    import tyndall

    for aov in tyndall.list_aovs():
        sys.stdout.write(f"{aov.name:<15} {aov.doc}\n")
    return ExitCode.DONE
