"""``tyndall merge``: parts of a render, made by ``--sample-range``, become its image."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import tyndall

from tyndall_usd.cli.exit_codes import ExitCode, UsageError
from tyndall_usd.cli.film_state import FilmState, part_file, read_film_state
from tyndall_usd.cli.log import LOG

if TYPE_CHECKING:
    import argparse

_SUFFIXES = (".exr", ".png")


def run_merge(options: argparse.Namespace) -> int:
    """Merge the parts that `options` name and return the exit code."""
    output = Path(options.output)
    if output.suffix.lower() not in _SUFFIXES:
        raise UsageError(
            f"{output}: images are written as {' or '.join(_SUFFIXES)}; change the file's ending"
        )
    parts = [read_film_state(_state_file(Path(name))) for name in options.parts]
    parts.sort(key=lambda part: part.film.sample_range)
    check_parts(parts)
    film = parts[0].film
    for part in parts[1:]:
        film = film.joined(part.film)
    first = parts[0].description
    metadata = {**first.metadata, "tyndall:samples": str(film.samples), "tyndall:parts": str(len(parts))}
    film = film.with_pixel_aspect(first.settings["pixelAspect"])
    aovs = first.aovs if output.suffix.lower() == ".exr" else ["rgba"]
    film.write(str(output), aovs, metadata)
    LOG.info("%s: %d samples per pixel of %d parts", output, film.samples, len(parts))
    return _conclude(parts, strict=options.strict)


def check_parts(parts: list[FilmState]) -> None:
    """Find out whether `parts`, in the order of their samples, are one render and all of it.

    Raises
    ------
    tyndall.FileError
        They are not; the message names the two parts that do not fit.
    """
    first, last = parts[0], parts[-1]
    for part in parts[1:]:
        difference = first.description.difference(part.description)
        totals = [p.description.settings["samples"] for p in (first, part)]
        if difference is None and totals[0] != totals[1]:
            difference = f"--spp is {totals[0]} here and {totals[1]} there"
        if difference:
            raise tyndall.FileError(
                f"{first.path} and {part.path} are parts of different renders: {difference}"
            )
    if first.film.sample_range[0] != 0:
        raise tyndall.FileError(f"{first.path} begins with sample {first.film.sample_range[0]}; 0 is missing")
    for part, following in pairwise(parts):
        end, begin = part.film.sample_range[1], following.film.sample_range[0]
        if end > begin:
            raise tyndall.FileError(f"{part.path} and {following.path} both have the samples {begin}:{end}")
        if end < begin:
            raise tyndall.FileError(
                f"the samples {end}:{begin} between {part.path} and {following.path} are missing"
            )
    end, total = last.film.sample_range[1], last.description.settings["samples"]
    if end != total:
        raise tyndall.FileError(
            f"the samples {end}:{total} after {last.path} are missing; "
            f"render them, or all parts with --spp {end}"
        )


def _state_file(path: Path) -> Path:
    """Return the file of sums of a part that is named by its image or by that file."""
    if path.suffix == ".film":
        return path
    state = part_file(path)
    if not state.exists():
        raise tyndall.FileError(
            f"{path} is not a part: {state} does not exist; render it with --sample-range"
        )
    return state


def _conclude(parts: list[FilmState], *, strict: bool) -> int:
    if len(parts) == 1 or not any(part.description.learns for part in parts):
        return ExitCode.DONE
    LOG.warning(
        "guiding learned in each part by itself: the image is as bright as one render's, but has other noise"
    )
    return ExitCode.DIAGNOSTICS if strict else ExitCode.DONE
