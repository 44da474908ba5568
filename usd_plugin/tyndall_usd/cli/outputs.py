"""Where images go: checked before anything is rendered."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyndall

from tyndall_usd.cli.exit_codes import UsageError
from tyndall_usd.cli.frames import has_placeholder, insert_frame

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from tyndall.messages import Messages

    from tyndall_usd.read.settings import Product, View

_SUFFIXES = (".exr", ".png")


@dataclass(frozen=True, slots=True)
class Image:
    """A file to write with the AOVs in it."""

    path: str
    aovs: tuple[str, ...]

    def at(self, frame: float) -> Path:
        """Return the file of `frame`."""
        return Path(insert_frame(self.path, frame))


@dataclass(frozen=True, slots=True)
class Task:
    """One render of each frame, and the images made of it."""

    view: View
    images: tuple[Image, ...]

    @property
    def aovs(self) -> list[str]:
        """Every AOV that is needed, each once."""
        return list(dict.fromkeys(name for image in self.images for name in image.aovs))


def plan_tasks(products: Sequence[Product], options: argparse.Namespace, messages: Messages) -> list[Task]:
    """Return the renders that make all products, or the one file of ``-o``.

    Raises
    ------
    UsageError
        No file is named, or an AOV is not known.
    """
    known = [aov.name for aov in tyndall.list_aovs()]
    asked = tuple(dict.fromkeys(options.aov or ()))
    unknown = [name for name in asked if name not in known]
    if unknown:
        raise UsageError(f"--aov: there is no AOV {unknown[0]!r}; known: {', '.join(known)}")
    output = options.output or options.output_argument
    by_view: dict[View, list[Image]] = {}
    if output:
        view = products[0].view
        left_out = [p.name for p in products if p.view != view]
        if left_out:
            messages.warning(
                "", f"products with other views are left out: {', '.join(left_out)}", "render without -o"
            )
        merged = dict.fromkeys(name for p in products if p.view == view for name in p.aovs)
        by_view[view] = [_image(output, asked or tuple(merged), messages)]
    else:
        for product in products:
            if not product.name:
                raise UsageError(
                    "no output; give one by -o OUT.exr, or a productName to the stage's RenderProduct"
                )
            by_view.setdefault(product.view, []).append(_image(product.name, asked or product.aovs, messages))
    return [Task(view, tuple(images)) for view, images in by_view.items()]


def _image(path: str, aovs: tuple[str, ...], messages: Messages) -> Image:
    suffix = Path(path).suffix.lower()
    if suffix not in _SUFFIXES:
        raise UsageError(f"{path}: images are written as {' or '.join(_SUFFIXES)}; change the file's ending")
    if suffix == ".png" and any(name != "rgba" for name in aovs):
        messages.warning("", f"{path} holds rgba only, not {', '.join(aovs)}", "write .exr for several AOVs")
        aovs = ("rgba",)
    return Image(path, aovs or ("rgba",))


def check_outputs(tasks: Sequence[Task], frames: Sequence[float], *, make_folders: bool) -> None:
    """Find out before rendering whether every file can be written.

    Raises
    ------
    UsageError
        Several frames would go to one file.
    tyndall.FileError
        A folder is missing.
    """
    for image in (image for task in tasks for image in task.images):
        if len(frames) > 1 and not has_placeholder(image.path):
            raise UsageError(
                f"{len(frames)} frames, but {image.path} has no place for the number; put #### in it"
            )
        for folder in {image.at(frame).parent for frame in frames}:
            if make_folders:
                folder.mkdir(parents=True, exist_ok=True)
            if not folder.is_dir():
                raise tyndall.FileError(f"{folder} is not a folder; create it or give --make-output-path")
