"""A stage at the render delegate, with its camera and the settings it is rendered with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import tyndall
from pxr import Gf
from tyndall.messages import Messages

from tyndall_usd.cli.inputs import choose_camera, drawn_purposes
from tyndall_usd.read.camera import conform_aperture, read_camera, shutter_interval
from tyndall_usd.scene_index import SceneIndex

if TYPE_CHECKING:
    import argparse

    from pxr import Usd
    from tyndall.prims import Camera

    from tyndall_usd.read.settings import StageSettings, View

_DEFAULT_RESOLUTION = (1280, 720)


class Shot:
    """Keeps a delegate at a time of the stage, seen through a camera that is fitted to the image."""

    def __init__(self, stage: Usd.Stage, settings: StageSettings, options: argparse.Namespace) -> None:
        self._stage = stage
        self._options = options
        self._cameras: dict[str | None, Usd.Prim] = {}
        self.renderer_settings = _renderer_settings(settings, options)
        self.delegate = tyndall.RenderDelegate()
        self.index = SceneIndex(
            stage,
            self.delegate,
            purposes=drawn_purposes(options, settings),
            material_purpose=settings.material_purpose,
        )

    def sync_camera(self, view: View, time: Usd.TimeCode) -> tuple[Camera, dict[str, Any]]:
        """Sync the camera, fitted to the image; return it and the core's settings."""
        messages = Messages()
        options = self._options
        prim = self._cameras.get(view.camera)
        if prim is None:
            prim = choose_camera(self._stage, options.camera, view.camera, messages)
            self._cameras[view.camera] = prim
        blurs = view.motion_blur and not options.disable_motionblur
        camera = read_camera(prim, time, messages, depth_of_field=view.depth_of_field, motion_blur=blurs)
        interval = shutter_interval(prim, time)
        self.index.blur(interval if blurs else Gf.Interval(), messages)
        resolution = options.resolution or (tuple(options.res) if options.res else None)
        pixel_aspect = options.pixel_aspect or view.pixel_aspect
        if resolution is None and options.width:
            height = options.width * pixel_aspect * camera.aperture[1] / camera.aperture[0]
            resolution = (options.width, max(1, round(height)))
        resolution = resolution or view.resolution or _DEFAULT_RESOLUTION
        camera, pixel_aspect = conform_aperture(
            camera, resolution=resolution, pixel_aspect=pixel_aspect, policy=view.policy
        )
        self.index.sync_camera(str(prim.GetPath()), camera, messages)
        if options.headlight != "none":
            self.index.add_headlight(options.headlight, camera)
        settings = {
            "camera": str(prim.GetPath()),
            "resolution": list(resolution),
            "pixelAspect": pixel_aspect,
        }
        return camera, {**self.renderer_settings, **settings}


def _renderer_settings(settings: StageSettings, options: argparse.Namespace) -> dict[str, Any]:
    """Return the core's settings: the command line wins over the stage."""
    given = {
        "samples": options.spp,
        "noiseThreshold": options.noise_threshold,
        # The core's 0 is no limit; 0 here means no more than the first pass.
        "timeLimit": options.time if options.time is None else max(options.time, 1e-9),
        "maxBounces": options.max_bounces,
        "threads": options.threads,
        "seed": options.seed,
        "filter": options.filter,
        "distanceSampling": options.distance_sampling,
        "lightSampling": options.light_sampling,
        "guiding": options.guiding,
        "cachePath": options.cache,
        "cacheMode": options.cache_mode,
        "proceduralResolution": options.procedural_resolution,
    }
    defaults = {
        spec["name"]: spec["default"] for spec in tyndall.setting_specs() if spec["default"] is not None
    }
    return {
        **defaults,
        **settings.renderer,
        **{name: value for name, value in given.items() if value is not None},
    }
