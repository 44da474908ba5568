"""``tyndall info``."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from pxr import UsdGeom
from tyndall.delegate import DirtyBits
from tyndall.messages import Message, Messages
from tyndall.prims import Field, Prim, Volume

from tyndall_usd.cli.exit_codes import ExitCode
from tyndall_usd.cli.inputs import drawn_purposes, find_cameras, open_input, stage_settings
from tyndall_usd.cli.log import as_dict
from tyndall_usd.cli.native_stderr import caught_stderr
from tyndall_usd.scene_index import SceneIndex
from tyndall_usd.stage import first_time

if TYPE_CHECKING:
    import argparse

    from tyndall.delegate import Severity


def run_info(options: argparse.Namespace) -> int:
    """Print what the stage holds and return the exit code."""
    with caught_stderr():
        info = _collect(options)
    text = json.dumps(info, indent=2) if options.json else "\n".join(_lines(info))
    sys.stdout.write(text + "\n")
    return ExitCode.DONE


class _Listing:
    """A delegate that only remembers."""

    def __init__(self) -> None:
        self.prims: dict[str, Prim] = {}
        self.messages: list[Message] = []

    def sync(self, path: str, prim: Prim, dirty_bits: DirtyBits = DirtyBits.ALL) -> None:  # noqa: ARG002
        self.prims[path] = prim

    def remove(self, path: str) -> bool:
        return self.prims.pop(path, None) is not None

    def report(self, severity: Severity, path: str, what: str, action: str = "") -> None:
        self.messages.append(Message(severity, path, what, action))


def _collect(options: argparse.Namespace) -> dict[str, Any]:
    messages = Messages()
    stage = open_input(options, messages)
    time = first_time(stage)
    settings = stage_settings(stage, options, time, messages)
    listing = _Listing()
    index = SceneIndex(
        stage,
        listing,
        purposes=drawn_purposes(options, settings),
        material_purpose=settings.material_purpose,
    )
    index.sync(time)
    return {
        "input": options.input,
        "upAxis": str(UsdGeom.GetStageUpAxis(stage)),
        "metersPerUnit": UsdGeom.GetStageMetersPerUnit(stage),
        "frames": [stage.GetStartTimeCode(), stage.GetEndTimeCode()]
        if stage.HasAuthoredTimeCodeRange()
        else None,
        "prims": {name or "(no type)": count for name, count in sorted(index.type_counts.items())},
        "cameras": [str(camera.GetPath()) for camera in find_cameras(stage)],
        "settings": {
            "prim": settings.path,
            "all": [str(p.GetPath()) for p in stage.Traverse() if p.GetTypeName() == "RenderSettings"],
            "renderer": settings.renderer,
            "products": [
                {
                    "name": product.name,
                    "aovs": list(product.aovs) or ["rgba"],
                    "camera": product.view.camera,
                    "resolution": product.view.resolution,
                }
                for product in settings.products
                if settings.path
            ],
        },
        "volumes": _volumes(listing.prims),
        "diagnostics": [as_dict(m) for m in (*messages, *listing.messages)],
    }


def _volumes(prims: dict[str, Prim]) -> list[dict[str, Any]]:
    volumes = []
    for path, prim in prims.items():
        if isinstance(prim, Volume):
            fields = [(name, prims[target]) for name, target in prim.fields]
            grids = [
                {"field": name, "file": field.path, "grid": field.grid, "index": field.index}
                for name, field in fields
                if isinstance(field, Field)
            ]
            volumes.append({"path": path, "material": prim.material, "fields": grids})
    return volumes


def _lines(info: dict[str, Any]) -> list[str]:
    frames = "none" if info["frames"] is None else f"{info['frames'][0]:g} to {info['frames'][1]:g}"
    lines = [
        info["input"],
        f"  up axis {info['upAxis']}, {info['metersPerUnit']:g} metres a unit, frames: {frames}",
        "prims",
        *(f"  {count:>8} {name}" for name, count in info["prims"].items()),
        "cameras",
        *(f"  {path}" for path in info["cameras"] or ["none"]),
        "render settings",
        *(
            f"  {path}{' (used)' if path == info['settings']['prim'] else ''}"
            for path in info["settings"]["all"]
        ),
        *(_product_line(product) for product in info["settings"]["products"]),
    ]
    if info["volumes"]:
        lines.append("volumes")
    for volume in info["volumes"]:
        lines.append(f"  {volume['path']}")
        lines += [f"    {f['field']}: grid {f['grid']} of {f['file']}" for f in volume["fields"]]
    if info["diagnostics"]:
        lines.append("diagnostics")
        lines += [f"  {Message(**d)}" for d in info["diagnostics"]]
    return lines


def _product_line(product: dict[str, Any]) -> str:
    size = "x".join(str(n) for n in product["resolution"] or ()) or "default size"
    name, aovs = product["name"] or "(unnamed)", ", ".join(product["aovs"])
    return f"    {name}: {size}, {aovs}, camera {product['camera']}"
