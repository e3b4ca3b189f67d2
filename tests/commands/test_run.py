"""`epicycle run` on the packaged scenario: the same bits every time, and aspects that do only what they declare."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from epicycle.runner.interface.cli import main

SHORT = ("--set", "observers=2", "--until", "1.5", "--seed", "7")


def epicycle(*arguments: str, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line in a new process."""
    return subprocess.run(
        [sys.executable, "-m", "epicycle.runner.interface.cli", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, **environment},
        timeout=300,
        check=False,
    )


def run_json(*arguments: str) -> dict[str, Any]:
    """What `epicycle run ... --json` prints."""
    printed = StringIO()
    with redirect_stdout(printed):
        assert main(["run", "collision_avoidance", *arguments, "--json"]) == 0
    result: dict[str, Any] = json.loads(printed.getvalue())
    return result


def read_log(path: Path) -> list[dict[str, Any]]:
    """The records of a JSON-lines log."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


@pytest.mark.slow
def test_digest_is_the_same_for_every_hash_seed_and_folder(tmp_path: Path) -> None:
    arguments = (*SHORT, "--set", "disturbance=0.5")
    digests = {run_json(*arguments)["digest"]}
    for seed in ("1", "random"):
        done = epicycle("run", "collision_avoidance", *arguments, "--json", cwd=tmp_path, PYTHONHASHSEED=seed)
        assert done.returncode == 0, done.stderr
        digests.add(json.loads(done.stdout)["digest"])
    assert len(digests) == 1
    assert list(tmp_path.iterdir()) == []


def test_other_seed_gives_other_digest() -> None:
    assert run_json(*SHORT)["digest"] != run_json(*SHORT[:-1], "8")["digest"]


def test_aspects_at_zero_leave_no_trace() -> None:
    zero = run_json(*SHORT, "--set", "disturbance=0")
    without = run_json(*SHORT, "--without", "packet_loss", "--without", "measurement_failure")
    assert zero["digest"] == without["digest"]
    assert zero["aspects"].pop("packet_loss") == {"dropped": 0}
    assert zero["aspects"].pop("measurement_failure") == {"failed": 0}
    assert without["aspects"] == zero["aspects"]
    assert zero["aspects"]["plans_due"] == zero["aspects"]["plans_heard"]


def test_removing_an_aspect_moves_no_other_stream(tmp_path: Path) -> None:
    both, one = tmp_path / "both.jsonl", tmp_path / "one.jsonl"
    run_json(*SHORT, "--set", "disturbance=0.5", "--log", str(both))
    run_json(*SHORT, "--set", "disturbance=0.5", "--without", "packet_loss", "--log", str(one))

    def failures(path: Path) -> list[tuple[float, str]]:
        return [(row["time"], row["actor"]) for row in read_log(path) if row["aspect"] == "measurement_failure"]

    assert failures(both) == failures(one) != []


def test_packet_loss_spares_own_measurements(tmp_path: Path) -> None:
    log = tmp_path / "log.jsonl"
    result = run_json(*SHORT, "--aspect", "packet_loss=PacketLoss,probability=0.9", "--log", str(log))
    rows = read_log(log)
    dropped = [row for row in rows if row["aspect"]]
    assert len(dropped) == result["aspects"]["packet_loss"]["dropped"] > 0
    due, heard = (result["aspects"][name]["counted"] for name in ("plans_due", "plans_heard"))
    assert due - heard == sum(row["port"] == "peer_plan" for row in dropped) > 0
    assert {row["port"] for row in dropped} == {"peer_plan", "peer_measurement"}
    for row in dropped:  # what is lost at a robot comes from another one
        assert row["event"] == "dropped"
        assert row["value"]["robot"] != row["actor"]
    estimates = [row for row in rows if row["port"] == "estimate"]
    assert len(estimates) == 3 * 16
    for row in estimates:  # 16 ticks of three robots: each fused at least its own measurement
        assert row["actor"].removesuffix(".estimator") in row["value"]["sources"]
    assert any(len(row["value"]["sources"]) < 3 for row in estimates)


def test_run_writes_its_folder(tmp_path: Path) -> None:
    done = epicycle("run", "collision_avoidance", *SHORT, "--out", "here", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in (tmp_path / "here").iterdir()) == [
        "manifest.json",
        "signals.parquet",
        "trajectories.png",
    ]
    manifest = json.loads((tmp_path / "here" / "manifest.json").read_text())
    assert manifest["digest"] == run_json(*SHORT)["digest"]
    assert manifest["command"] == ["epicycle", "run", "collision_avoidance", *SHORT, "--out", "here"]
    assert (tmp_path / "here" / "trajectories.png").read_bytes().startswith(b"\x89PNG")
    import pyarrow.parquet as pq

    table = pq.read_table(tmp_path / "here" / "signals.parquet").to_pydict()
    main = [v for s, f, v in zip(table["signal"], table["field"], table["value"], strict=True)
            if s == "main.state" and f == "position[0]"]  # fmt: skip
    assert main[0] == 30.0
    assert len(main) == 16
    for word in ("arrival_time", "min_obstacle_distance", "packet_loss: dropped", "events", "wall time"):
        assert word in done.stdout


@pytest.mark.parametrize("ending", [".jsonl", ".csv", ".parquet"])
def test_log_formats(tmp_path: Path, ending: str) -> None:
    log = tmp_path / f"log{ending}"
    result = run_json("--set", "observers=1", "--until", "0.2", "--log", str(log))
    if ending == ".parquet":
        import pyarrow.parquet as pq

        table = pq.read_table(log)
        assert table.column_names[:2] == ["time", "microstep"]
        assert table.num_rows == result["events"]
    else:
        header = 1 if ending == ".csv" else 0
        assert len(log.read_text().splitlines()) == result["events"] + header


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("run", "colision_avoidance"),
            (
                "error: there is no packaged model 'colision_avoidance', did you mean 'collision_avoidance'?\n"
                "   help: packaged models: bouncing_ball, bouncing_modes, car_wash, changing_roles, "
                "collision_avoidance, feedback, flying_observers, inspection_paradox, lift_group, machine_shop, "
                "manufacturing_cell, many_obstacles, mg1, mm1, pid_loop, safe_avoidance, searching_robot, "
                "switched_network, thermostat, traffic_light, warehouse, waypoints; "
                "a path to a file ends in .yaml\n"
            ),
        ),
        (
            ("run", "collision_avoidance", "--set", "observer=3"),
            (
                "command line:1:7: error: 'observer' matches no parameter, did you mean 'observers'?\n"
                "    1 | --set observer=3\n"
                "      |       ^^^^^^^^^^\n"
            ),
        ),
        (
            ("run", "collision_avoidance", "--without", "packet_los"),
            (
                "command line:1:11: error: the model has no aspect 'packet_los', did you mean 'packet_loss'?\n"
                "    1 | --without packet_los\n"
                "      |           ^^^^^^^^^^\n"
                "   help: its aspects: plans_due, plans_heard, packet_loss, measurement_failure\n"
            ),
        ),
        (
            ("run", "collision_avoidance", "--log", "log.txt"),
            "error: log.txt is not a log file: its name must end in .parquet, .csv, .jsonl\n",
        ),
        (
            ("run", "collision_avoidance", "--log-where", "aspect=packet_loss"),
            "error: --log-where aspect=packet_loss needs --log FILE, the file to write the log to\n",
        ),
        (
            ("run", "collision_avoidance", "--log", "log.csv", "--log-where", "aspect=packet_los"),
            (
                "error: aspect=packet_los matches no aspect of the model, did you mean 'packet_loss'?; "
                "aspects: plans_due, plans_heard, packet_loss, measurement_failure\n"
            ),
        ),
        (
            ("run", "collision_avoidance", "--until", "3 m"),
            "error: '3 m' is a length, expected a time in s\n",
        ),
    ],
)
def test_bad_command_lines(
    arguments: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(list(arguments)) == 2
    assert capsys.readouterr() == ("", message)


def test_help_loads_nothing_heavy() -> None:
    done = epicycle("--help")
    assert done.returncode == 0
    probe = (
        "import sys\n"
        "from epicycle.runner.interface.cli import parser\n"
        "parser()\n"
        "print([m for m in ('numpy', 'networkx', 'rich', 'numba', 'yaml', 'simpy') if m in sys.modules])"
    )
    loaded = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert loaded.stdout.strip() == "[]"


TINY = """\
model: tiny
actors: {clock: {type: Clock, period: 1 s}, scale: {type: Scale, factor: 2}}
connections: [clock.output -> scale.input]
run: {stop: 10 s, record: [scale.output]}
"""


def answer(script: str, folder: Path) -> list[str]:
    """The last line of what a program prints, which runs a tiny model, in words."""
    (folder / "tiny.yaml").write_text(TINY, encoding="utf-8")
    done = subprocess.run([sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1].split()


def test_a_small_run_imports_and_searches_only_what_it_needs(tmp_path: Path) -> None:
    late = (
        "networkx", "scipy", "matplotlib", "numba", "pandas", "filterpy", "rich.progress", "difflib",
        "epicycle.actors.continuous", "epicycle.actors.robotics", "epicycle.runner.study.plan",
    )  # fmt: skip
    script = (
        "import sys, epicycle.runner.model.catalogue.types as types\n"
        "from epicycle.runner.interface.cli import main\n"
        "types.entry_points = None\n"  # which search all installed packages
        "assert main(['run', 'tiny.yaml']) == 0\n"
        f"print('imported:', *({{*{late}}} & {{*sys.modules}}))"
    )
    assert answer(script, tmp_path) == ["imported:"]


def test_what_a_program_imports_is_never_garbage(tmp_path: Path) -> None:
    """A command called by another program leaves the garbage collector as it was."""
    script = "import gc, sys\nfrom epicycle.runner.interface.cli import main\nbefore = gc.get_threshold()\n"
    told = "print(gc.get_freeze_count() > 10_000, gc.isenabled(), gc.get_threshold() == before)"
    program = f"{script}sys.argv = ['epicycle', 'run', 'tiny.yaml']\nassert main() == 0\n{told}"
    assert answer(program, tmp_path) == ["True", "True", "True"]
    assert answer(f"{script}assert main(['run', 'tiny.yaml']) == 0\n{told}", tmp_path) == ["False", "True", "True"]
