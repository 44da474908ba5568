"""Reading our images with a reader that is not ours (the OpenEXR library)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import OpenEXR

if TYPE_CHECKING:
    from pathlib import Path

Image = npt.NDArray[np.float32]

# Channels of a layer in the order their names mean, whatever order the file keeps them in.
_ORDER = "RGBArgbaXYZ"


def read_layers(path: Path) -> dict[str, Image]:
    """Return every layer of an EXR as an array (height, width, channels) by name.

    Bare channels (R, G, B, A) are the layer `rgba`; `albedo.R` belongs to `albedo`; parts of a multi-part
    file count as layers of their name.
    """
    grouped: dict[str, dict[str, Image]] = {}
    with OpenEXR.File(str(path), separate_channels=True) as file:
        for part in file.parts:
            for name, channel in part.channels.items():
                layer, _, component = name.rpartition(".")
                layer = layer or _layer_of_part(part, component)
                grouped.setdefault(layer, {})[component] = np.array(channel.pixels, np.float32)
    return {layer: _stack(channels) for layer, channels in grouped.items()}


def read_rgb(path: Path) -> Image:
    """Return the colour of an EXR, shape (height, width, 3)."""
    layers = read_layers(path)
    return layers["rgba"][..., :3]


def read_header(path: Path) -> dict[str, Any]:
    """Return the attributes of the first part."""
    with OpenEXR.File(str(path), header_only=True) as file:
        return dict(file.header())


def write_rgb(path: Path, rgb: Image) -> None:
    """Write a float32 colour image, shape (height, width, 3)."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(rgb, np.float32)}) as file:
        file.write(str(path))


def _layer_of_part(part: Any, component: str) -> str:
    if component in "RGBA":
        return "rgba"
    name = part.header.get("name", "")
    return name or component


def _stack(channels: dict[str, Image]) -> Image:
    ordered = sorted(channels, key=lambda name: (_ORDER.find(name[:1]) % 100, name))
    return np.stack([channels[name] for name in ordered], axis=-1)
