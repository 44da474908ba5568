"""Sample splits on a Dask cluster of this machine: real schedulers, real workers, real deaths."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from robustness.test_parts import assert_same_layers
from robustness.test_runs import foggy_room
from support.cli import command, tyndall

if TYPE_CHECKING:
    from collections.abc import Iterator

    from support.cli import Run

pytest.importorskip("distributed")

PLAIN = ("--max-bounces", "8", "--guiding", "off", "--distance-sampling", "delta", "-j", "1")
N_SPLITS = 4


class Cluster:
    """A scheduler and its workers on loopback."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"
        self._processes: list[subprocess.Popen[bytes]] = []
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-show")
        deadline = time.monotonic() + 60
        while not self.file.exists() or not self.file.read_text():
            assert time.monotonic() < deadline, "the scheduler does not start"
            time.sleep(0.1)
        self.address: str = json.loads(self.file.read_text())["address"]

    def add_worker(self, name: str) -> subprocess.Popen[bytes]:
        return self._start("worker", "--nthreads", "1", "--no-nanny", "--name", name)

    def _start(self, kind: str, *options: str) -> subprocess.Popen[bytes]:
        dask = Path(sys.executable).parent / "dask"
        file = ("--scheduler-file", str(self.file), "--no-dashboard")
        process = subprocess.Popen(
            [dask, kind, *file, *options],
            cwd=self.file.parent,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._processes.append(process)
        return process

    def stop(self) -> None:
        for process in self._processes:
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path)
    yield cluster
    cluster.stop()


def stage(folder: Path) -> Path:
    return foggy_room(37, 21).save(folder / "stage.usda")


def arguments(folder: Path, cluster: Cluster, *options: object, spp: int = 200) -> tuple[str, ...]:
    where = ("cluster", "render", folder / "stage.usda", "-o", folder / "image.exr", "-f", "1")
    split = ("--scheduler", cluster.address, "--spp", spp, "--splits", N_SPLITS)
    return tuple(map(str, (*where, *split, "--", *PLAIN, *options)))


def render_whole(folder: Path, spp: int = 200) -> Path:
    whole = folder / "whole.exr"
    run = tyndall("render", folder / "stage.usda", "-o", whole, "-f", "1", "--spp", str(spp), *PLAIN)
    assert run.code == 0, run.text
    return whole


def children(process: subprocess.Popen[bytes]) -> list[int]:
    """Return the processes that `process` has started."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == process.pid and fields[0] != "Z":
            found.append(int(stat.parent.name))
    return found


@contextmanager
def running(*words: str) -> Iterator[subprocess.Popen[str]]:
    """Run the command while the block does something to its cluster."""
    with subprocess.Popen(
        [command(), *words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()


def wait_for_render(worker: subprocess.Popen[bytes], seconds: float = 60) -> int:
    """Return the process of the command that `worker` runs, as soon as there is one."""
    deadline = time.monotonic() + seconds
    while not (found := children(worker)):
        assert time.monotonic() < deadline, "the worker does nothing"
        time.sleep(0.05)
    return found[0]


def test_splits_have_the_bits_of_one_render(tmp_path: Path, cluster: Cluster) -> None:
    stage(tmp_path)
    cluster.add_worker("one")
    cluster.add_worker("two")
    run = tyndall(*arguments(tmp_path, cluster))
    assert run.code == 0, run.text
    assert f"({N_SPLITS} of {N_SPLITS})" in run.err
    assert_same_layers(render_whole(tmp_path), tmp_path / "image.exr")
    assert not list(tmp_path.glob("*.part*")), "parts are removed when they are merged"


def test_a_killed_worker_loses_nothing(tmp_path: Path, cluster: Cluster) -> None:
    stage(tmp_path)
    victim = cluster.add_worker("victim")
    with running(*arguments(tmp_path, cluster, spp=4096)) as process:
        orphan = wait_for_render(victim)
        time.sleep(1)
        assert orphan in children(victim), "the render ended before its worker could be killed"
        victim.send_signal(signal.SIGKILL)
        victim.wait()
        deadline = time.monotonic() + 10
        while Path(f"/proc/{orphan}").exists():
            assert time.monotonic() < deadline, "the render outlives its worker"
            time.sleep(0.05)
        cluster.add_worker("heir")
        _, err = process.communicate(timeout=240)
    assert process.returncode == 0, err
    assert_same_layers(render_whole(tmp_path, 4096), tmp_path / "image.exr")


def test_a_killed_render_is_run_again(tmp_path: Path, cluster: Cluster) -> None:
    stage(tmp_path)
    worker = cluster.add_worker("one")
    with running(*arguments(tmp_path, cluster)) as process:
        os.kill(wait_for_render(worker), signal.SIGKILL)
        _, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    assert_same_layers(render_whole(tmp_path), tmp_path / "image.exr")


def failed(folder: Path, cluster: Cluster, *options: str) -> Run:
    run = tyndall(*arguments(folder, cluster, *options))
    assert run.code == 1, run.text
    assert not (folder / "image.exr").exists()
    return run


def test_errors_of_workers_arrive(tmp_path: Path, cluster: Cluster) -> None:
    stage(tmp_path)
    cluster.add_worker("one")
    last = failed(tmp_path, cluster, "--camera", "nobody").err.splitlines()[-1]
    assert str(tmp_path / "stage.usda") in last
    assert "exit code 2" in last
    assert "there is no camera 'nobody'" in last
    (tmp_path / "stage.usda").write_text("not a stage")
    last = failed(tmp_path, cluster).err.splitlines()[-1]
    assert str(tmp_path / "stage.usda") in last
    assert "exit code 1" in last


def test_a_scheduler_that_ends_is_told(tmp_path: Path, cluster: Cluster) -> None:
    stage(tmp_path)
    worker = cluster.add_worker("one")
    with running(*arguments(tmp_path, cluster, spp=16384)) as process:
        wait_for_render(worker)
        cluster.scheduler.kill()
        _, err = process.communicate(timeout=90)
    assert process.returncode == 1, err
    assert "scheduler" in err.splitlines()[-1], err
    assert "Traceback" not in err


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "ftp://127.0.0.1:1"])
def test_no_scheduler(tmp_path: Path, address: str) -> None:
    stage(tmp_path)
    where = ("cluster", "render", tmp_path / "stage.usda", "-o", tmp_path / "image.exr", "-f", "1")
    run = tyndall(*where, "--scheduler", address)
    assert run.code == 1, run.text
    assert f"no Dask scheduler answers at {address}" in run.err


def test_without_dask_the_extra_is_named(tmp_path: Path) -> None:
    """A module that fails to import stands before the real one, as if it were not there."""
    stage(tmp_path)
    (tmp_path / "distributed.py").write_text("raise ModuleNotFoundError(\"No module named 'distributed'\")")
    where = ("cluster", "render", tmp_path / "stage.usda", "-o", tmp_path / "image.exr", "-f", "1")
    run = tyndall(*where, "--scheduler", "tcp://127.0.0.1:9", env={"PYTHONPATH": str(tmp_path)})
    assert run.code == 1, run.text
    assert "pip install 'tyndall-usd[cluster]'" in run.err
