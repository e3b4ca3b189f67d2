"""Studies on Dask: a real scheduler and real workers on loopback, which start in separate folders."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pyarrow.parquet as pq
import pytest

from epicycle.runner.interface.cli import main
from epicycle.runner.model.language.study import read_study
from epicycle.runner.study.judge.study_results import open_study
from epicycle.runner.study.plan.plan import Plan
from epicycle.runner.study.run import parcel
from epicycle.runner.study.run.backlog import Backlog
from epicycle.runner.study.run.parcel import environment, pack
from epicycle.runner.study.run.runner import Runner
from tests.study.dask_cluster import Cluster, a_cluster, without_epicycle
from tests.study.run.test_kills import members
from tests.study.study_commands import study
from tests.study.study_parts import STUDY, THIS, command, write

pytest.importorskip("distributed")
from epicycle.runner.study.run import cluster as cluster_module


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with a_cluster(tmp_path_factory.mktemp("cluster"), workers=2) as found:
        yield found


def table_of(folder: Path) -> bytes:
    return (folder / "table.parquet").read_bytes()


def without_progress(text: str) -> str:
    """The messages, without the line per minute that a slow machine may add."""
    return re.sub(r"^\d\d:\d\d:\d\d walks: .*\n", "", text, flags=re.M)


@pytest.mark.slow
def test_table_is_that_of_local_processes(cluster: Cluster, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Runs that are ok, raise, hang, and end their process, batch by batch until the interval is narrow enough."""
    until = "until: {metric: place, half_width: 2.2, batch: 5}"
    text = STUDY.replace("[0 m/s, 100 cm/s]", "[0 m/s]").replace("replications: 5", until)
    write(tmp_path, text + "set: {fails: [3], hangs: [5], dies: [7]}\n")
    assert study(tmp_path, "--jobs", 2, "--run-timeout", 1, out="local") == 1
    said = capsys.readouterr()
    on_dask = ("--executor", "dask", "--scheduler", cluster.address, "--run-timeout", 1)
    assert study(tmp_path, *on_dask, out="dask") == 1
    expected = [without_progress(each).replace(str(tmp_path / "local"), str(tmp_path / "dask")) for each in said]
    assert [without_progress(each) for each in capsys.readouterr()] == expected
    assert table_of(tmp_path / "dask") == table_of(tmp_path / "local")
    statuses = Counter(pq.read_table(tmp_path / "dask" / "table.parquet")["status"].to_pylist())
    assert statuses.keys() == {"ok", "failed", "timeout", "killed"}
    # If there is nothing to do, no scheduler is contacted.
    assert main(["study", str(tmp_path / "dask"), "--executor", "dask", "--scheduler", "127.0.0.1:9"]) == 1
    assert f"0 new runs, {statuses.total()} already there" in capsys.readouterr().out


@pytest.mark.slow
def test_workers_and_the_scheduler_are_lost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, STUDY.replace("replications: 5", "replications: 20"))
    pause = ("--set", "pause=0.1")
    assert study(tmp_path, *pause, "--jobs", 2, out="local") == 0
    capsys.readouterr()
    arguments = ("study", tmp_path / "walks.yaml", "--types", THIS, "--out", tmp_path / "dask", *pause)
    with a_cluster(tmp_path / "cluster", workers=2) as cluster:
        on_dask = ("--executor", "dask", "--scheduler", cluster.address)
        process = subprocess.Popen(command(*arguments, *on_dask), stderr=subprocess.PIPE, text=True)

        def wait_for(rows: int) -> None:
            while process.poll() is None and number_of_rows() < rows:
                time.sleep(0.02)

        def number_of_rows() -> int:
            return sum(path.read_bytes().count(b"\n") for path in (tmp_path / "dask").glob("journals/*"))

        wait_for(3)
        cluster.workers[0].kill()
        wait_for(8)
        assert process.poll() is None
        cluster.scheduler.kill()
        _, said = process.communicate(timeout=60)
    assert without_progress(said) == (
        f"error: the scheduler {cluster.address} no longer answers\n"
        f"   help: finished runs are kept; 'epicycle study {tmp_path / 'dask'}' continues\n"
    )
    assert process.returncode == 1
    kept = len(open_study(tmp_path / "dask").table())
    assert 8 <= kept < 40
    assert main(["study", str(tmp_path / "dask"), "--jobs", "2"]) == 0
    assert capsys.readouterr().out.startswith(f"walks: 2 conditions, {40 - kept} new runs, {kept} already there\n")
    assert table_of(tmp_path / "dask") == table_of(tmp_path / "local")


@pytest.mark.slow
def test_a_cluster_of_its_own(tmp_path: Path) -> None:
    """Interrupted in the middle, and resumed."""
    write(tmp_path)
    out = tmp_path / "out"
    arguments = ("study", tmp_path / "walks.yaml", "--types", THIS, "--set", "pause=0.5", "--out", out, "--jobs", 2)
    process = subprocess.Popen(
        command(*arguments, "--executor", "dask"), start_new_session=True, stderr=subprocess.PIPE, text=True
    )
    while process.poll() is None and not any(path.stat().st_size for path in out.glob("journals/*")):
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    _, said = process.communicate(timeout=60)
    assert without_progress(said) == f"interrupted; finished runs are kept: 'epicycle study {out}' continues\n"
    assert process.returncode == 130
    assert 0 < len(open_study(out).table()) < 10


@pytest.mark.slow
def test_processes_on_workers_end_with_what_wants_their_runs(cluster: Cluster, tmp_path: Path) -> None:
    """A study that is over, and one that is killed with the process that reads its rows."""
    write(tmp_path, STUDY.replace("replications: 5", "replications: 100"))
    arguments = ("study", tmp_path / "walks.yaml", "--types", THIS, "--executor", "dask")
    arguments = (*arguments, "--scheduler", cluster.address, "--out", tmp_path / "out")

    def busy() -> list[int]:
        return [each for worker in cluster.workers for each in members(worker.pid)]

    def wait_until(is_so: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 60
        while not is_so() and time.monotonic() < deadline:
            time.sleep(0.05)
        assert is_so()

    subprocess.run(command(*arguments, "--replications", "1"), check=True, stdout=subprocess.DEVNULL)
    wait_until(lambda: not busy())
    process = subprocess.Popen(command(*arguments, "--set", "pause=0.5"))
    wait_until(lambda: len(busy()) == 2 and any(path.stat().st_size for path in (tmp_path / "out").glob("journals/*")))
    process.kill()
    process.wait()
    wait_until(lambda: not busy())


# -- what travels -----------------------------------------------------------------------------------------------------

FILES = {
    "study/travels.yaml": """
study: travels
model: ../model/with_files.yaml
vary: {recorded.file: [data/first.csv, data/second.csv]}
disturb: {none: [], lossy: ./lossy.yaml}
replications: 2
""",
    "study/lossy.yaml": """
disturbance: lossy
aspects: {lossy: {type: PacketLoss, probability: 0.5, at: filter.input}}
""",
    "model/with_files.yaml": """
model: with_files
include: parts/filter.yaml
actors:
  walk: {type: Stroll}
  filter: {type: Filter}
  recorded: {type: Replay, file: data/first.csv}
  noise: {type: Replay, file: data/first.csv}
  sum: {type: AddSubtract}
connections:
  - walk.output -> filter.input
  - filter.output -> sum.plus
  - recorded.output -> sum.plus
  - noise.output -> sum.plus
run: {stop: 10 s}
metrics: {place: {of: sum.output, take: last}}
""",
    "model/parts/filter.yaml": """
composites:
  Filter:
    inputs: [input]
    outputs: [output]
    actors: {scale: {type: Scale, factor: 3}}
    connections: [input -> scale.input, scale.output -> output]
""",
    "model/data/first.csv": "time,value\n0,1\n5,2\n",
    "study/data/first.csv": "time,value\n0,3\n5,4\n",
    "study/data/second.csv": "time,value\n0,10\n5,20\n",
    "here/noise.csv": "time,value\n9,0.5\n",
    "types/strolls.py": """
from steps import STEP

from epicycle.actors import Actor, OutputPort

class Stroll(Actor):
    is_source = True
    output = OutputPort(float)

    def initialize(self):
        self.wake_at(0)

    def fire(self):
        self.output.send(float(self.random.normal(STEP, 1.0)))
        self.wake_in(1)
""",
    "types/steps.py": "STEP = 0.25\n",
}
UNPACKED = """
import json, os, sys
from pathlib import Path
from epicycle.runner.study.run.runner import Runner
from epicycle.runner.study.run.parcel import unpack
from epicycle.runner.study.run.backlog import Backlog

manifest, _, folder = unpack(Path(sys.argv[1]).read_bytes(), Path(sys.argv[2]).resolve())
os.chdir(folder)
runner = Runner.of_manifest(manifest)
backlog = Backlog(runner.plan, {})
print(json.dumps([runner.make(task) | {"wall_time": 0} for task in iter(backlog.next, None)]))
"""


@pytest.mark.slow
def test_all_files_travel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Includes, data, disturbances, own types and what these import; from links, and in options, too."""
    home, link, root = tmp_path / "home", tmp_path / "link", tmp_path / "elsewhere"
    for name, text in FILES.items():
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).write_text(text)
    link.symlink_to(home)
    data = home / "study" / "data"
    (data / "first.csv").rename(data / "real.csv")
    (data / "first.csv").symlink_to("real.csv")
    monkeypatch.chdir(home / "here")
    changes = ("noise.file=noise.csv",)
    plan = Plan.made(read_study("../../link/study/travels.yaml", set=changes, types=[link / "types" / "strolls.py"]))
    parcel = tmp_path / "parcel"
    parcel.write_bytes(pack(plan))
    backlog, runner = Backlog(plan, {}), Runner(plan)
    rows = [runner.make(task) | {"wall_time": 0} for task in iter(backlog.next, None)]
    shutil.rmtree(home)
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", UNPACKED, str(parcel), str(root)],
        check=False,
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert not done.returncode, done.stderr
    found = json.loads(done.stdout)
    assert [each["error"] for each in found] == [None] * 8
    assert len({each["digest"] for each in found}) == 8
    assert found == rows


# -- who cannot take part ---------------------------------------------------------------------------------------------


def error_of(folder: Path, capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The whole error of a study that cannot be run, without the folder."""
    try:
        code = study(folder, "--executor", "dask", *arguments)
    except SystemExit as error:
        code = error.code
    said = capsys.readouterr().err.replace(str(folder), "HERE")
    return f"{code}: {said[max(said.find('error:'), 0) :]}"


@pytest.mark.slow
def test_what_cannot_be(
    cluster: Cluster, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path)
    assert study(tmp_path, "--scheduler", "localhost:8786") == 2
    assert capsys.readouterr().err == "error: --scheduler tcp://localhost:8786 is for --executor dask\n"
    assert error_of(tmp_path, capsys, "--scheduler", "localhost:8786", "--jobs", 2) == (
        "2: error: --jobs counts processes on this machine and does not go with --scheduler, which has its own "
        "workers\n"
    )
    for bad in ("localhost", "tcp://localhost:99999", "tcp://:8786", "inproc://localhost:8786"):
        expected = f"2: error: argument --scheduler: {bad!r} is not an address such as tcp://localhost:8786\n"
        assert error_of(tmp_path, capsys, "--scheduler", bad) == expected
    monkeypatch.setattr(cluster_module, "CONNECT", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as nobody:  # accepts connections and never answers
        for port in (9, nobody.getsockname()[1]):
            assert error_of(tmp_path, capsys, "--scheduler", f"127.0.0.1:{port}") == (
                f"1: error: no scheduler answers at tcp://127.0.0.1:{port}\n"
                "   help: 'dask scheduler' starts one and prints its address\n"
            )
    monkeypatch.setattr(cluster_module, "CONNECT", 10.0)
    for name, unlike in (
        ("numpy", f"numpy {environment()['numpy']} there, 1.0 here"),
        ("casadi", f"casadi {environment()['casadi'] or 'is missing'} there, 1.0 here"),
        ("code", "the code of Epicycle differs"),
    ):
        with monkeypatch.context() as context:
            context.setitem(environment(), name, "1.0")
            said = error_of(tmp_path, capsys, "--scheduler", cluster.address)
        assert re.sub(r"127.0.0.1:[0-9]+", "WORKER", said) == (
            f"1: error: the Dask worker tcp://WORKER differs from this machine: {unlike}\n"
            "   help: the same seed must give the same run, so install the same versions there\n"
        )
    with monkeypatch.context() as context:
        context.setitem(sys.modules, "distributed", None)
        assert error_of(tmp_path, capsys) == "2: error: this needs dask: pip install 'epicycle[dask]'\n"


def test_the_code_that_has_to_be_the_same_is_all_that_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Including the sources of compiled modules; not the compiled files, which differ between machines."""
    monkeypatch.setattr(parcel, "import_module", lambda name: SimpleNamespace(__path__=[str(tmp_path)]))
    (tmp_path / "core").mkdir()
    seen = [parcel._code()]
    for name in ("core/a.py", "core/a.pyx", "core/a.pxd"):
        (tmp_path / name).write_text("x = 1\n", encoding="utf-8")
        seen.append(parcel._code())
        (tmp_path / name).write_text("x = 2\n", encoding="utf-8")
        seen.append(parcel._code())
    assert len({*seen}) == len(seen) == 7
    for name in ("core/a.c", "core/a.so", "compiled.json"):
        (tmp_path / name).write_text("", encoding="utf-8")
    assert parcel._code() == seen[-1]


@pytest.mark.slow
def test_workers_that_are_missing_or_have_no_epicycle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path)
    monkeypatch.setattr(cluster_module, "PATIENCE", 1.0)
    with a_cluster(tmp_path / "cluster") as cluster:
        address = ("--scheduler", cluster.address)
        assert error_of(tmp_path, capsys, *address) == (
            f"1: error: the scheduler {cluster.address} has had no workers for 1 s\n"
            f"   help: 'dask worker {cluster.address}' starts one\n"
        )
        monkeypatch.setattr(cluster_module, "PATIENCE", 60.0)
        cluster.add_worker(**without_epicycle(tmp_path / "without"))
        expected = (
            " does not have this version of Epicycle: No module named 'epicycle.runner'; 'epicycle' is not a package\n"
            "   help: install it there\n"
        )
        # While it is joining, its name is not always known.
        first, then = (error_of(tmp_path, capsys, *address) for _ in range(2))
        assert re.sub(r"(a|the) Dask worker( tcp://[0-9.:]+)?", "WORKER", first) == f"1: error: WORKER{expected}"
        assert re.sub(r"tcp://[0-9.:]+", "ADDRESS", then) == f"1: error: the Dask worker ADDRESS{expected}"
