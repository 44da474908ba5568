"""The arguments of every command. Spellings of usdrecord and husk are accepted where the meaning is equal."""

from __future__ import annotations

import argparse
import math
import re
from typing import TYPE_CHECKING, NoReturn

from tyndall_usd.cli.exit_codes import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

#: Options of later versions: recognised, and refused instead of ignored.
_LATER_OPTIONS: dict[str, int | None] = {
    "--noise-threshold": 1,
    "--tile-index": 1,
    "--tile-count": 2,
    "--tile-suffix": 1,
    "--snapshot": 1,
    "--pass": 1,
    "--renderPassPrimPath": 1,
}
_LATER_COMMANDS = ("compare", "bench", "job")
_DISTANCE_SAMPLING = ("auto", "odds", "target", "nds", "nds+", "delta")
_GUIDING = ("auto", "on", "off")
_CACHE_MODES = ("auto", "read", "train", "off")


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message}; see {self.prog} --help")


class _NotAvailable(argparse.Action):
    """An option of a later version."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,  # noqa: ARG002
        namespace: argparse.Namespace,  # noqa: ARG002
        values: str | Sequence[Any] | None,  # noqa: ARG002
        option_string: str | None = None,
    ) -> None:
        raise UsageError(f"{option_string} is not available in this version")


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = _Parser(
        prog="tyndall", description="Render volumes and surfaces from USD stages.", allow_abbrev=False
    )
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    parser.add_argument("--list-aovs", action="store_true", help="print the AOVs and exit")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)
    _add_render(commands.add_parser("render", help="render a stage to images", allow_abbrev=False))
    _add_info(commands.add_parser("info", help="show what is in a stage", allow_abbrev=False))
    _add_inspect(
        commands.add_parser("inspect", help="draw what guiding learns of the light", allow_abbrev=False)
    )
    _add_merge(commands.add_parser("merge", help="add up parts made by --sample-range", allow_abbrev=False))
    _add_cache(commands.add_parser("cache", help="look at guiding caches", allow_abbrev=False))
    for name in _LATER_COMMANDS:
        later = commands.add_parser(name, help=argparse.SUPPRESS, allow_abbrev=False)
        later.add_argument("rest", nargs=argparse.REMAINDER)
    return parser


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parse the command line.

    Raises
    ------
    UsageError
        An option is unknown, lacks a value, has a wrong one, or belongs to a later version.
    """
    options = make_parser().parse_args(arguments)
    if options.command in _LATER_COMMANDS:
        raise UsageError(f"tyndall {options.command} is not available in this version")
    return options


def _add_common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--variant", action="append", default=[], metavar="PRIM:SET=NAME", help="select a variant"
    )
    parser.add_argument(
        "--mask", action="append", default=[], metavar="PRIM", help="populate only these prims"
    )
    parser.add_argument("--session-layer", "--sessionLayer", metavar="FILE", help="a layer over the stage")
    parser.add_argument("--no-payloads", action="store_true", help="do not load payloads")
    parser.add_argument(
        "--purposes",
        "--purpose",
        action="append",
        default=[],
        metavar="NAME[,NAME]",
        help="draw these purposes besides default and render: proxy, guide",
    )
    parser.add_argument(
        "--settings",
        "-rs",
        "-s",
        "--renderSettingsPrimPath",
        metavar="PRIM",
        help="the RenderSettings prim to use",
    )
    _add_log(parser)


def _add_log(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-v", "--verbose", action="count", default=0, help="say more; -vv shows tracebacks")
    parser.add_argument("-q", "--quiet", action="store_true", help="show only errors")
    parser.add_argument("--log-json", action="store_true", help="log as one JSON object a line")


def _add_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", metavar="INPUT", help=".usd .usda .usdc .usdz")
    parser.add_argument("--json", action="store_true", help="as JSON")
    _add_common(parser)


def _add_merge(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("parts", metavar="PART", nargs="+", help="images made by --sample-range")
    parser.add_argument("-o", "--output", metavar="PATH", required=True, help=".exr or .png")
    parser.add_argument("--strict", action="store_true", help="exit with 3 if guiding learned in the parts")
    _add_log(parser)


def _add_cache(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(
        dest="cache_command", metavar="ACTION", required=True, parser_class=_Parser
    )
    info = actions.add_parser("info", help="show what a cache holds", allow_abbrev=False)
    info.add_argument("file", metavar="FILE", help="a guiding cache, as --cache writes it")
    info.add_argument("--json", action="store_true", help="as JSON")


def _add_render(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", metavar="INPUT", nargs="?", help=".usd .usda .usdc .usdz")
    parser.add_argument("output_argument", metavar="OUT", nargs="?", help=argparse.SUPPRESS)
    add = parser.add_argument
    add(
        "-o",
        "--output",
        metavar="PATH",
        help='.exr (multi-layer) or .png; "####" or "$F4" is the frame number',
    )
    add("-f", "--frames", "--frame", metavar="FRAMES", help="such as 1001:1010x2,1020")
    add("-n", "--frame-count", type=_positive_int, metavar="N", help="number of frames from the one of -f")
    add("-i", "--frame-inc", type=_positive_int, metavar="N", default=1, help="step of --frame-count")
    add("-d", "--default-time", "--defaultTime", action="store_true", help="render the stage's default time")
    add("--aov", nargs="+", action="extend", metavar="NAME", help="AOVs to write; see --list-aovs")
    add("--list-aovs", action="store_true", help="print the AOVs and exit")
    add("--disable-motionblur", action="store_true", help="accepted; motion is never blurred in this version")
    add("--make-output-path", action="store_true", help="create the output's folder")
    add("--skip-existing-frames", action="store_true", help="leave frames whose file exists")
    add("--stats", metavar="FILE.json", help="write times, memory and counts")
    add("--strict", action="store_true", help="exit with 3 if there were warnings or errors")
    add(
        "--sample-range",
        type=_sample_range,
        metavar="A:B",
        help="render only the samples A to B-1 of --spp, as a part for tyndall merge; multiples of 32",
    )
    add(
        "--checkpoint",
        type=_seconds,
        metavar="SECONDS",
        help="save the render so often, beside the image as .checkpoint",
    )
    add("--resume", action="store_true", help="go on from the checkpoint if there is one")
    for option, n_values in _LATER_OPTIONS.items():
        add(option, action=_NotAvailable, nargs=n_values, help=argparse.SUPPRESS)
    _add_image(parser)
    _add_common(parser)


def _add_inspect(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", metavar="INPUT", help=".usd .usda .usdc .usdz")
    add = parser.add_argument
    add("-o", "--output", metavar="PATH", required=True, help="the figure: .png, .pdf or .svg")
    place = parser.add_mutually_exclusive_group()
    place.add_argument(
        "--pixel",
        type=_pixel,
        metavar="X,Y",
        help="show the light where this pixel scatters; default: middle",
    )
    place.add_argument(
        "--point", type=_point, metavar="X,Y,Z", help="show the light at this point of the stage"
    )
    add(
        "--vertices",
        choices=("auto", "volume", "surface"),
        default="auto",
        help="light at vertices in media or on surfaces; default: what the pixel mostly sees",
    )
    add("--slice", choices=("x", "y", "z"), help="draw cells across this axis; default: nearest to the view")
    add(
        "--reference-spp",
        type=_count,
        default=256,
        metavar="N",
        help="samples of the unguided light around the point; 0 leaves it out",
    )
    add("--reference-size", type=_positive_int, default=32, metavar="N", help="pixels across a sixth of it")
    _add_image(parser)
    _add_common(parser)


def _add_image(parser: argparse.ArgumentParser) -> None:
    """Add what decides the image of one frame, and how it is sampled."""
    add = parser.add_argument
    add("-c", "--camera", "-cam", metavar="PATH|NAME", help="the camera to render through")
    add("-r", "--resolution", type=_resolution, metavar="WxH", help="pixels across and down")
    add("--res", nargs=2, type=_positive_int, metavar=("W", "H"), help="the same")
    add(
        "-w",
        "--width",
        "--imageWidth",
        type=_positive_int,
        metavar="W",
        help="height follows from the camera",
    )
    add(
        "--pixel-aspect", type=_positive_float, metavar="RATIO", help="width of a pixel divided by its height"
    )
    add("--spp", "--pixel-samples", "-p", type=_positive_int, metavar="N", help="samples per pixel")
    add("--time", "--timelimit", type=_seconds, metavar="SECONDS", help="end rendering a frame after so long")
    add("--max-bounces", type=_count, metavar="N", help="how often light may scatter")
    add("-j", "--threads", type=_count, metavar="N", help="0 is all cores")
    add("--seed", type=_count, metavar="N", help="the same seed gives the same image")
    add("--filter", choices=("blackman-harris", "box"), help="pixel filter")
    add(
        "--distance-sampling",
        choices=_DISTANCE_SAMPLING,
        help="how camera rays choose where to scatter; auto is delta",
    )
    add("--guiding", choices=_GUIDING, help="learn where light comes from; auto is off")
    add("--cache", metavar="FILE", help="keep what guiding learns in this file, for the next frame or render")
    add(
        "--cache-mode",
        choices=_CACHE_MODES,
        help="read: never write it; train: learn it anew; off: leave it alone; default: read and write",
    )
    add(
        "--progress",
        choices=("auto", "bar", "lines", "alfred", "none"),
        default="auto",
        help="how progress is shown",
    )
    add(
        "--headlight",
        choices=("none", "dome", "distant"),
        default="none",
        help="the light of stages without any",
    )


def _resolution(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d+)[xX](\d+)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form 1920x1080")
    return _positive_int(match[1]), _positive_int(match[2])


def _sample_range(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d+):(\d+)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form 0:128")
    first, end = int(match[1]), int(match[2])
    if first >= end:
        raise argparse.ArgumentTypeError(f"{text} has no samples; the second number must be larger")
    return first, end


def _pixel(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d+),(\d+)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form 640,360")
    return int(match[1]), int(match[2])


def _point(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form 1.5,0,-2") from None
    if not all(math.isfinite(v) for v in (x, y, z)):
        raise argparse.ArgumentTypeError(f"{text} is not finite")
    return x, y, z


def _count(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is negative")
    return value


def _positive_int(text: str) -> int:
    value = _count(text)
    if value == 0:
        raise argparse.ArgumentTypeError("0 is too small; it must be at least 1")
    return value


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} must be finite and not negative")
    return value


def _positive_float(text: str) -> float:
    value = _seconds(text)
    if value == 0:
        raise argparse.ArgumentTypeError("0 is too small")
    return value
