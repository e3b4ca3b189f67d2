"""A real Dask scheduler with real workers on loopback, each in its own empty folder."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class Cluster:
    """The processes of Dask, and the address of the scheduler."""

    folder: Path
    address: str = ""
    scheduler: subprocess.Popen[Any] = field(init=False)
    workers: list[subprocess.Popen[Any]] = field(default_factory=list)

    def start(self, kind: str, *arguments: str, **environment: str) -> subprocess.Popen[Any]:
        """A scheduler or worker, in a session of its own."""
        folder = self.folder / f"{kind}{len(self.workers)}"
        folder.mkdir()
        with (folder / "said").open("w") as said:
            return subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", *arguments],
                cwd=folder,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **environment},
                stdout=said,
                stderr=said,
                start_new_session=True,
            )

    def add_worker(self, nanny: str = "--no-nanny", **environment: str) -> subprocess.Popen[Any]:
        """Another worker, with one thread; without a nanny it stays dead when killed."""
        local = ("--local-directory", str(self.folder))
        self.workers.append(self.start("worker", self.address, "--nthreads=1", nanny, *local, **environment))
        return self.workers[-1]


def without_epicycle(folder: Path) -> dict[str, str]:
    """The environment of a process that should not find Epicycle."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "sitecustomize.py").write_text("import sys\n\nsys.modules['epicycle'] = None\n")
    return {"PYTHONPATH": os.pathsep.join([str(folder), *sys.path])}


@contextmanager
def a_cluster(folder: Path, workers: int = 0) -> Iterator[Cluster]:
    """A scheduler, possibly without Epicycle, with workers; until the end."""
    folder.mkdir(exist_ok=True)
    unknowing = without_epicycle(folder / "without")
    found = Cluster(folder)
    file = folder / "scheduler.json"
    found.scheduler = found.start(
        "scheduler", "--host=127.0.0.1", "--port=0", "--scheduler-file", str(file), **unknowing
    )
    try:
        deadline = time.monotonic() + 60
        while not found.address and time.monotonic() < deadline:
            time.sleep(0.05)
            if file.exists() and (text := file.read_text()):
                found.address = json.loads(text)["address"]
        for _ in range(workers):
            found.add_worker()
        yield found
    finally:
        for each in (*found.workers, found.scheduler):
            each.kill()
            each.wait()
