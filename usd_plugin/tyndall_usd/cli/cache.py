"""``tyndall cache``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyndall
from tyndall import cache

from tyndall_usd.cli import log
from tyndall_usd.cli.exit_codes import ExitCode
from tyndall_usd.cli.log import LOG

if TYPE_CHECKING:
    import argparse


def run_cache(options: argparse.Namespace) -> int:
    """Do with caches what `options` ask for and return the exit code."""
    actions = {"info": _info, "verify": _verify, "merge": _merge, "prune": _prune}
    return actions[options.cache_command](options)


def _info(options: argparse.Namespace) -> int:
    info = tyndall.read_cache_info(options.file)
    text = json.dumps(info, indent=2) if options.json else "\n".join(_lines(info))
    sys.stdout.write(text + "\n")
    return ExitCode.DONE


def _verify(options: argparse.Namespace) -> int:
    """Read every file as a render would: checksums and content."""
    code = ExitCode.DONE
    for file in options.files:
        try:
            info = tyndall.read_cache_info(file)
        except tyndall.FileError as error:
            log.fail(str(error))
            code = ExitCode.FAILED
        else:
            sys.stdout.write(f"{file}: sound, {info['bytes']} bytes\n")
    return code


def _merge(options: argparse.Namespace) -> int:
    left_out = tyndall.merge_caches(options.files, options.output)
    if left_out:
        LOG.warning("%d image guides are of other cameras or frame sizes and are left out", left_out)
    info = tyndall.read_cache_info(options.output)
    LOG.info("%s: %d caches, %d bytes", options.output, len(options.files), info["bytes"])
    return ExitCode.DONE


def _prune(options: argparse.Namespace) -> int:
    output = options.output or options.file
    is_small = tyndall.prune_cache(options.file, output, most_bytes=options.max_size, drop=options.drop)
    if not is_small:
        log.fail(f"{options.file} cannot be made as small as {options.max_size} bytes; nothing was written")
        return ExitCode.FAILED
    LOG.info("%s: %d bytes", output, Path(output).stat().st_size)
    return ExitCode.DONE


def _lines(info: dict[str, Any]) -> list[str]:
    return [
        info["file"],
        *(f"  {line}" for line in cache.describe(info)),
        "fingerprints",
        *(f"  {digits}  {name}" for name, digits in info["fingerprints"].items()),
    ]
