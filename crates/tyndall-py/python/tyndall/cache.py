"""Words about guiding caches, the same in every front end."""

from __future__ import annotations

from typing import Any

#: Frames of a shot that are listed one by one.
_LISTED_FRAMES = 12


def describe(info: dict[str, Any]) -> list[str]:
    """Return lines about what `tyndall.read_cache_info` found, without the file's name and fingerprints."""
    field, image = info["field"], info["image"]
    lines = [
        f"{info['bytes']} bytes, written by {info['renderer'] or 'an unknown renderer'}",
        f"learned {info['lessons']} times, from {_frames(info['frames'])}",
        f"of this very scene from {info['samples']} samples a pixel",
    ]
    if field is not None:
        regions = f"{field['surfaceRegions']} regions of surfaces and {field['volumeRegions']} of media"
        lines.append(f"field: {regions}, {field['lobes']} lobes, {field['samples']} samples")
    if image is not None:
        width, height = image["resolution"]
        lines.append(
            f"image guide: {width}x{height}, counting for {image['samplesPerPixel']:.1f} samples a pixel"
        )
    if field is None and image is None:
        lines.append("nothing learned")
    return lines


def metadata(statistics: dict[str, Any]) -> dict[str, str]:
    """Return what an image says about its guiding cache; nothing if there was none.

    Parameters
    ----------
    statistics : dict
        `Session.statistics` after a render.
    """
    cache = statistics.get("cache", {})
    return {f"tyndall:cache:{name}": cache[name] for name in ("status", "why", "mode") if cache.get(name)}


def status(statistics: dict[str, Any]) -> str | None:
    """Return what became of a render's cache, and why; ``None`` if there was none or nothing was guided."""
    cache = statistics.get("cache")
    if cache is None or "guide" not in statistics:
        return None
    why = f" ({cache['why']})" if cache["why"] else ""
    return f"{cache['status']}{why}"


def _frames(frames: list[dict[str, Any]]) -> str:
    if not frames:
        return "no frames"
    latest = frames[-_LISTED_FRAMES:]
    listed = ", ".join(f"{frame['frame']:g} ({frame['samples']} spp)" for frame in latest)
    earlier = len(frames) - len(latest)
    return f"{earlier} frames and {listed}" if earlier else f"frame {listed}"
