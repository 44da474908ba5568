"""What both commands need of a stage: opening it, its settings, its cameras."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import tyndall
from pxr import Sdf, Usd

from tyndall_usd.cli.exit_codes import UsageError
from tyndall_usd.read.settings import StageSettings, find_settings, read_settings
from tyndall_usd.stage import open_stage

if TYPE_CHECKING:
    import argparse

    from tyndall.messages import Messages

PURPOSES = ("default", "render", "proxy", "guide")


def open_input(options: argparse.Namespace, messages: Messages) -> Usd.Stage:
    """Open the stage that the command line names."""
    if Path(options.input).suffix.lower() in (".gltf", ".glb"):
        raise UsageError(f"{options.input}: glTF input is not available in this version; convert it to USD")
    return open_stage(
        options.input,
        variants=options.variant,
        mask=options.mask,
        session_layer=options.session_layer,
        load_payloads=not options.no_payloads,
        messages=messages,
    )


def stage_settings(
    stage: Usd.Stage, options: argparse.Namespace, time: Usd.TimeCode, messages: Messages
) -> StageSettings:
    """Read the settings prim that the command line or the stage names; defaults if there is none."""
    prim = _prim_of_option(stage, options.settings, "--settings") if options.settings else None
    if prim is not None and prim.GetTypeName() != "RenderSettings":
        raise UsageError(
            f"--settings: <{prim.GetPath()}> is a {prim.GetTypeName() or 'prim'}, not a RenderSettings"
        )
    prim = prim or find_settings(stage, messages)
    if prim is None:
        return StageSettings()
    return read_settings(prim, time, messages, known_aovs=[aov.name for aov in tyndall.list_aovs()])


def drawn_purposes(options: argparse.Namespace, settings: StageSettings) -> tuple[str, ...]:
    """Return the purposes to draw: those of the settings and those of ``--purposes``."""
    extra = [name for text in options.purposes for name in text.replace(",", " ").split()]
    unknown = [name for name in extra if name not in PURPOSES]
    if unknown:
        raise UsageError(f"--purposes: {unknown[0]!r} is not one of {', '.join(PURPOSES)}")
    return tuple(dict.fromkeys((*settings.purposes, *extra)))


def find_cameras(stage: Usd.Stage) -> list[Usd.Prim]:
    """Return every camera, also in native instances."""
    return [p for p in stage.Traverse(Usd.TraverseInstanceProxies()) if p.GetTypeName() == "Camera"]


def choose_camera(
    stage: Usd.Stage, wanted: str | None, from_settings: str | None, messages: Messages
) -> Usd.Prim:
    """Return the camera to render through: `wanted`, that of the settings, or the first.

    Raises
    ------
    UsageError
        There is none that is called `wanted`.
    tyndall.SceneError
        The stage has no camera.
    """
    if wanted:
        return _camera_of_option(stage, wanted)
    if from_settings:
        prim = stage.GetPrimAtPath(from_settings)
        if prim and prim.GetTypeName() == "Camera":
            return prim
        messages.warning(
            from_settings, "the settings' camera does not exist", "the stage's first camera is used"
        )
    cameras = find_cameras(stage)
    if not cameras:
        raise tyndall.SceneError(
            "the stage has no camera; add a Camera prim, or a layer that has one by --session-layer"
        )
    if len(cameras) > 1:
        names = ", ".join(str(camera.GetPath()) for camera in cameras[:8])
        messages.warning(
            cameras[0].GetPath(),
            f"the first of {len(cameras)} cameras is used: {names}",
            "choose one by --camera",
        )
    return cameras[0]


def _camera_of_option(stage: Usd.Stage, wanted: str) -> Usd.Prim:
    cameras = find_cameras(stage)
    if wanted.startswith("/") and Sdf.Path.IsValidPathString(wanted) and stage.GetPrimAtPath(wanted):
        prim = stage.GetPrimAtPath(wanted)
        if prim.GetTypeName() != "Camera":
            raise UsageError(f"--camera: <{wanted}> is a {prim.GetTypeName() or 'prim'}, not a Camera")
        return prim
    named = [
        camera
        for camera in cameras
        if camera.GetName() == wanted or str(camera.GetPath()).endswith("/" + wanted)
    ]
    if len(named) == 1:
        return named[0]
    known = ", ".join(str(camera.GetPath()) for camera in named or cameras) or "none"
    problem = f"{len(named)} cameras are called" if named else "there is no camera"
    raise UsageError(f"--camera: {problem} {wanted!r}; cameras: {known}")


def _prim_of_option(stage: Usd.Stage, text: str, option: str) -> Usd.Prim:
    prim = stage.GetPrimAtPath(text) if Sdf.Path.IsValidPathString(text) and text.startswith("/") else None
    if not prim:
        raise UsageError(f"{option}: there is no prim <{text}>")
    return prim
