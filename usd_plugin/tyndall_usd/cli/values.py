"""The values of options: text in, a number or a message about it out."""

from __future__ import annotations

import argparse
import math
import re


def resolution(text: str) -> tuple[int, int]:
    """Return width and height of ``1920x1080``."""
    match = re.fullmatch(r"(\d+)[xX](\d+)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form 1920x1080")
    return positive_int(match[1]), positive_int(match[2])


def size(text: str) -> int:
    """Return the bytes of ``64M``."""
    match = re.fullmatch(r"(\d+)([kMG]?)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form 64M")
    return int(match[1]) << 10 * " kMG".index(match[2] or " ")


def sample_range(text: str) -> tuple[int, int]:
    """Return the two numbers of ``0:128``."""
    match = re.fullmatch(r"(\d+):(\d+)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form 0:128")
    first, end = int(match[1]), int(match[2])
    if first >= end:
        raise argparse.ArgumentTypeError(f"{text} has no samples; the second number must be larger")
    return first, end


def pixel(text: str) -> tuple[int, int]:
    """Return column and row of ``640,360``."""
    match = re.fullmatch(r"(\d+),(\d+)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form 640,360")
    return int(match[1]), int(match[2])


def point(text: str) -> tuple[float, float, float]:
    """Return the coordinates of ``1.5,0,-2``."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form 1.5,0,-2") from None
    if not all(math.isfinite(v) for v in (x, y, z)):
        raise argparse.ArgumentTypeError(f"{text} is not finite")
    return x, y, z


def count(text: str) -> int:
    """Return a whole number from 0."""
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is negative")
    return value


def positive_int(text: str) -> int:
    """Return a whole number from 1."""
    value = count(text)
    if value == 0:
        raise argparse.ArgumentTypeError("0 is too small; it must be at least 1")
    return value


def seconds(text: str) -> float:
    """Return a finite number from 0."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} must be finite and not negative")
    return value


def positive_float(text: str) -> float:
    """Return a finite number above 0."""
    value = seconds(text)
    if value == 0:
        raise argparse.ArgumentTypeError("0 is too small")
    return value
