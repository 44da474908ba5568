"""What a guiding cache saves over a shot: three animated shots made here, each frame rendered cold and warm.

Errors need no reference: half the squared difference of two renders that differ in their seed is their
variance, and no render is biased. They are relative to the frame's mean image, as in the other benchmarks.
Costs are CPU seconds of rendering and learning, and numbers of rays, which no other process can disturb.
"""

from __future__ import annotations

import math
import resource
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyndall
import tyndall_usd
from pxr import Gf, Sdf, Usd, UsdGeom
from support.stages import StageBuilder, look_at
from support.statistics import RELATIVE_EPSILON
from tyndall.messages import Messages
from tyndall_usd.read.camera import read_camera

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    import numpy.typing as npt

N_FRAMES = 12
#: A trial of directions needs 256 guided pixels, one in sixteen.
RESOLUTION = (80, 56)
VOXELS = 48
BOUNCES = 12
#: Names of modes and what they ask for.
MODES: dict[str, dict[str, str]] = {
    "odds": {"distanceSampling": "odds", "guiding": "off"},
    "auto": {"distanceSampling": "odds", "guiding": "auto"},
    "on": {"distanceSampling": "odds", "guiding": "on"},
}
#: Renders of one sample a pixel that tell the variance of a first pass.
FIRST_PASSES = 6


@dataclass(frozen=True, slots=True)
class Sampled:
    """Renders of as many samples a pixel that differ in their seed; costs are of one of them."""

    spp: int
    cpu_seconds: float
    rays: float
    error: float


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame of a shot in one mode, without a cache and with that of the frames before."""

    shot: str
    mode: str
    frame: int
    cold: Sampled
    warm: Sampled
    half_warm: Sampled
    cold_first_pass: float
    warm_first_pass: float

    def time_ratio(self, cost: str) -> float:
        """Return the warm render's cost until it has the error of the cold one, over the cold one's cost."""
        wanted = math.log(self.cold.error)
        points = [(math.log(s.error), math.log(getattr(s, cost))) for s in (self.warm, self.half_warm)]
        (low, late), (high, early) = points
        if low < wanted < high:
            at = late + (early - late) * (wanted - low) / (high - low)
        else:
            # Beyond what was rendered: errors fall as one over time.
            at = late + low - wanted if wanted <= low else early + high - wanted
        return math.exp(at) / float(getattr(self.cold, cost))

    def cost_ratio(self, cost: str) -> float:
        """Return what as many samples cost warm over cold."""
        return float(getattr(self.warm, cost)) / float(getattr(self.cold, cost))


def blobs(seed: int, count: int, time: float = 0.0) -> npt.NDArray[np.float32]:
    """Return a billowing density in [0, 1] on a cube; `time` in [0, 1] lets it rise and spread."""
    rng = np.random.default_rng(seed)
    axis = (np.arange(VOXELS) + 0.5) / VOXELS * 2 - 1
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    total = np.zeros_like(x)
    for _ in range(count):
        place, size = rng.uniform(-0.5, 0.5, 3), rng.uniform(0.12, 0.3)
        drift = rng.uniform(-0.3, 0.3, 3) + np.array((0.0, 0.4, 0.0))
        px, py, pz = place + time * drift
        grown = size * (1.0 + 0.4 * time)
        total += np.exp(-((x - px) ** 2 + (y - py) ** 2 + (z - pz) ** 2) / grown**2)
    return np.clip(total - 0.35, 0.0, 1.0).astype(np.float32)


def write_grid(path: Path, density: npt.NDArray[np.float32], half: float) -> Path:
    """Write a cube of the half size `half` around the origin."""
    voxel = 2 * half / VOXELS
    tyndall.write_vdb(str(path), "density", density, voxel, ((voxel / 2) - half,) * 3)
    return path


def animated(stage: Usd.Stage, path: str, matrix: Callable[[float], Gf.Matrix4d]) -> None:
    """Place a prim anew in every frame; the argument of `matrix` goes from 0 to 1."""
    xform = UsdGeom.Xformable(stage.GetPrimAtPath(path))
    xform.ClearXformOpOrder()
    op = xform.MakeMatrixXform()
    for frame in range(1, N_FRAMES + 1):
        op.Set(matrix((frame - 1) / (N_FRAMES - 1)), float(frame))


def cloud(folder: Path) -> StageBuilder:
    """Return a camera that moves past a cloud over a plain, under a low sun."""
    stage = StageBuilder(*RESOLUTION)
    stage.camera((0, 0.6, 7), (0, 0.4, 0), vfov=38)
    stage.quad((-30, -2, 30), (60, 0, 0), (0, 0, -60), stage.lambert((0.3, 0.35, 0.25)))
    grid = write_grid(folder / "cloud.vdb", blobs(3, 14), 2.0)
    stage.volume(grid, stage.medium(6.0, 0.99, 0.6, field="density"))
    stage.distant((-1, -0.6, -0.4), 3.0, angle=0.5)
    stage.dome((0.25, 0.35, 0.55))
    move = lambda t: look_at((-1.2 + 2.4 * t, 0.6, 7 - 0.5 * t), (0.2 * t, 0.4, 0))  # noqa: E731
    animated(stage.stage, "/World/Camera", move)
    return stage


def smoke(folder: Path) -> StageBuilder:
    """Return smoke that drifts over a floor beside a lamp: another grid in every frame."""
    stage = StageBuilder(*RESOLUTION)
    stage.camera((0, 0.8, 5.5), (0, 0.4, 0), vfov=40)
    dark = stage.lambert(0.08)
    stage.quad((-4, -1, 4), (8, 0, 0), (0, 0, -8), dark)
    stage.quad((-4, -1, -3), (8, 0, 0), (0, 6, 0), dark)
    files = [
        write_grid(folder / f"smoke.{frame:02}.vdb", blobs(8, 10, (frame - 1) / (N_FRAMES - 1)), 1.6)
        for frame in range(1, N_FRAMES + 1)
    ]
    path = stage.volume(files[0], stage.medium(3.0, 0.9, 0.3, field="density"))
    attribute = stage.stage.GetPrimAtPath(f"{path}/density").GetAttribute("filePath")
    for frame, file in enumerate(files, start=1):
        attribute.Set(Sdf.AssetPath(str(file)), float(frame))
    stage.rect_light((2.2, 2.5, 1.0), (0, 0, 0), 0.8, 0.8, 60.0)
    stage.dome((0.03, 0.03, 0.04))
    return stage


def lantern(_: Path) -> StageBuilder:
    """Return a lantern carried behind pillars through fog."""
    stage = StageBuilder(*RESOLUTION)
    stage.camera((0, 0.3, 6), (0, 0, 0), vfov=45)
    grey = stage.lambert((0.5, 0.45, 0.4))
    stage.quad((-5, -1.2, 5), (10, 0, 0), (0, 0, -10), grey)
    stage.quad((-5, -1.2, -4), (10, 0, 0), (0, 6, 0), grey)
    for x in (-1.6, 0.0, 1.6):
        stage.box((x - 0.2, -1.2, -0.2), (x + 0.2, 3, 0.2), grey)
    stage.box((-4.9, -1.19, -3.9), (4.9, 4, 7), stage.medium(0.12, 0.95, 0.5))
    light = stage.sphere_light((0, 0, 0), 0.12, 60.0)
    move = lambda t: Gf.Matrix4d(1).SetTranslate(Gf.Vec3d(-1.8 + 3.6 * t, 0.2, -1.0))  # noqa: E731
    animated(stage.stage, light, move)
    return stage


SHOTS: dict[str, Callable[[Path], StageBuilder]] = {"cloud": cloud, "smoke": smoke, "lantern": lantern}


def frames_of(path: Path) -> Iterator[tuple[int, Any, dict[str, Any]]]:
    """Give the number, scene and settings of every frame of a stage, moving forward in one index."""
    stage = tyndall_usd.open_stage(path)
    delegate = tyndall.RenderDelegate()
    index = tyndall_usd.SceneIndex(stage, delegate)
    camera = stage.GetPrimAtPath("/World/Camera")
    for frame in range(1, N_FRAMES + 1):
        time = Usd.TimeCode(frame)
        index.sync(time)
        messages = Messages()
        index.sync_camera("/World/Camera", read_camera(camera, time, messages), messages)
        yield (
            frame,
            delegate.commit(),
            {
                "camera": "/World/Camera",
                "resolution": list(RESOLUTION),
                "maxBounces": BOUNCES,
                "filter": "box",
            },
        )


@dataclass(frozen=True, slots=True)
class Renderer:
    """Renders one frame in one mode."""

    scene: Any
    settings: dict[str, Any]
    frame: int

    def render(self, spp: int, seed: int, cache: Path | None, cache_mode: str) -> tuple[Any, float, float]:
        """Return image, CPU seconds and rays of one render."""
        settings = {**self.settings, "samples": spp, "seed": seed, "cacheMode": cache_mode}
        settings["cachePath"] = str(cache) if cache else ""
        session = tyndall.Session(self.scene, settings)
        before = resource.getrusage(resource.RUSAGE_SELF)
        film = session.render(None, None, float(self.frame))
        after = resource.getrusage(resource.RUSAGE_SELF)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        counts = session.statistics
        rays = counts["segments"] + counts["shadowRays"] + counts["guidedEvents"]
        return np.array(film.aov("rgba"))[..., :3].astype(np.float64), seconds, float(rays)

    def pair(self, spp: int, cache: Path | None, last_mode: str = "read") -> tuple[Sampled, Any]:
        """Return two renders, the second with `last_mode`, and their mean image."""
        mode = "read" if cache else "off"
        found = [
            self.render(spp, 100, cache, mode),
            self.render(spp, 200, cache, last_mode if cache else "off"),
        ]
        (a, *_), (b, *_) = found
        cost = [sum(f[i] for f in found) / 2 for i in (1, 2)]
        return Sampled(spp, cost[0], cost[1], relative(0.5 * (a - b) ** 2, (a + b) / 2)), (a + b) / 2

    def first_pass(self, cache: Path | None, mean: Any) -> float:
        """Return the variance of the first sample of a pixel."""
        mode = "read" if cache else "off"
        images = np.stack([self.render(1, seed, cache, mode)[0] for seed in range(FIRST_PASSES)])
        return relative(images.var(axis=0, ddof=1), mean)


def relative(squares: Any, mean: Any) -> float:
    """Return the mean of squares relative to a frame's image; the worst 0.1 % of pixels do not count."""
    values = np.sort((squares / (mean**2 + RELATIVE_EPSILON)).mean(axis=-1).ravel())
    return float(values[: len(values) - max(1, len(values) // 1000)].mean())


def measure(shots: Sequence[str], modes: Sequence[str], spp: int, frames: int) -> list[Frame]:
    """Render the first `frames` frames of every shot in every mode, cold and warm."""
    found = []
    for name in shots:
        with tempfile.TemporaryDirectory() as folder:
            stage = SHOTS[name](Path(folder)).save(Path(folder) / f"{name}.usda")
            for frame, scene, settings in frames_of(stage):
                if frame > frames:
                    break
                for mode in modes:
                    cache = Path(folder) / f"{name}.{mode}.tyc"
                    renderer = Renderer(scene, {**settings, **MODES[mode]}, frame)
                    if frame == 1:
                        renderer.render(spp, 200, cache, "train")
                        continue
                    found.append(compare(renderer, name, mode, spp, cache))
                    sys.stderr.write(f"{row(found[-1])}\n")
    return found


def compare(renderer: Renderer, shot: str, mode: str, spp: int, cache: Path) -> Frame:
    """Render a frame without and with the cache of those before, and let it learn."""
    cold, mean = renderer.pair(spp, None)
    firsts = [renderer.first_pass(file, mean) for file in (None, cache)]
    half, _ = renderer.pair(spp // 2, cache)
    warm, _ = renderer.pair(spp, cache, "auto")
    return Frame(shot, mode, renderer.frame, cold, warm, half, *firsts)


def row(frame: Frame) -> list[str]:
    """Return the figures of one frame, for following a run."""
    ratios = [frame.time_ratio("cpu_seconds"), frame.time_ratio("rays"), frame.cost_ratio("cpu_seconds")]
    first = frame.warm_first_pass / frame.cold_first_pass
    return [frame.shot, frame.mode, str(frame.frame), *(f"{ratio:.2f}" for ratio in (*ratios, first))]


def summary(frames: Sequence[Frame]) -> list[list[str]]:
    """Return a table: geometric means over the frames of each shot and mode, and the slowest frame."""
    head = [
        "shot",
        "mode",
        "time to the cold error",
        "the same in rays",
        "slowest frame, in rays",
        "first pass, variance",
        "same samples, CPU",
        "same samples, rays",
    ]
    rows = [head]
    for shot, mode in dict.fromkeys((f.shot, f.mode) for f in frames):
        of = [f for f in frames if (f.shot, f.mode) == (shot, mode)]
        columns = [
            mean(f.time_ratio("cpu_seconds") for f in of),
            mean(f.time_ratio("rays") for f in of),
            max(f.time_ratio("rays") for f in of),
            mean(f.warm_first_pass / f.cold_first_pass for f in of),
            mean(f.cost_ratio("cpu_seconds") for f in of),
            mean(f.cost_ratio("rays") for f in of),
        ]
        rows.append([shot, mode, *(f"{column:.2f}" for column in columns)])
    return rows


def mean(values: Iterator[float]) -> float:
    """Return the geometric mean."""
    logs = [math.log(value) for value in values]
    return math.exp(sum(logs) / len(logs))


def as_json(frames: Sequence[Frame]) -> list[dict[str, Any]]:
    """Return everything that was measured."""
    return [asdict(frame) for frame in frames]
