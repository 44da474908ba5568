"""``tyndall render``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyndall
from pxr import Usd

from tyndall_usd.cli.exit_codes import ExitCode, UsageError
from tyndall_usd.cli.frames import parse_frames
from tyndall_usd.cli.inputs import choose_camera, drawn_purposes, open_input, stage_settings
from tyndall_usd.cli.log import LOG, DiagnosticLog
from tyndall_usd.cli.native_stderr import caught_stderr
from tyndall_usd.cli.outputs import Task, check_outputs, plan_tasks
from tyndall_usd.cli.progress import progress_reporter
from tyndall_usd.cli.stats import Stats
from tyndall_usd.messages import Messages
from tyndall_usd.read.camera import conform_aperture, read_camera
from tyndall_usd.scene_index import SceneIndex
from tyndall_usd.stage import first_time

if TYPE_CHECKING:
    import argparse

    from tyndall_usd.read.settings import StageSettings, View

_DEFAULT_RESOLUTION = (1280, 720)


def run_render(options: argparse.Namespace) -> int:
    """Render what `options` ask for and return the exit code."""
    if not options.input:
        raise UsageError("no INPUT; see tyndall render --help")
    run = _Run(options)
    try:
        code = run.render_all()
    finally:
        if options.stats:
            run.stats.write(options.stats, source=options.input, diagnostics=run.diagnostics.as_list())
    return code


class _Run:
    """One invocation of the command."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.stats = Stats()
        self.diagnostics = DiagnosticLog()
        self.cameras: dict[str | None, Usd.Prim] = {}

    def render_all(self) -> int:
        """Render every frame of every task."""
        messages = Messages()
        with self.stats.phase("load"), caught_stderr():
            self.stage = open_input(self.options, messages)
            times = _times(self.stage, self.options)
            settings = stage_settings(self.stage, self.options, times[0][0], messages)
        tasks = plan_tasks(settings.products, self.options, messages)
        check_outputs(tasks, [frame for _, frame in times], make_folders=self.options.make_output_path)
        self.renderer_settings = _renderer_settings(settings, self.options)
        purposes = drawn_purposes(self.options, settings)
        self.delegate = tyndall.RenderDelegate()
        self.index = SceneIndex(
            self.stage, self.delegate, purposes=purposes, material_purpose=settings.material_purpose
        )
        messages.send(self.delegate)
        for time, frame in times:
            if self._is_done(tasks, frame):
                continue
            with self.stats.phase("translate"), caught_stderr():
                self.index.sync(time)
            for task in tasks:
                if not self._render_frame(task, time, frame):
                    return ExitCode.INTERRUPTED
        return self._conclude()

    def _is_done(self, tasks: list[Task], frame: float) -> bool:
        files = [image.at(frame) for task in tasks for image in task.images]
        return bool(self.options.skip_existing_frames) and all(file.exists() for file in files)

    def _render_frame(self, task: Task, time: Usd.TimeCode, frame: float) -> bool:
        """Render one frame and write its images; return whether it was left to end."""
        settings = {**self.renderer_settings, **self._sync_camera(task.view, time), "aovs": task.aovs}
        with self.stats.phase("build"):
            session = tyndall.Session(self.delegate.commit(), settings)
        self.diagnostics.show(session.diagnostics)
        before = self.stats.seconds["render"]
        is_complete = True
        with self.stats.phase("render"):
            try:
                with progress_reporter(self.options.progress, f"frame {frame:g}") as report:
                    film = session.render(report)
            except KeyboardInterrupt:
                film, is_complete = session.film(), False
        seconds = self.stats.seconds["render"] - before
        self._write(task, frame, film, {"tyndall:seconds": f"{seconds:.3f}"}, settings)
        self.stats.frames.append(
            {
                "frame": frame,
                "files": [str(image.at(frame)) for image in task.images],
                "spp": film.samples,
                "seconds": seconds,
                "complete": is_complete,
                "statistics": session.statistics,
            }
        )
        if not is_complete:
            LOG.error("tyndall: interrupted; the images have at least %d samples per pixel", film.samples)
        return is_complete

    def _sync_camera(self, view: View, time: Usd.TimeCode) -> dict[str, Any]:
        """Sync the camera, fitted to the image; return the settings that go with it."""
        messages = Messages()
        prim = self.cameras.get(view.camera)
        if prim is None:
            prim = choose_camera(self.stage, self.options.camera, view.camera, messages)
            self.cameras[view.camera] = prim
        camera = read_camera(prim, time, messages, depth_of_field=view.depth_of_field)
        resolution = self.options.resolution or (tuple(self.options.res) if self.options.res else None)
        pixel_aspect = self.options.pixel_aspect or view.pixel_aspect
        if resolution is None and self.options.width:
            height = self.options.width * pixel_aspect * camera.aperture[1] / camera.aperture[0]
            resolution = (self.options.width, max(1, round(height)))
        resolution = resolution or view.resolution or _DEFAULT_RESOLUTION
        camera, pixel_aspect = conform_aperture(
            camera, resolution=resolution, pixel_aspect=pixel_aspect, policy=view.policy
        )
        self.index.sync_camera(str(prim.GetPath()), camera, messages)
        if self.options.headlight != "none":
            self.index.add_headlight(self.options.headlight, camera)
        return {"camera": str(prim.GetPath()), "resolution": list(resolution), "pixelAspect": pixel_aspect}

    def _write(
        self, task: Task, frame: float, film: tyndall.Film, metadata: dict[str, str], settings: dict[str, Any]
    ) -> None:
        metadata = {
            **metadata,
            "tyndall:version": tyndall.version,
            "tyndall:input": Path(self.options.input).name,
            "tyndall:frame": f"{frame:g}",
            "tyndall:samples": str(film.samples),
            **{f"tyndall:settings:{name}": _as_text(value) for name, value in settings.items()},
        }
        with self.stats.phase("write"):
            for image in task.images:
                file = image.at(frame)
                film.write(str(file), list(image.aovs), metadata)
                LOG.info("%s: %d samples per pixel, %s s", file, film.samples, metadata["tyndall:seconds"])

    def _conclude(self) -> int:
        errors, warnings = self.diagnostics.count("error"), self.diagnostics.count("warning")
        if errors or warnings:
            LOG.warning("%d errors and %d warnings about the scene", errors, warnings)
        if self.options.strict and (errors or warnings):
            return ExitCode.DIAGNOSTICS
        return ExitCode.DONE


def _as_text(value: object) -> str:
    return " ".join(str(item) for item in value) if isinstance(value, list) else str(value)


def _times(stage: Usd.Stage, options: argparse.Namespace) -> list[tuple[Usd.TimeCode, float]]:
    """Return each time to render with its frame number."""
    if options.default_time:
        return [(Usd.TimeCode.Default(), stage.GetStartTimeCode())]
    if not options.frames:
        if options.frame_count:
            raise UsageError("--frame-count needs the first frame by -f")
        return [(first_time(stage), stage.GetStartTimeCode())]
    frames = parse_frames(options.frames)
    if options.frame_count:
        if len(frames) != 1:
            raise UsageError("--frame-count goes with one frame, not with a range")
        frames = [frames[0] + i * options.frame_inc for i in range(options.frame_count)]
    return [(Usd.TimeCode(frame), frame) for frame in frames]


def _renderer_settings(settings: StageSettings, options: argparse.Namespace) -> dict[str, Any]:
    """Return the core's settings: the command line wins over the stage."""
    given = {
        "samples": options.spp,
        # The core's 0 is no limit; 0 here means no more than the first pass.
        "timeLimit": options.time if options.time is None else max(options.time, 1e-9),
        "maxBounces": options.max_bounces,
        "threads": options.threads,
        "seed": options.seed,
        "filter": options.filter,
        "distanceSampling": options.distance_sampling,
        "guiding": options.guiding,
    }
    defaults = {
        spec["name"]: spec["default"] for spec in tyndall.setting_specs() if spec["default"] is not None
    }
    return {
        **defaults,
        **settings.renderer,
        **{name: value for name, value in given.items() if value is not None},
    }
