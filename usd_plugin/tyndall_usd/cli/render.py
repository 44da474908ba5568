"""``tyndall render``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyndall
from pxr import Usd
from tyndall import cache
from tyndall.messages import Message, Messages

from tyndall_usd.cli.checkpoint import Checkpoint
from tyndall_usd.cli.exit_codes import ExitCode, UsageError
from tyndall_usd.cli.film_state import Description, checkpoint_file, part_file
from tyndall_usd.cli.frames import parse_frames
from tyndall_usd.cli.inputs import open_input, stage_settings
from tyndall_usd.cli.log import LOG, DiagnosticLog
from tyndall_usd.cli.native_stderr import caught_stderr
from tyndall_usd.cli.outputs import Task, check_outputs, plan_tasks
from tyndall_usd.cli.progress import progress_reporter
from tyndall_usd.cli.read_ahead import ReadAhead
from tyndall_usd.cli.shot import Shot
from tyndall_usd.cli.stats import Stats, guide_metadata, tell_cache
from tyndall_usd.fingerprint import fingerprint
from tyndall_usd.stage import first_time

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable


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

    def render_all(self) -> int:
        """Render every frame of every task."""
        messages = Messages()
        with self.stats.phase("load"), caught_stderr():
            self.stage = open_input(self.options, messages)
            times = _times(self.stage, self.options)
            settings = stage_settings(self.stage, self.options, times[0][0], messages)
        tasks = plan_tasks(settings.products, self.options, messages)
        check_outputs(tasks, [frame for _, frame in times], make_folders=self.options.make_output_path)
        self.shot = Shot(self.stage, settings, self.options)
        if self.options.sample_range and self.shot.renderer_settings["timeLimit"]:
            raise UsageError("--sample-range: a part is complete or useless; render it without a time limit")
        if self.options.sample_range and self.shot.renderer_settings["noiseThreshold"]:
            raise UsageError(
                "--sample-range: a noise threshold decides by all samples of a pixel, and a part has only "
                "some; render it with --noise-threshold 0"
            )
        messages.send(self.shot.delegate)
        ahead = ReadAhead(self.shot.delegate)
        for i, (time, frame) in enumerate(times):
            if self._is_done(tasks, frame):
                continue
            ahead.wait()
            with self.stats.phase("translate"), caught_stderr():
                self.shot.index.sync(time)
                grids = self.shot.index.grids_at(times[i + 1][0]) if i + 1 < len(times) else []
            for task in tasks:
                # Each world that is built forgets files that it does not need: only the last one is safe.
                start = partial(ahead.start, grids if task is tasks[-1] else [])
                if not self._render_frame(task, time, frame, start):
                    return ExitCode.INTERRUPTED
        return self._conclude()

    def _is_done(self, tasks: list[Task], frame: float) -> bool:
        if not self.options.skip_existing_frames:
            return False
        files = [image.at(frame) for task in tasks for image in task.images]
        # A checkpoint beside an image says that it was stopped.
        return all(file.exists() and not checkpoint_file(file).exists() for file in files)

    def _render_frame(
        self, task: Task, time: Usd.TimeCode, frame: float, when_built: Callable[[], None]
    ) -> bool:
        """Render one frame and write its images; return whether it was left to end.

        `when_built` is called before the first pass, when all files of this frame were read.
        """
        _, settings = self.shot.sync_camera(task.view, time)
        settings["aovs"] = task.aovs
        if self.options.sample_range and settings.get("guiding", "auto") == "auto":
            # Each part would learn by itself, and lose the bits of one render.
            settings["guiding"] = "off"
        with self.stats.phase("build"):
            session = tyndall.Session(
                self.shot.delegate.commit(), settings, sample_range=self.options.sample_range
            )
        when_built()
        self.diagnostics.show(session.diagnostics)
        description = self._describe(task, frame, session, settings)
        checkpoint = Checkpoint(task.images[0].at(frame), description, self.options, self.diagnostics)
        checkpoint.resume(session)
        before = self.stats.seconds["render"]
        is_complete = True
        with self.stats.phase("render"):
            try:
                with progress_reporter(self.options.progress, f"frame {frame:g}") as report:
                    film = session.render(report, checkpoint.request, frame)
            except KeyboardInterrupt:
                film, is_complete = session.film(), False
        seconds = self.stats.seconds["render"] - before
        statistics = session.statistics
        figures = {
            "tyndall:seconds": f"{seconds:.3f}",
            **guide_metadata(statistics),
            **cache.metadata(statistics),
        }
        tell_cache(statistics)
        self._write(task, frame, film, {**figures, **description.metadata})
        self._write_part(task, frame, film, description)
        checkpoint.conclude(session)
        self.stats.frames.append(
            {
                "frame": frame,
                "files": [str(image.at(frame)) for image in task.images],
                "spp": film.samples,
                "meanSpp": film.mean_samples,
                "seconds": seconds,
                "complete": is_complete,
                "statistics": statistics,
            }
        )
        if not is_complete:
            LOG.error("tyndall: interrupted; the images have at least %d samples per pixel", film.samples)
        return is_complete

    @property
    def _is_saved(self) -> bool:
        """Whether films outlive the process."""
        options = self.options
        return bool(options.checkpoint is not None or options.resume or options.sample_range)

    def _describe(
        self, task: Task, frame: float, session: tyndall.Session, settings: dict[str, Any]
    ) -> Description:
        """Return what the film of a frame belongs to."""
        options = self.options
        if options.sample_range and session.learns:
            what = "guiding learns in each part by itself: merged, they differ from one render in their noise"
            action = "--guiding off --distance-sampling delta gives the same bits"
            self.diagnostics.show([Message("warning", "", what, action)])
        return Description(
            # Reads all files: only if somebody will look.
            scene=fingerprint(self.shot.index.prims) if self._is_saved else "",
            settings=settings,
            sample_range=list(options.sample_range or (0, settings["samples"])),
            learns=session.learns,
            aovs=list(task.images[0].aovs),
            metadata={
                "tyndall:version": tyndall.version,
                "tyndall:input": Path(options.input).name,
                "tyndall:frame": f"{frame:g}",
                **{f"tyndall:settings:{name}": _as_text(value) for name, value in settings.items()},
            },
        )

    def _write(self, task: Task, frame: float, film: tyndall.Film, metadata: dict[str, str]) -> None:
        metadata = {
            **metadata,
            "tyndall:samples": str(film.samples),
            "tyndall:meanSamples": f"{film.mean_samples:.2f}",
        }
        with self.stats.phase("write"):
            for image in task.images:
                file = image.at(frame)
                film.write(str(file), list(image.aovs), metadata)
                LOG.info("%s: %s samples per pixel, %s s", file, _samples(film), metadata["tyndall:seconds"])

    def _write_part(self, task: Task, frame: float, film: tyndall.Film, description: Description) -> None:
        """Keep the sums of a part that is complete."""
        if self.options.sample_range and film.sample_range == self.options.sample_range:
            with self.stats.phase("write"):
                film.write_state(part_file(task.images[0].at(frame)), description.to_json())

    def _conclude(self) -> int:
        errors, warnings = self.diagnostics.count("error"), self.diagnostics.count("warning")
        if errors or warnings:
            LOG.warning("%d errors and %d warnings about the scene", errors, warnings)
        if self.options.strict and (errors or warnings):
            return ExitCode.DIAGNOSTICS
        return ExitCode.DONE


def _samples(film: tyndall.Film) -> str:
    is_uniform = film.mean_samples == film.samples
    return str(film.samples) if is_uniform else f"{film.samples} or more, on average {film.mean_samples:.1f},"


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
