"""A Dask scheduler and its workers as processes on this machine; one of the workers is killed while it weaves."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from explored_tube import contents, explore_tube
from weavecore.errors import Unsupported

# Dask warns about itself, and connections that end with a killed worker are reported where they are collected.
pytestmark = [
    pytest.mark.filterwarnings(f"ignore::{kind}")
    for kind in ("ResourceWarning", "DeprecationWarning", "FutureWarning", "pytest.PytestUnraisableExceptionWarning")
]

_START_SECONDS = 60.0
_ROOT = Path(__file__).resolve().parents[2]


class Cluster:
    """A scheduler and two workers."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / "scheduler.json"
        self._folder = folder
        self.processes: list[subprocess.Popen[bytes]] = []
        self._start("scheduler", "--port", "0", "--no-dashboard")
        self.workers = [
            self._start("worker", "--no-nanny", "--nthreads", "1", "--no-dashboard", "--name", name) for name in "ab"
        ]
        self.address = self._address()

    def _start(self, kind: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", kind, "--scheduler-file", str(self._file), *options]
        paths = os.pathsep.join([str(_ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
        environment = {**os.environ, "PYTHONPATH": paths, "OMP_NUM_THREADS": "1"}
        with (self._folder / f"{kind}{len(self.processes)}.log").open("wb") as log:
            started = subprocess.Popen(
                command, cwd=self._folder, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )
        self.processes.append(started)
        return started

    def _address(self) -> str:
        end = time.monotonic() + _START_SECONDS
        while not (self._file.exists() and self._file.read_text("utf-8").rstrip().endswith("}")):
            assert time.monotonic() < end, "no scheduler"
            assert self.processes[0].poll() is None, (self._folder / "scheduler0.log").read_text("utf-8")
            time.sleep(0.05)
        return str(json.loads(self._file.read_text("utf-8"))["address"])

    def stop(self) -> None:
        for process in reversed(self.processes):
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    pytest.importorskip("distributed", reason="the cluster is tested with dask.distributed")
    folder = tmp_path / "cluster"
    folder.mkdir()
    cluster = Cluster(folder)
    yield cluster
    cluster.stop()


def test_a_cluster_that_loses_a_worker_gives_the_same_bytes_as_one_process(cluster: Cluster, tmp_path: Path) -> None:
    from distributed import Client

    with Client(cluster.address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=_START_SECONDS)
    grid: dict[str, Any] = {"borders": ["all", (7,), (0,), (1,)], "patterns": ["plain"]}
    alone = explore_tube(tmp_path / "alone", **grid)

    def kill(fraction: float, _label: str) -> None:
        if 0 < fraction < 1:
            cluster.workers[0].kill()

    spread = explore_tube(tmp_path / "spread", scheduler=cluster.address, progress=kill, **grid)
    assert cluster.workers[0].wait() != 0
    assert spread.rows == alone.rows
    assert contents(tmp_path / "spread") == contents(tmp_path / "alone")


def test_a_scheduler_that_does_not_answer_is_an_error_with_a_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed", reason="the cluster is tested with dask.distributed")
    monkeypatch.setattr("weavecore.exploring.executors._CONNECT_SECONDS", 0.2)
    with pytest.raises(Unsupported, match="Start dask scheduler and dask worker"):
        explore_tube(tmp_path / "tube", scheduler="tcp://127.0.0.1:9")
