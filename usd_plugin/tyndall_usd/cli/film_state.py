"""Films on their way: checkpoints of a render, and parts of one that are merged later.

Both are the renderer's own file of exact sums, with a description that says what it belongs to.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import tyndall

if TYPE_CHECKING:
    from pathlib import Path

#: Settings that do not change the value of a sample.
_FREE_SETTINGS = ("threads", "timeLimit", "samples")


@dataclass(frozen=True, slots=True)
class Description:
    """What a film belongs to.

    Parameters
    ----------
    scene : str
        Fingerprint of everything at the delegate.
    settings : dict
        The core's settings.
    sample_range : list of int
        The first sample to be taken, and the one to end before.
    learns : bool
        Whether guides learned, so that samples depend on those before them.
    aovs : list of str
        What the image holds.
    metadata : dict
        What the image says about itself.
    """

    scene: str
    settings: dict[str, Any]
    sample_range: list[int]
    learns: bool
    aovs: list[str]
    metadata: dict[str, str]

    def to_json(self) -> str:
        """Return the text that is kept with the film."""
        return json.dumps(asdict(self))

    def difference(self, other: Description) -> str | None:
        """Return in what the two renders differ, this one first; ``None`` if their samples are the same."""
        for name in sorted(self.settings.keys() | other.settings.keys()):
            mine, others = (json.dumps(d.settings.get(name)) for d in (self, other))
            if mine != others and name not in _FREE_SETTINGS:
                return f"{name} is {mine} here and {others} there"
        versions = [d.metadata.get("tyndall:version") for d in (self, other)]
        if versions[0] != versions[1]:
            return f"version {versions[0]} of the renderer here and {versions[1]} there"
        if self.scene != other.scene:
            return "the scenes are not the same"
        return None


@dataclass(frozen=True, slots=True)
class FilmState:
    """A film that was read from `path`."""

    path: Path
    film: tyndall.Film
    description: Description


def part_file(image: Path) -> Path:
    """Return the file of exact sums beside `image`, the picture of a part."""
    return image.with_name(image.name + ".film")


def checkpoint_file(image: Path) -> Path:
    """Return the checkpoint of the render that makes `image`."""
    return image.with_name(image.name + ".checkpoint")


def read_film_state(path: Path) -> FilmState:
    """Read a checkpoint or a part.

    Raises
    ------
    tyndall.FileError
        It is something else, or not all there.
    """
    film, text = tyndall.Film.read_state(path)
    try:
        description = Description(**json.loads(text))
    except (TypeError, ValueError):
        raise tyndall.FileError(f"{path}: it does not say what it belongs to") from None
    return FilmState(path, film, description)
