"""Rendering inside the test process: a stage is read once and rendered with many seeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
from pxr import UsdRender

from support.stages import StageBuilder

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

tyndall = pytest.importorskip("tyndall", reason="the binding is not built: run `make build`")
tyndall_usd = pytest.importorskip(
    "tyndall_usd", reason="the USD front end is not installed: run `make build`"
)

Images = npt.NDArray[np.float64]


class Shot:
    """A committed stage, with further prims of the delegate where `extra` has them by path."""

    def __init__(
        self, stage: Path | StageBuilder, folder: Path | None = None, *, extra: dict[str, Any] | None = None
    ) -> None:
        if isinstance(stage, StageBuilder):
            assert folder is not None, "a stage built in memory needs a folder"
            stage = stage.save(folder / "stage.usda")
        delegate = tyndall.RenderDelegate()
        self.settings = sync_stage(stage, delegate)
        for path, prim in (extra or {}).items():
            delegate.sync(path, prim)
        self.scene = delegate.commit()

    def session(self, *, spp: int, seed: int = 0, max_bounces: int, threads: int = 0, **settings: Any) -> Any:
        """Return a session with the stage's camera and resolution and a box filter."""
        wanted = {
            "samples": spp,
            "seed": seed,
            "maxBounces": max_bounces,
            "threads": threads,
            "filter": "box",
        }
        return tyndall.Session(self.scene, {**self.settings, **wanted, **settings})

    def render(
        self, *, aovs: Sequence[str] = ("rgba",), **settings: Any
    ) -> dict[str, npt.NDArray[np.float32]]:
        """Return the AOVs of one render by name."""
        film = self.session(aovs=list(aovs), **settings).render()
        return {name: np.array(film.aov(name)) for name in aovs}

    def seeds(
        self, count: int, *, spp: int, max_bounces: int, first_seed: int = 1, **settings: Any
    ) -> Images:
        """Return the colour of independent renders, shape (count, height, width, 3)."""
        images = []
        for seed in range(first_seed, first_seed + count):
            rendered = self.render(spp=spp, seed=seed, max_bounces=max_bounces, **settings)
            images.append(rendered["rgba"][..., :3])
        stacked = np.stack(images).astype(np.float64)
        assert np.isfinite(stacked).all(), "NaN or Inf in the image"
        assert (stacked >= 0).all(), "negative pixels"
        return stacked


def sync_stage(path: Path, delegate: Any) -> dict[str, Any]:
    """Read a stage into `delegate`; return camera and resolution of its render settings."""
    from tyndall.messages import Messages
    from tyndall_usd.read.camera import conform_aperture, read_camera, shutter_interval

    stage = tyndall_usd.open_stage(path)
    time = tyndall_usd.first_time(stage)
    index = tyndall_usd.SceneIndex(stage, delegate)
    index.sync(time)
    settings = UsdRender.Settings(stage.GetPrimAtPath(stage.GetMetadata("renderSettingsPrimPath")))
    (camera_path,) = settings.GetCameraRel().GetTargets()
    resolution = tuple(settings.GetResolutionAttr().Get())
    messages = Messages()
    prim = stage.GetPrimAtPath(camera_path)
    camera = read_camera(prim, time, messages)
    index.blur(shutter_interval(prim, time), messages)
    camera, _ = conform_aperture(camera, resolution=resolution, pixel_aspect=1.0, policy="expandAperture")
    index.sync_camera(str(camera_path), camera, messages)
    return {"camera": str(camera_path), "resolution": list(resolution)}
