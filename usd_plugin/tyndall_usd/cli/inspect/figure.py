"""The figure: image and cells above, learned and true light around one point below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from tyndall_usd.cli.inspect import view

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import SubFigure

    from tyndall_usd.cli.inspect.cells import Indices
    from tyndall_usd.cli.inspect.command import Inspection
    from tyndall_usd.cli.inspect.view import Array

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.titleweight": "bold",
}
_MAP, _MARK, _LEARNED, _TRUE = "inferno", "#00e0ff", "#d1495b", "#30638e"
#: Pixels of the maps of the sphere.
_LATITUDES, _LONGITUDES = 90, 180
#: Decades that logarithmic scales reach down.
_DECADES = 3.0


@dataclass(frozen=True, slots=True)
class Scale:
    """Ends of a logarithmic scale of colours."""

    least: float
    most: float

    def norm(self) -> LogNorm:
        """Return it as matplotlib has it."""
        return LogNorm(vmin=self.least, vmax=self.most)


def draw(inspection: Inspection, output: Path) -> None:
    """Write the figure."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(11.0, 6.6), dpi=160, layout="constrained")
        above, below = np.asarray(figure.subfigures(2, 1, height_ratios=(1.08, 1.0)))
        panels = above.subplots(1, 3, width_ratios=_widths(inspection))
        _draw_image(panels[0], inspection)
        _draw_slice(panels[1], inspection)
        _draw_profile(panels[2], inspection, _draw_maps(below, inspection))
        figure.suptitle(_headline(inspection), fontsize=9, x=0.01, ha="left")
        figure.savefig(output)


def _widths(inspection: Inspection) -> tuple[float, float, float]:
    """Return the shares of image, slice and profile, the first two by their own proportions."""
    height, width = inspection.images["rgba"].shape[:2]
    lower, upper = _slice_extent(inspection)
    x, y = _axes_of_slice(inspection)
    slice_ratio = float((upper[x] - lower[x]) / (upper[y] - lower[y]))
    return width / height, min(max(slice_ratio, 0.5), 2.0) + 0.4, 1.2


def _headline(inspection: Inspection) -> str:
    place, field = inspection.place, inspection.statistics["guide"]["field"]
    kind = "volume" if place.vertices == "volume" else "surface"
    point = ", ".join(f"{v:.4g}" for v in place.position)
    samples, memory = inspection.statistics["samples"], f"{field['bytes'] / 2**20:.1f} MiB"
    learned = f"{inspection.title}: light at {kind} vertices after {samples} samples a pixel"
    size = f"{field[f'{kind}Regions']:,} regions, {field['lobes']:,} lobes in all, {memory}"
    return f"{learned}; {size}; seen from ({point})"


def _draw_image(axes: Axes, inspection: Inspection) -> None:
    """Show the picture with the borders of cells: on its surfaces, or in media at the depth of the point."""
    place, images = inspection.place, inspection.images
    axes.imshow(_displayed(images["rgba"][..., :3]))
    if place.vertices == "surface":
        depth, title = _known(images["depth"]), "regions on what the camera sees"
    else:
        at = view.depth_of(inspection.camera, place.position)
        depth, title = (
            np.where(np.isfinite(_known(images["volume_depth"])), at, np.nan),
            "regions in the plane of the point",
        )
    points = view.points_at(inspection.camera, depth)
    axes.imshow(_borders(inspection.cells.at(points)), interpolation="nearest")
    if place.pixel is not None:
        axes.plot(*place.pixel, "o", ms=9, mfc="none", mec=_MARK, mew=1.8)
    axes.set_title(title, loc="left")
    axes.set_axis_off()


def _known(depth: Array) -> Array:
    return np.where(depth[..., 0] < view.NO_DEPTH, depth[..., 0], np.nan)


def _displayed(rgb: Array) -> Array:
    """Return colours below white but for the brightest, encoded for sRGB displays."""
    white = max(float(np.quantile(rgb.max(axis=-1), 0.98)), 1e-30)
    linear = np.clip(rgb / white, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def _borders(numbers: Indices) -> Array:
    """Return an RGBA layer: white where a pixel's right or lower neighbour is in another cell."""
    is_border = np.zeros(numbers.shape, dtype=bool)
    is_border[:, :-1] |= numbers[:, :-1] != numbers[:, 1:]
    is_border[:-1] |= numbers[:-1] != numbers[1:]
    layer = np.ones((*numbers.shape, 4))
    layer[..., 3] = np.where(is_border & (numbers >= 0), 0.45, 0.0)
    return layer


def _draw_slice(axes: Axes, inspection: Inspection) -> None:
    """Show the cells that a plane through the point cuts: how much light is in them, and whence."""
    cells, place, across = inspection.cells, inspection.place, inspection.slice_axis
    x, y = _axes_of_slice(inspection)
    lower, upper = _slice_extent(inspection)
    cut = cells.cut(across, place.position[across])
    lows, highs = cells.lower[cut].clip(lower, upper), cells.upper[cut].clip(lower, upper)
    boxes = [
        Rectangle((low[x], low[y]), high[x] - low[x], high[y] - low[y])
        for low, high in zip(lows, highs, strict=True)
    ]
    light = cells.fluence[cut]
    patches = PatchCollection(
        boxes, cmap=_MAP, norm=_scale_of(light).norm(), edgecolor="white", linewidth=0.35
    )
    patches.set_array(np.maximum(light, 1e-30))
    axes.add_collection(patches)
    _draw_flow(axes, inspection, cut, lows, highs)
    axes.plot(place.position[x], place.position[y], "o", ms=9, mfc="none", mec=_MARK, mew=1.8)
    axes.set(xlim=(lower[x], upper[x]), ylim=(lower[y], upper[y]), aspect="equal")
    axes.set(xlabel=f"{'xyz'[x]} (arrows: where light comes from)", ylabel="xyz"[y])
    where = f"{'xyz'[across]} = {place.position[across]:.4g}"
    axes.set_title(f"regions at {where}", loc="left")
    bar = axes.figure.colorbar(patches, ax=axes, shrink=0.85, pad=0.02)
    bar.set_label("fluence")


def _slice_extent(inspection: Inspection) -> tuple[Array, Array]:
    """Return the box that is drawn: of nearly all samples, and the point."""
    lower, upper = inspection.cells.extent()
    return np.minimum(lower, inspection.place.position), np.maximum(upper, inspection.place.position)


def _axes_of_slice(inspection: Inspection) -> tuple[int, int]:
    """Return the other two axes, the one that is up last."""
    others = [axis for axis in range(3) if axis != inspection.slice_axis]
    up = int(np.abs(inspection.basis.up).argmax())
    x, y = (others[1], others[0]) if others[0] == up else (others[0], others[1])
    return x, y


def _draw_flow(axes: Axes, inspection: Inspection, cut: Indices, lows: Array, highs: Array) -> None:
    """Draw arrows in the larger cells, the longer the more one-sided the light is."""
    x, y = _axes_of_slice(inspection)
    sizes = np.minimum(highs[:, x] - lows[:, x], highs[:, y] - lows[:, y])
    if not len(cut):
        return
    shown = sizes >= np.quantile(sizes, max(0.0, 1.0 - 150 / len(cut)))
    middle, flow = 0.5 * (lows + highs)[shown], inspection.cells.flow[cut][shown]
    # Even light has short arrows, but not invisible ones.
    length = np.linalg.norm(flow, axis=1, keepdims=True)
    arrows = 0.85 * sizes[shown, None] * flow / np.sqrt(np.maximum(length, 1e-6))
    axes.quiver(
        middle[:, x],
        middle[:, y],
        arrows[:, x],
        arrows[:, y],
        angles="xy",
        scale_units="xy",
        scale=1.0,
        pivot="mid",
        units="inches",
        width=0.014,
        color="#9be8ff",
    )


def _draw_maps(panel: SubFigure, inspection: Inspection) -> Scale:
    """Show learned and true light in all directions; return their scale."""
    longitude = np.linspace(-np.pi, np.pi, _LONGITUDES + 1)
    latitude = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _LATITUDES + 1)
    middles = np.meshgrid(0.5 * (longitude[1:] + longitude[:-1]), 0.5 * (latitude[1:] + latitude[:-1]))
    directions = inspection.basis.directions(*middles)
    learned = _learned(inspection, directions)
    reference = inspection.reference
    true = None if reference is None else reference[0].radiance(directions)
    scale = _scale_of(learned if true is None else np.concatenate([learned.ravel(), true.ravel()]))
    norm = scale.norm()
    n_maps = 1 if true is None else 2
    maps = [panel.add_subplot(1, n_maps, 1 + i, projection="mollweide") for i in range(n_maps)]
    shown = [(maps[0], learned, f"learned: {len(inspection.lobes)} lobes, circles at one standard deviation")]
    if true is not None:
        shown.append((maps[1], true, "brute force; the middle is the direction of view"))
    for axes, values, title in shown:
        mesh = axes.pcolormesh(
            longitude, latitude, np.maximum(values, scale.least), norm=norm, cmap=_MAP, rasterized=True
        )
        axes.set_title(title, loc="left")
        axes.grid(visible=True, linewidth=0.3, alpha=0.4)
        axes.set_xticklabels([])
        axes.set_yticklabels([])
        _draw_horizon(axes, inspection, directions, middles)
    _draw_lobes(maps[0], inspection)
    bar = panel.colorbar(mesh, ax=maps, shrink=0.8, pad=0.02, aspect=30)
    bar.set_label("radiance")
    return scale


def _learned(inspection: Inspection, directions: Array) -> Array:
    place = inspection.place
    position = tuple(float(v) for v in place.position)
    flat = np.ascontiguousarray(directions.reshape(-1, 3))
    radiance = inspection.field.radiance(position, place.vertices, flat)  # type: ignore[arg-type]
    assert radiance is not None, "the point has lobes"
    return np.asarray(radiance, dtype=np.float64).reshape(directions.shape[:-1])


def _draw_horizon(axes: Axes, inspection: Inspection, directions: Array, middles: Sequence[Array]) -> None:
    """Cover what is below the surface."""
    if inspection.place.normal is not None:
        cosine = directions @ inspection.place.normal
        axes.contourf(*middles, cosine, levels=[-1.0, 0.0], colors=["#777777"], alpha=0.75)


def _draw_lobes(axes: Axes, inspection: Inspection) -> None:
    """Draw circles at one standard deviation, the more opaque the more light is in the lobe."""
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    heaviest = max(lobe["weight"] for lobe in inspection.lobes)
    for lobe in (lobe for lobe in inspection.lobes if lobe["kappa"] > 1.0):
        mean, radius = np.array(lobe["mean"]), min(lobe["kappa"] ** -0.5, 1.2)
        tangent = np.cross(mean, np.eye(3)[np.abs(mean).argmin()])
        tangent /= np.linalg.norm(tangent)
        around = np.cos(angle)[:, None] * tangent + np.sin(angle)[:, None] * np.cross(mean, tangent)
        longitude, latitude = inspection.basis.angles(np.cos(radius) * mean + np.sin(radius) * around)
        # Lines do not run across the map where the circle leaves it.
        jumps = np.abs(np.diff(longitude, append=longitude[-1])) > np.pi
        opacity = 0.25 + 0.75 * float(np.sqrt(lobe["weight"] / heaviest))
        axes.plot(np.where(jumps, np.nan, longitude), latitude, color=_MARK, lw=0.8, alpha=opacity)


def _draw_profile(axes: Axes, inspection: Inspection, scale: Scale) -> None:
    """Plot the radiance along the horizon, through the middle of the maps."""
    longitude = np.linspace(-np.pi, np.pi, 361)
    directions = inspection.basis.directions(longitude, np.zeros_like(longitude))
    degrees = np.degrees(longitude)
    if inspection.reference is not None:
        total, lights = (seen.radiance(directions) for seen in inspection.reference)
        scattered = np.maximum(total - lights, scale.least)
        axes.fill_between(degrees, scattered, np.maximum(total, scattered), color=_TRUE, alpha=0.25, lw=0)
        axes.plot(degrees, scattered, color=_TRUE, lw=1.0, label="brute force but for lights seen directly")
        axes.plot([], [], color=_TRUE, alpha=0.25, lw=6, label="with them")
    axes.plot(degrees, _learned(inspection, directions), color=_LEARNED, lw=1.4, label="learned")
    axes.set(yscale="log", xlim=(-180, 180), ylim=(scale.least, scale.most * 1.5))
    axes.set(xlabel="degrees from the direction of view", ylabel="radiance", xticks=range(-180, 181, 90))
    axes.set_title("along the horizon", loc="left")
    axes.grid(visible=True, linewidth=0.3)
    axes.legend(fontsize=6.5, loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False)


def _scale_of(values: Array) -> Scale:
    """Return a scale that ends at nearly the largest value, some decades long."""
    positive = values[np.isfinite(values) & (values > 0)]
    top = float(np.quantile(positive, 0.998)) if positive.size else 1.0
    least = float(np.quantile(positive, 0.01)) if positive.size else 0.1
    return Scale(min(max(least, top / 10**_DECADES), 0.5 * top), top)
