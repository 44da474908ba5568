"""Frame specifications (usdrecord's syntax) and frame numbers in file names."""

from __future__ import annotations

import re

from tyndall_usd.cli.exit_codes import UsageError

_MAX_FRAMES = 1_000_000
_NUMBER = r"-?\d+(?:\.\d+)?"
_RANGE = re.compile(rf"({_NUMBER})(?::({_NUMBER})(?:x({_NUMBER}))?)?")
#: ``###``, ``###.##``, ``$F4``, ``$F``, ``%04d``.
_PLACEHOLDER = re.compile(r"(#+)(?:\.(#+))?|\$F(\d*)|%0?(\d*)d")


def parse_frames(text: str) -> list[float]:
    """Return the frames of `text`, such as ``1001:1010x2,1020``, in the order given and each once.

    Raises
    ------
    UsageError
        `text` is not a frame specification.
    """
    frames: dict[float, None] = {}
    for part in text.split(","):
        match = _RANGE.fullmatch(part.strip())
        if match is None:
            raise UsageError(f"--frames: {part.strip()!r} is not a frame or range; write 1001:1010x2,1020")
        frames.update(dict.fromkeys(_expand(part.strip(), *match.groups())))
    return list(frames)


def _expand(text: str, first: str, last: str | None, stride: str | None) -> list[float]:
    start = float(first)
    if last is None:
        return [start]
    end = float(last)
    step = float(stride) if stride is not None else (1.0 if end >= start else -1.0)
    if step == 0 or (end - start) * step < 0:
        raise UsageError(f"--frames: {text!r} never reaches its end; the step must point from first to last")
    count = int((end - start) / step + 1e-9) + 1
    if count > _MAX_FRAMES:
        raise UsageError(f"--frames: {text!r} is {count} frames; at most {_MAX_FRAMES} at once")
    return [start + i * step for i in range(count)]


def has_placeholder(path: str) -> bool:
    """Return whether `path` has a place for the frame number."""
    return _PLACEHOLDER.search(path) is not None


def insert_frame(path: str, frame: float) -> str:
    """Return `path` with the frame number in place of ``####``, ``###.##``, ``$F4`` or ``%04d``.

    Raises
    ------
    UsageError
        The frame has a fraction and the placeholder has no place for it.
    """

    def replace(match: re.Match[str]) -> str:
        hashes, decimals, houdini, printf = match.groups()
        if decimals:
            digits, places = len(hashes), len(decimals)
            return f"{frame:0{digits + 1 + places}.{places}f}"
        if frame != int(frame):
            raise UsageError(
                f"frame {frame:g} has a fraction, but {path} has no place for it; write ###.### in it"
            )
        digits = len(hashes) if hashes else int(houdini or printf or 1)
        return f"{int(frame):0{digits}d}"

    return _PLACEHOLDER.sub(replace, path)
