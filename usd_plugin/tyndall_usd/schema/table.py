"""The render settings that stages may author as ``tyndall:`` attributes of a RenderSettings prim.

Camera, resolution, pixel aspect ratio and AOVs are not here: UsdRender has its own attributes for them.
"""

from __future__ import annotations

from dataclasses import dataclass

PREFIX = "tyndall:"
SCHEMA = "TyndallRenderSettingsAPI"


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting: its name, its type in USD, what the core uses unless it is authored, and a sentence."""

    name: str
    usd_type: str
    default: int | float | str
    doc: str
    choices: tuple[str, ...] = ()


SETTINGS: tuple[Setting, ...] = (
    Setting("samples", "int64", 1024, "Samples per pixel."),
    Setting(
        "noiseThreshold",
        "float",
        0.0,
        "Standard error over the root of the brightness at which a pixel gets no more samples; 0: never.",
    ),
    Setting("timeLimit", "float", 0.0, "Seconds after which no new pass begins; 0 is no limit."),
    Setting("maxBounces", "int", 64, "How often light may scatter, in media and at surfaces."),
    Setting("seed", "int64", 0, "Random seed; the same seed gives the same image."),
    Setting("threads", "int", 0, "Worker threads; 0 is all cores."),
    Setting("filter", "token", "blackman-harris", "Pixel filter.", ("blackman-harris", "box")),
    Setting(
        "distanceSampling",
        "token",
        "auto",
        "How camera rays choose where to scatter; auto is delta in this version.",
        ("auto", "odds", "target", "nds", "nds+", "delta"),
    ),
    Setting(
        "lightSampling",
        "token",
        "event",
        "Where camera rays sample light in media with odds or target: candidate does so where they pass too.",
        ("event", "candidate"),
    ),
    Setting(
        "guiding",
        "token",
        "auto",
        "Whether directions are guided; auto is off in this version.",
        ("auto", "on", "off"),
    ),
    Setting(
        "cachePath",
        "string",
        "",
        "File of the guiding cache, which keeps what is learned for the next render; empty for none.",
    ),
    Setting(
        "cacheMode",
        "token",
        "auto",
        "What the cache is used for: auto reads and writes, read only reads, train only writes.",
        ("auto", "read", "train", "off"),
    ),
    Setting(
        "proceduralResolution",
        "int",
        256,
        "Most voxels along an axis of a procedural medium; those with little detail get fewer.",
    ),
)
