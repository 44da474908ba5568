"""Opening stages: variants, masks, payload rules, session layer; composition errors become messages."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import tyndall
from pxr import Ar, Plug, Sdf, Tf, Usd

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tyndall.messages import Messages

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


def register_schemas() -> None:
    """Make the codeless API schema ``TyndallRenderSettingsAPI`` known to USD."""
    Plug.Registry().RegisterPlugins(str(Path(__file__).parent / "schema"))


def open_stage(
    path: str | Path,
    *,
    variants: Iterable[str] = (),
    mask: Iterable[str] = (),
    session_layer: str | Path | None = None,
    load_payloads: bool = True,
    messages: Messages | None = None,
) -> Usd.Stage:
    """Open the stage at `path`.

    Parameters
    ----------
    variants : iterable of str
        Selections ``PRIM:SET=NAME``, which win over those in the stage.
    mask : iterable of str
        Prims to populate, with their ancestors and what they refer to; empty for all.
    session_layer : path or None
        A layer stronger than the stage.
    messages : Messages or None
        Receives composition errors.

    Raises
    ------
    tyndall.FileError
        The file is missing or is not a stage.
    """
    register_schemas()
    _require_file(path)
    session = Sdf.Layer.CreateAnonymous("session")
    if session_layer is not None:
        _require_file(session_layer)
        session.subLayerPaths.append(str(Path(session_layer).absolute()))
    try:
        layer = Sdf.Layer.FindOrOpen(str(path))
        if layer is None:
            raise tyndall.FileError(f"{path} is not a USD file (expected {', '.join(SUFFIXES)})")
        load = Usd.Stage.LoadAll if load_payloads else Usd.Stage.LoadNone
        paths = [_prim_path(prim, "--mask") for prim in mask]
        if paths:
            population = Usd.StagePopulationMask(paths)
            stage = Usd.Stage.OpenMasked(layer, session, population, load)
            stage.ExpandPopulationMask()
        else:
            stage = Usd.Stage.Open(layer, session, load)
    except Tf.ErrorException as error:
        raise tyndall.FileError(f"{path} cannot be opened: {_first_line(error)}") from None
    for selection in variants:
        _select_variant(stage, selection)
    if messages is not None:
        _report_composition_errors(stage, messages)
    return stage


def first_time(stage: Usd.Stage) -> Usd.TimeCode:
    """Return the time an image is made for if none is asked: the stage's start, or its earliest sample."""
    if stage.HasAuthoredTimeCodeRange():
        return Usd.TimeCode(stage.GetStartTimeCode())
    return Usd.TimeCode.EarliestTime()


def _require_file(path: str | Path) -> None:
    """Raise if `path` can be found neither as a file nor by USD's asset resolver."""
    target = Path(path)
    if target.is_dir():
        raise tyndall.FileError(f"{path} is a folder; name a USD file in it")
    if not target.exists() and not Ar.GetResolver().Resolve(str(path)):
        raise tyndall.FileError(f"{path} does not exist; check the path")


def _prim_path(text: str, option: str) -> Sdf.Path:
    path = Sdf.Path(text) if Sdf.Path.IsValidPathString(text) else Sdf.Path()
    if not path.IsAbsolutePath() or not (path.IsPrimPath() or path.IsAbsoluteRootPath()):
        raise tyndall.SettingsError(f"{option} {text!r} is not a prim path such as /World/Prop")
    return path


def _select_variant(stage: Usd.Stage, selection: str) -> None:
    head, _, name = selection.rpartition("=")
    prim_text, _, set_name = head.rpartition(":")
    if not prim_text or not set_name:
        raise tyndall.SettingsError(f"--variant {selection!r} is not of the form PRIM:SET=NAME")
    prim = stage.GetPrimAtPath(_prim_path(prim_text, "--variant"))
    if not prim:
        raise tyndall.SettingsError(f"--variant: there is no prim <{prim_text}>")
    sets = prim.GetVariantSets()
    if set_name not in sets.GetNames():
        known = ", ".join(sets.GetNames()) or "none"
        raise tyndall.SettingsError(
            f"--variant: <{prim_text}> has no variant set {set_name!r}; it has: {known}"
        )
    variant_set = sets.GetVariantSet(set_name)
    if name and name not in variant_set.GetVariantNames():
        known = ", ".join(variant_set.GetVariantNames())
        raise tyndall.SettingsError(
            f"--variant: {set_name} of <{prim_text}> has no {name!r}; it has: {known}"
        )
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        variant_set.SetVariantSelection(name)


def _report_composition_errors(stage: Usd.Stage, messages: Messages) -> None:
    for error in stage.GetCompositionErrors():
        text = _first_line(error)
        root = getattr(error, "rootSite", None)
        path = root.path if root is not None else ""
        if ".mtlx" in text:
            messages.warning(
                path,
                f"MaterialX layer skipped: {text}",
                "install usd-exchange instead of usd-core to read .mtlx layers",
            )
        else:
            messages.error(path, f"composition error: {text}", "correct the reference, payload or sublayer")


def _first_line(error: object) -> str:
    """Return the text of an error of USD in one line, without the place in USD's own source."""
    text = " ".join(str(error).split()) or type(error).__name__
    match = re.search(r"Error in '.*?' at line \d+ in file \S+ : '(.*)'", text)
    return (match[1] if match else text)[:400].strip()
