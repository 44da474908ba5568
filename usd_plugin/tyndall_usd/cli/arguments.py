"""The arguments of every command. Spellings of usdrecord and husk are accepted where the meaning is equal."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, NoReturn

from tyndall_usd.cli import farm_arguments, log, values
from tyndall_usd.cli.exit_codes import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

#: Options of later versions: recognised, and refused instead of ignored.
_LATER_OPTIONS: dict[str, int | None] = {
    "--tile-index": 1,
    "--tile-count": 2,
    "--tile-suffix": 1,
    "--snapshot": 1,
    "--pass": 1,
    "--renderPassPrimPath": 1,
}
_LATER_COMMANDS = ("compare", "bench")
_DISTANCE_SAMPLING = ("auto", "odds", "target", "nds", "nds+", "delta")
_LIGHT_SAMPLING = ("event", "candidate")
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
    farm_arguments.add_job(
        commands.add_parser("job", help="describe a shot for render farms", allow_abbrev=False)
    )
    farm_arguments.add_cluster(
        commands.add_parser("cluster", help="render on many machines by Dask", allow_abbrev=False)
    )
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
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    render_options: list[str] = []
    if arguments[:1] in (["job"], ["cluster"]) and "--" in arguments:
        end = arguments.index("--")
        arguments, render_options = arguments[:end], arguments[end + 1 :]
    options = make_parser().parse_args(arguments)
    options.render_options = render_options
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
    log.add_options(parser)


def _add_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", metavar="INPUT", help=".usd .usda .usdc .usdz")
    parser.add_argument("--json", action="store_true", help="as JSON")
    _add_common(parser)


def _add_merge(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("parts", metavar="PART", nargs="+", help="images made by --sample-range")
    parser.add_argument("-o", "--output", metavar="PATH", required=True, help=".exr or .png")
    parser.add_argument("--strict", action="store_true", help="exit with 3 if guiding learned in the parts")
    log.add_options(parser)


def _add_cache(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(
        dest="cache_command", metavar="ACTION", required=True, parser_class=_Parser
    )
    info = actions.add_parser("info", help="show what a cache holds", allow_abbrev=False)
    info.add_argument("file", metavar="FILE", help="a guiding cache, as --cache writes it")
    info.add_argument("--json", action="store_true", help="as JSON")
    verify = actions.add_parser(
        "verify", help="check checksums and content; exit with 1 if any file is unsound", allow_abbrev=False
    )
    verify.add_argument("files", metavar="FILE", nargs="+", help="guiding caches")
    merge = actions.add_parser(
        "merge", help="add up what machines or frames learned apart", allow_abbrev=False
    )
    merge.add_argument("files", metavar="FILE", nargs="+", help="guiding caches of one shot")
    merge.add_argument("-o", "--output", metavar="FILE", required=True, help="the cache of all")
    prune = actions.add_parser("prune", help="make a cache smaller", allow_abbrev=False)
    prune.add_argument("file", metavar="FILE", help="a guiding cache")
    prune.add_argument("-o", "--output", metavar="FILE", help="default: in its place")
    prune.add_argument(
        "--max-size",
        type=values.size,
        metavar="BYTES",
        help="at most so large, such as 64M: first without the odds of camera rays, then with fewer regions",
    )
    prune.add_argument(
        "--drop",
        action="append",
        default=[],
        choices=("field", "image"),
        help="forget the light by place, or the odds of camera rays",
    )
    for action in (verify, merge, prune):
        log.add_options(action)


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
    add(
        "-n",
        "--frame-count",
        type=values.positive_int,
        metavar="N",
        help="number of frames from the one of -f",
    )
    add("-i", "--frame-inc", type=values.positive_int, metavar="N", default=1, help="step of --frame-count")
    add("-d", "--default-time", "--defaultTime", action="store_true", help="render the stage's default time")
    add("--aov", nargs="+", action="extend", metavar="NAME", help="AOVs to write; see --list-aovs")
    add("--list-aovs", action="store_true", help="print the AOVs and exit")
    add("--make-output-path", action="store_true", help="create the output's folder")
    add("--skip-existing-frames", action="store_true", help="leave frames whose file exists")
    add("--stats", metavar="FILE.json", help="write times, memory and counts")
    add("--strict", action="store_true", help="exit with 3 if there were warnings or errors")
    add(
        "--sample-range",
        type=values.sample_range,
        metavar="A:B",
        help="render only the samples A to B-1 of --spp, as a part for tyndall merge; multiples of 32",
    )
    add(
        "--checkpoint",
        type=values.seconds,
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
        type=values.pixel,
        metavar="X,Y",
        help="show the light where this pixel scatters; default: middle",
    )
    place.add_argument(
        "--point", type=values.point, metavar="X,Y,Z", help="show the light at this point of the stage"
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
        type=values.count,
        default=256,
        metavar="N",
        help="samples of the unguided light around the point; 0 leaves it out",
    )
    add(
        "--reference-size",
        type=values.positive_int,
        default=32,
        metavar="N",
        help="pixels across a sixth of it",
    )
    _add_image(parser)
    _add_common(parser)


def _add_image(parser: argparse.ArgumentParser) -> None:
    """Add what decides the image of one frame, and how it is sampled."""
    add = parser.add_argument
    add("-c", "--camera", "-cam", metavar="PATH|NAME", help="the camera to render through")
    add("-r", "--resolution", type=values.resolution, metavar="WxH", help="pixels across and down")
    add("--res", nargs=2, type=values.positive_int, metavar=("W", "H"), help="the same")
    add(
        "-w",
        "--width",
        "--imageWidth",
        type=values.positive_int,
        metavar="W",
        help="height follows from the camera",
    )
    add(
        "--pixel-aspect",
        type=values.positive_float,
        metavar="RATIO",
        help="width of a pixel divided by its height",
    )
    add(
        "--disable-motionblur",
        action="store_true",
        help="everything stands still at the frame's own time, whatever the camera's shutter says",
    )
    add("--spp", "--pixel-samples", "-p", type=values.positive_int, metavar="N", help="samples per pixel")
    add(
        "--noise-threshold",
        type=values.seconds,
        metavar="T",
        help="end each pixel, at --spp at the latest, when its standard error is T times the root of its "
        "brightness (white is 1), such as 0.01",
    )
    add(
        "--time",
        "--timelimit",
        type=values.seconds,
        metavar="SECONDS",
        help="end rendering a frame after so long",
    )
    add("--max-bounces", type=values.count, metavar="N", help="how often light may scatter")
    add("-j", "--threads", type=values.count, metavar="N", help="0 is all cores")
    add("--seed", type=values.count, metavar="N", help="the same seed gives the same image")
    add("--filter", choices=("blackman-harris", "box"), help="pixel filter")
    add(
        "--distance-sampling",
        choices=_DISTANCE_SAMPLING,
        help="how rays choose where to scatter; auto tries odds from 128 samples on",
    )
    add(
        "--light-sampling",
        choices=_LIGHT_SAMPLING,
        help="where camera rays sample light in media, with odds and target; default: event",
    )
    add("--guiding", choices=_GUIDING, help="learn where light comes from; auto tries from 128 samples on")
    add("--cache", metavar="FILE", help="keep what guiding learns in this file, for the next frame or render")
    add(
        "--cache-mode",
        choices=_CACHE_MODES,
        help="read: never write it; train: learn it anew; off: leave it alone; default: read and write",
    )
    add(
        "--procedural-resolution",
        type=values.count,
        metavar="N",
        help="most voxels along an axis of a procedural medium; default: 256",
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
