"""``tyndall cache``."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import tyndall

from tyndall_usd.cli.exit_codes import ExitCode

if TYPE_CHECKING:
    import argparse

#: Frames of a shot that are listed one by one.
_LISTED_FRAMES = 12


def run_cache(options: argparse.Namespace) -> int:
    """Print what the cache holds and return the exit code."""
    info = tyndall.read_cache_info(options.file)
    text = json.dumps(info, indent=2) if options.json else "\n".join(_lines(info))
    sys.stdout.write(text + "\n")
    return ExitCode.DONE


def _lines(info: dict[str, Any]) -> list[str]:
    field, image = info["field"], info["image"]
    lines = [
        info["file"],
        f"  {info['bytes']} bytes, written by {info['renderer'] or 'an unknown renderer'}",
        f"  learned {info['lessons']} times, from {_frames(info['frames'])}",
    ]
    if field is not None:
        regions = f"{field['surfaceRegions']} regions of surfaces and {field['volumeRegions']} of media"
        lines.append(f"  field: {regions}, {field['lobes']} lobes, {field['samples']} samples")
    if image is not None:
        width, height = image["resolution"]
        lines.append(
            f"  image guide: {width}x{height}, counting for {image['samplesPerPixel']:.1f} samples a pixel"
        )
    if field is None and image is None:
        lines.append("  nothing learned")
    lines.append("fingerprints")
    lines += [f"  {digits}  {name}" for name, digits in info["fingerprints"].items()]
    return lines


def _frames(frames: list[dict[str, Any]]) -> str:
    if not frames:
        return "no frames"
    latest = frames[-_LISTED_FRAMES:]
    listed = ", ".join(f"{frame['frame']:g} ({frame['samples']} spp)" for frame in latest)
    earlier = len(frames) - len(latest)
    return f"{earlier} frames and {listed}" if earlier else f"frame {listed}"
