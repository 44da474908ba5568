"""The arguments of commands that share a shot among machines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tyndall_usd.cli import log, values

if TYPE_CHECKING:
    import argparse


def add_job(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``tyndall job``."""
    actions = parser.add_subparsers(dest="job_command", metavar="ACTION", required=True)
    export = actions.add_parser(
        "export",
        help="write a job: key frames teach a cache, chunks of frames are rendered with it, splits merged",
        usage="%(prog)s INPUT -o OUT -f FRAMES [options] [-- options of tyndall render]",
        allow_abbrev=False,
    )
    export.add_argument(
        "--format",
        choices=("openjd", "slurm"),
        default="openjd",
        help="Open Job Description or sbatch script",
    )
    export.add_argument(
        "--to", metavar="FILE", help="the job's file; default: beside you, named after the stage"
    )
    _add_plan(export)
    log.add_options(export)


def add_cluster(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``tyndall cluster``."""
    actions = parser.add_subparsers(dest="cluster_command", metavar="ACTION", required=True)
    render = actions.add_parser(
        "render",
        help="run the steps of a job on the workers of a Dask scheduler; they must see the same files",
        usage="%(prog)s INPUT -o OUT -f FRAMES --scheduler ADDRESS [options] [-- options of tyndall render]",
        allow_abbrev=False,
    )
    render.add_argument("--scheduler", metavar="ADDRESS", required=True, help="such as tcp://farm:8786")
    _add_plan(render)
    log.add_options(render)


def _add_plan(parser: argparse.ArgumentParser) -> None:
    """Add what decides the steps of a shot on many machines."""
    add = parser.add_argument
    add("input", metavar="INPUT", help=".usd .usda .usdc .usdz")
    add("-o", "--output", metavar="PATH", required=True, help="the images, as for tyndall render")
    add("-f", "--frames", metavar="FRAMES", required=True, help="such as 1001:1010x2,1020")
    add("--chunk", type=values.positive_int, default=4, metavar="N", help="frames a task renders; default 4")
    add("--key-frames", metavar="FRAMES", help="frames that teach the guiding cache of all")
    add("--key-spp", type=values.positive_int, default=128, metavar="N", help="samples of those; default 128")
    add("--spp", type=values.positive_int, metavar="N", help="samples per pixel")
    add("--splits", type=values.positive_int, default=1, metavar="N", help="parts of each frame's samples")
