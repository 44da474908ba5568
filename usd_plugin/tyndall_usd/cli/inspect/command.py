"""What ``tyndall inspect`` does: train, choose a point, look around from it, draw."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyndall
from pxr import UsdGeom
from tyndall.messages import Messages

from tyndall_usd.cli.exit_codes import ExitCode, UsageError
from tyndall_usd.cli.inputs import open_input, stage_settings
from tyndall_usd.cli.inspect import view
from tyndall_usd.cli.inspect.cells import Cells, Vertices
from tyndall_usd.cli.inspect.sphere import Basis, Surroundings, see_all_around
from tyndall_usd.cli.log import LOG, DiagnosticLog
from tyndall_usd.cli.native_stderr import caught_stderr
from tyndall_usd.cli.progress import progress_reporter
from tyndall_usd.cli.shot import Shot
from tyndall_usd.stage import first_time

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from pxr import Usd
    from tyndall.prims import Camera

    from tyndall_usd.cli.inspect.view import Array

FORMATS = (".png", ".pdf", ".svg")
_AOVS = ("rgba", "depth", "volume_depth", "vsp", "normal")
#: Samples a pixel unless the command line says otherwise.
_SAMPLES = 64
#: Cameras that look around stay this much of the way to the camera off a surface.
_OFF_SURFACE = 1e-3


@dataclass(frozen=True, slots=True)
class Place:
    """The point whose light is shown."""

    position: Array
    vertices: Vertices
    pixel: tuple[int, int] | None  #: column and row, if the point was chosen in the image
    normal: Array | None  #: of the surface, if known


@dataclass(frozen=True, slots=True)
class Inspection:
    """All that the figure shows."""

    title: str
    camera: Camera
    images: dict[str, Array]
    field: tyndall.Field
    cells: Cells
    place: Place
    lobes: list[dict[str, Any]]
    basis: Basis
    #: Without guides: all that arrives, and lights seen directly alone; None if not asked for.
    reference: tuple[Surroundings, Surroundings] | None
    slice_axis: int
    statistics: dict[str, Any]


def run_inspect(options: argparse.Namespace) -> int:
    """Draw what `options` ask for and return the exit code."""
    output = _check_output(options)
    draw = _plotter()
    messages = Messages()
    with caught_stderr():
        stage = open_input(options, messages)
        time = first_time(stage)
        settings = stage_settings(stage, options, time, messages)
        shot = Shot(stage, settings, options)
        messages.send(shot.delegate)
        shot.index.sync(time)
    camera, wanted = shot.sync_camera(settings.products[0].view, time)
    draw(_inspect(shot, stage, camera, wanted, options), output)
    LOG.info("%s", output)
    return ExitCode.DONE


def _check_output(options: argparse.Namespace) -> Path:
    output = Path(options.output)
    if output.suffix.lower() not in FORMATS:
        raise UsageError(f"{output}: figures are written as {', '.join(FORMATS)}; change the file's ending")
    if not output.parent.is_dir():
        raise tyndall.FileError(f"{output.parent} is not a folder; create it")
    return output


def _plotter() -> Callable[[Inspection, Path], None]:
    """Import the drawing half, which needs a library that rendering does not."""
    try:
        from tyndall_usd.cli.inspect.figure import draw
    except ImportError as error:
        raise tyndall.Error(
            f"inspect draws with matplotlib: {error}; pip install 'tyndall-usd[inspect]'"
        ) from None
    return draw


def _inspect(
    shot: Shot, stage: Usd.Stage, camera: Camera, wanted: dict[str, Any], options: argparse.Namespace
) -> Inspection:
    settings = {**wanted, "guiding": "on", "filter": "box", "aovs": list(_AOVS)}
    if options.spp is None and options.time is None:
        settings["samples"] = _SAMPLES
    if settings["maxBounces"] < 2:
        raise UsageError("--max-bounces: with fewer than 2 there is direct light only, and nothing to learn")
    session = tyndall.Session(shot.delegate.commit(), settings)
    DiagnosticLog().show(session.diagnostics)
    with progress_reporter(options.progress, "training") as report:
        film = session.render(report)
    images = {name: np.array(film.aov(name), dtype=np.float64) for name in _AOVS}
    place = _choose_place(camera, images, options)
    field = session.field
    lobes = None if field is None else field.lobes(_coordinates(place.position), place.vertices)
    if field is None or lobes is None:
        raise _nothing_learned(place, session.statistics["world"]["media"])
    up = np.array([0.0, 0.0, 1.0] if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else [0.0, 1.0, 0.0])
    return Inspection(
        title=Path(options.input).name,
        camera=camera,
        images=images,
        field=field,
        cells=Cells.of(field, place.vertices),
        place=place,
        lobes=lobes,
        basis=Basis.facing(view.forward_of(camera), up),
        reference=_look_around(shot, settings, camera, place, options),
        slice_axis=_slice_axis(camera, options),
        statistics=session.statistics,
    )


def _choose_place(camera: Camera, images: dict[str, Array], options: argparse.Namespace) -> Place:
    if options.point is not None:
        given: Vertices = "volume" if options.vertices == "auto" else options.vertices
        return Place(np.array(options.point), given, None, None)
    height, width = images["depth"].shape[:2]
    column, row = options.pixel or (width // 2, height // 2)
    if not (column < width and row < height):
        raise UsageError(f"--pixel: there is no pixel {column},{row} in an image of {width}x{height}")
    depths = {name: images[name][row, column, 0] < view.NO_DEPTH for name in ("depth", "volume_depth")}
    if not any(depths.values()):
        raise UsageError(f"--pixel: nothing scatters light at {column},{row}; choose another, or a --point")
    mostly_volume = depths["volume_depth"] and (images["vsp"][row, column, 0] >= 0.5 or not depths["depth"])
    of_pixel: Vertices = "volume" if mostly_volume else "surface"
    vertices: Vertices = of_pixel if options.vertices == "auto" else options.vertices
    name = "volume_depth" if vertices == "volume" else "depth"
    if not depths[name]:
        raise UsageError(f"--pixel: no path scattered {_where(vertices)} at {column},{row}; choose another")
    position = view.points_at(camera, images[name][..., 0])[row, column]
    normal = images["normal"][row, column]
    length = float(np.linalg.norm(normal))
    has_normal = vertices == "surface" and length > 0
    return Place(position, vertices, (column, row), normal / length if has_normal else None)


def _nothing_learned(place: Place, n_media: int) -> tyndall.Error:
    if place.vertices == "volume" and n_media == 0:
        return tyndall.SceneError("the stage has no media; give --vertices surface")
    point = ", ".join(f"{v:g}" for v in place.position)
    return tyndall.RenderError(
        f"nothing was learned about light {_where(place.vertices)} at ({point}); "
        "give more samples by --spp, or another --pixel"
    )


def _where(vertices: Vertices) -> str:
    return "in media" if vertices == "volume" else "on surfaces"


def _coordinates(point: Array) -> tuple[float, float, float]:
    return float(point[0]), float(point[1]), float(point[2])


def _look_around(
    shot: Shot, settings: dict[str, Any], camera: Camera, place: Place, options: argparse.Namespace
) -> tuple[Surroundings, Surroundings] | None:
    """Render what arrives at the place, and lights alone; one event fewer is left than at the camera."""
    samples, size = options.reference_spp, options.reference_size
    if samples == 0:
        return None
    point = place.position
    if place.vertices == "surface":
        point = point + (view.position_of(camera) - point) * _OFF_SURFACE
    bounces = settings["maxBounces"] - 1

    def see(n: int, events: int) -> Surroundings:
        return see_all_around(shot, settings, point, size=size, samples=n, bounces=events)

    return see(samples, bounces), see(min(samples, 64), 0)


def _slice_axis(camera: Camera, options: argparse.Namespace) -> int:
    """Return the axis that the slice is across: by default the one nearest to the viewing direction."""
    if options.slice is not None:
        return "xyz".index(options.slice)
    return int(np.abs(view.forward_of(camera)).argmax())
