"""FMUs as actors: events at their own times, feedthrough, and what is wrong with them."""

from __future__ import annotations

import hashlib
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("fmpy")

from epicycle.actors import Clock, EpicycleError, ParameterError, StateSpace
from epicycle.bridges import FMU, fmi, trust
from epicycle.runner import ActorError, Model, ModelError, Results, Simulation
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue import types
from epicycle.runner.model.catalogue.code import code_of
from epicycle.runner.model.catalogue.types import TypesError
from tests.bridges.made_fmus import clocks, decay, events


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="module")
def stair(folder: Path) -> Path:
    return events(folder)


@pytest.fixture(scope="module")
def ticking(folder: Path) -> Path:
    return clocks(folder)


def ran(
    file: Path, tokens: dict[str, tuple[float, list[Any]]] | None = None, stop: float = 4.0, **given: Any
) -> Results:
    """A run of an FMU; ``tokens`` are those of a clock for each input, with its period, from then on."""
    model = Model("test", stop=stop)
    fmu = model.add(FMU("fmu", file=trust(file), **given))
    for name, (period, values) in (tokens or {}).items():
        clock = model.add(Clock(f"clock_{name}", period=period, offset=period, values=values, cycles=len(values)))
        model.connect(clock.output, fmu.inputs[name])
    model.record(*fmu.outputs.values())
    return Simulation(model).run()


def changes(results: Results, port: str) -> list[tuple[float, Any]]:
    """When a signal changes, and to what."""
    found: list[tuple[float, Any]] = []
    for time, value in zip(results[port].times, results[port].values, strict=True):
        if not found or value != found[-1][1]:
            found.append((float(time), value))
    return found


def test_an_fmu_of_somebody_runs_only_if_it_is_named(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(types, "_programs", set())
    monkeypatch.chdir(tmp_path)
    started: list[object] = []
    monkeypatch.setattr(fmi, "Slave", started.append)
    file = events(tmp_path)
    Path("plant.yaml").write_text(
        f"model: plant\nactors: {{pump: {{type: FMU, file: {file.name}}}}}\nrun: {{stop: 2}}\n"
    )
    assert main(["validate", "plant.yaml"]) == 0
    capsys.readouterr()
    assert main(["run", "plant.yaml"]) != 0
    where, why = "error: pump failed in initialize() at (0 s, 1)", "is a program, and nobody has said that it may run"
    assert capsys.readouterr().err.splitlines()[1:3] == [
        f"{where}: {file.name} {why}",
        f"   help: if you trust it, add --types {file.name}; in Python, types=[...] or trust(...)",
    ]
    assert started == []
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    assert main(["run", "plant.yaml", "--types", file.name]) == 0
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    assert code_of([file]) == {str(file.resolve()): digest}  # which seals a study's folder, as the code of types does
    with pytest.raises(TypesError, match=r"^--types gone.fmu: No such file or directory$"):
        trust("gone.fmu")


@pytest.mark.parametrize("apart", [False, True])
def test_time_events_are_at_their_times_whatever_the_step(stair: Path, apart: bool) -> None:
    for step in (0.3, 7.0):
        results = ran(stair, stop=20.0, step=step, apart=apart)
        assert changes(results, "fmu.counter") == [(float(number), number) for number in range(11)]
        assert (results.stopped, results.end) == ("fmu: the FMU ends the simulation", 10.0)
    assert changes(ran(stair, values={"period": "500 ms"}), "fmu.counter")[:3] == [(0.0, 0), (0.5, 1), (1.0, 2)]


def test_state_events_are_at_their_times_and_clocks_tick(stair: Path) -> None:
    results = ran(stair, {"flow": (0.25, [0.8])}, step=1.0, values={"period": 100})
    assert changes(results, "fmu.fills") == [(0.0, 0), (1.5, 1), (2.75, 2), (4.0, 3)]  # each 1 / 0.8 s after 0.25 s
    assert list(results["fmu.full"].times) == [1.5, 2.75, 4.0]
    assert results["fmu.full"].values.all()


def test_a_token_takes_back_what_has_run_ahead(stair: Path) -> None:
    results = ran(stair, {"flow": (0.25, [0.8]), "in": (0.6, [3.5])}, step=10.0, values={"period": 100})
    assert changes(results, "fmu.fills") == [(0.0, 0), (1.5, 1), (2.75, 2), (4.0, 3)]
    assert changes(results, "fmu.out") == [(0.0, 0.0), (0.6, 3.5)]


def test_without_states_to_save_tokens_act_from_the_next_communication_on(folder: Path, tmp_path: Path) -> None:
    results = ran(events(tmp_path, back="false"), {"in": (0.6, [3.5])}, step=0.5, values={"period": 100})
    assert changes(results, "fmu.out") == [(0.0, 0.0), (1.0, 3.5)]


def test_feedthrough_is_exact_and_within_the_tag(stair: Path) -> None:
    values = [0.1, 1 / 3, -1e300, 5e-324]
    results = ran(stair, {"in": (0.25, values)}, values={"period": 100})
    assert [each for each in changes(results, "fmu.out") if each[0] > 0] == [
        (0.25 * (number + 1), value) for number, value in enumerate(values)
    ]


@pytest.mark.parametrize("apart", [False, True])
def test_clocks_tick_at_their_times_with_their_values(ticking: Path, apart: bool) -> None:
    given = {"push": (1.0, [True] * 3), "amount": (0.9, [4.0]), "u": (0.2, [[1.0, 2.0, 3.0]])}
    results = ran(ticking, given, stop=4.0, apart=apart)
    # A token ticks a clock; inputs and outputs with this clock are of its ticks alone.
    assert changes(results, "fmu.total") == [(1.0, 4.0), (2.0, 8.0), (3.0, 12.0)]
    assert len(results["fmu.total"]) == 3
    # Each starts a countdown of 0.4 s, and too large a total ticks the output clock in the same event.
    assert list(results["fmu.delay"].times) == [1.4, 2.4, 3.4]
    assert changes(results, "fmu.late") == [(1.4, 1), (2.4, 2), (3.4, 3)]
    assert list(results["fmu.full"].times) == [3.0]
    assert changes(results, "fmu.overflows") == [(0.0, 0), (3.0, 1)]
    # Clocks with an interval tick by themselves: 0.25 s from 0.1 s on; 1/3 s, without drift.
    assert list(results["fmu.sample"].times) == [round(0.1 + 0.25 * number, 9) for number in range(16)]
    assert changes(results, "fmu.sampled") == [(0.1, 0.0), (0.35, 1.0)]
    assert list(results["fmu.thirds"].times) == [round(number / 3, 9) for number in range(13)]
    # Others ask the FMU for their interval: twice the last and 0.1 s from tick to tick; the factor, from 0.5 s on.
    assert list(results["fmu.pulse"].times) == [0.1, 0.4, 1.1, 2.6]
    assert list(results["fmu.paced"].times) == [0.5, 1.5, 2.5, 3.5]


def test_arrays_are_arrays(ticking: Path) -> None:
    results = ran(ticking, {"u": (0.2, [[1.0, 2.0, 3.0]])}, stop=0.3, values={"factor": 2, "u": [1, 1, 1]})
    found = [
        (float(time), each.tolist()) for time, each in zip(results["fmu.y"].times, results["fmu.y"].values, strict=True)
    ]
    one = [[2.0, 2.0, 2.0], [-2.0, -2.0, -2.0]]
    assert found == [(0.0, one), (0.1, one), (0.2, [[2.0, 4.0, 6.0], [-2.0, -4.0, -6.0]])]
    assert results["fmu.words"].values[0] == ["one", "two"]
    longer = ran(ticking, {"u": (0.2, [np.array([1.0, 2.0, 3.0, 4.0])])}, stop=0.2, values={"n": 4})
    assert longer["fmu.y"].values[-1].tolist() == [[1.0, 2.0, 3.0, 4.0], [-1.0, -2.0, -3.0, -4.0]]
    with pytest.raises(ActorError) as caught:
        ran(ticking, {"u": (0.2, [[1.0, 2.0]])})
    assert str(caught.value).splitlines()[0] == (
        "fmu failed in fire() at (0.2 s, 1): fmu.u: u of clocks.fmu is of type Float64[3], not [1.0, 2.0]"
    )


def test_arrays_fit_other_actors(ticking: Path) -> None:
    model = Model("test", stop=1.0)
    fmu = model.add(FMU("fmu", file=trust(ticking), step=0.5))
    plant = model.add(StateSpace("plant", a=[[0.0]], b=[[1.0]], c=[[1.0], [2.0], [3.0]]))
    clock = model.add(Clock("clock", period=0.5, values=[1.0]))
    model.connect(clock.output, plant.input)
    model.connect(clock.output, plant.trigger)
    model.connect(plant.output, fmu.inputs["u"])
    model.record(fmu.outputs["y"])
    assert Simulation(model).run()["fmu.y"].values[-1][0].tolist() == [1.0, 2.0, 3.0]
    other = Model("other", stop=1.0)
    fmu = other.add(FMU("fmu", file=trust(ticking), values={"n": 4}))
    plant = other.add(StateSpace("plant", a=[[0.0]], b=[[1.0]], c=[[1.0], [2.0], [3.0]]))
    other.connect(other.add(Clock("clock", period=0.5)).output, plant.trigger)
    with pytest.raises(ModelError) as caught:
        other.connect(plant.output, fmu.inputs["u"])
    assert "plant.output sends array[3], but fmu.u takes array[4] | list" in str(caught.value)


def test_an_fmu_of_version_2(folder: Path) -> None:
    file = decay(folder)
    results = ran(file, stop=1.0, step=0.1)
    expected, x = [1.0], 1.0
    for _ in range(10):
        x += 0.1 * (0.0 - 0.5 * x)
        expected.append(x)
    assert [float(each) for each in results["fmu.x"].values] == pytest.approx(expected, abs=1e-12)
    faster = ran(file, {"u": (0.5, [2.0])}, stop=1.0, step=0.1, values={"rate": 1.0})
    assert faster["fmu.x"].values[5] == pytest.approx(0.9**5, abs=1e-9)
    assert faster["fmu.x"].values[-1] > 0.8


def test_the_digest_of_a_run_has_that_of_the_fmu(stair: Path, tmp_path: Path) -> None:
    results = ran(stair)
    assert results["fmu.fmu"].values[0].startswith("sha256:")
    assert ran(stair).digest == results.digest
    other = tmp_path / "events.fmu"
    other.write_bytes(stair.read_bytes())
    with zipfile.ZipFile(other, "a") as archive:
        archive.writestr("documentation/more.txt", "more")
    assert ran(other).digest != results.digest


@pytest.mark.parametrize(
    ("interval", "reason"),
    [
        ('intervalDecimal="1e999999999"', "the interval of the clock c is not from 1e-09 s to 4e+09 s"),
        ('intervalDecimal="0"', "the interval of the clock c is not from 1e-09 s to 4e+09 s"),
        ('intervalDecimal="nan"', "the interval of the clock c is not from 1e-09 s to 4e+09 s"),
        ('intervalCounter="-1" resolution="3"', "the interval of the clock c is not from 1e-09 s to 4e+09 s"),
        ('intervalCounter="1" resolution="0"', "float division by zero"),
        ('intervalDecimal="1" shiftDecimal="-1"', "the shift of the clock c is not from 0 s to 4e+09 s"),
    ],
)
def test_a_clock_whose_interval_is_no_time(interval: str, reason: str, tmp_path: Path) -> None:
    clock = f'<Clock name="c" valueReference="1" causality="input" intervalVariability="constant" {interval}/>'
    with zipfile.ZipFile(path := tmp_path / "odd.fmu", "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            '<fmiModelDescription fmiVersion="3.0" modelName="odd" instantiationToken="odd">'
            '<CoSimulation modelIdentifier="odd" hasEventMode="true"/>'
            f"<ModelVariables>{clock}</ModelVariables><ModelStructure/></fmiModelDescription>",
        )
    with pytest.raises(EpicycleError) as caught:
        FMU.told(path)
    assert str(caught.value) == f"{path} is not an FMU: {reason}"


def test_describe(stair: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["describe", str(stair)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "events: FMI 3.0 for co-simulation"
    assert lines[2].split() == ["variable", "causality", "type", "unit", "start", "port"]
    assert lines[3].split() == ["period", "parameter", "Float64", "s", "1"]
    assert lines[4].split() == ["flow", "input", "Float64", "0", "flow"]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"perid": 2}, "fmu: values: events.fmu has no 'perid', did you mean 'period'?"),
        ({"level": 2}, "fmu: values: level of events.fmu is of causality output, and has its own"),
        ({"period": True}, "fmu: values: period of events.fmu is of type Float64, not true"),
        ({"mistake": 1.5}, "fmu: values: mistake of events.fmu is of type Int32, not 1.5"),
        ({"mistake": 2**31}, "fmu: values: mistake of events.fmu is of type Int32, not 2147483648"),
    ],
)
def test_wrong_values_are_reported(stair: Path, values: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        FMU("fmu", file=stair, values=values)
    assert f"fmu: {str(caught.value).removeprefix('fmu: ')}" == message


def test_what_cannot_run_is_reported(stair: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.fmu"
    broken.write_text("no archive")
    with pytest.raises(EpicycleError) as caught:
        FMU("fmu", file=broken)
    assert str(caught.value) == f"{broken} is not an FMU: File is not a zip file"
    with pytest.raises(EpicycleError) as caught:
        FMU("fmu", file=events(tmp_path, "x86_64-windows"))
    assert str(caught.value) == f"{tmp_path / 'events.fmu'} has no binary for x86_64-linux; it has: none"


@pytest.mark.parametrize(
    ("mistake", "reason"),
    [
        (1, "its process ended in step, with SIGABRT"),
        (2, "step takes longer than 1 s; its process was ended"),
        (3, "fmi3DoStep failed with status 3 (error)."),
    ],
)
def test_an_fmu_that_fails_ends_a_run_with_a_message(stair: Path, mistake: int, reason: str) -> None:
    with pytest.raises(ActorError) as caught:
        ran(stair, apart=True, limit=1.0, values={"mistake": mistake})
    assert str(caught.value).splitlines()[0] == f"fmu failed in fire() at (0 s, 1): {stair}: {reason}"


def test_a_token_that_is_no_number_is_reported(stair: Path) -> None:
    with pytest.raises(ActorError) as caught:
        ran(stair, {"in": (0.5, [float("nan")])})
    line = str(caught.value).splitlines()[0]
    assert line == "fmu failed in fire() at (0.5 s, 1): fmu.in: in of events.fmu is of type Float64, not nan"


REFERENCE = os.environ.get("EPICYCLE_REFERENCE_FMUS")  # a folder with 2.0/*.fmu and 3.0/*.fmu of the Reference-FMUs


@pytest.mark.skipif(REFERENCE is None, reason="EPICYCLE_REFERENCE_FMUS names no folder with the Reference-FMUs")
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_reference_fmus(version: str) -> None:
    folder = Path(REFERENCE or "") / version
    step = {"step": 5.0} if version == "3.0" else {}
    stairs = changes(ran(folder / "Stair.fmu", stop=20.0, **step), "fmu.counter")
    assert [value for _, value in stairs] == list(range(1, 11))
    if version == "3.0":
        assert [time for time, _ in stairs] == [float(number) for number in range(10)]
        ball = ran(folder / "BouncingBall.fmu", stop=3.0, step=3.0)
        times = [
            float(time) for time, speed in zip(ball["fmu.v"].times, ball["fmu.v"].values, strict=True) if speed > 1
        ]
        assert times[0] == 0.453  # as the FMU itself says, of whose internal steps of 1 ms it is one
    else:
        assert [round(time, 9) for time, _ in stairs] == [
            0.0,
            *(pytest.approx(each, abs=0.21) for each in range(1, 10)),
        ]
    circle = ran(folder / "VanDerPol.fmu", stop=20.0)
    assert float(circle["fmu.x0"].values[-1]) == pytest.approx(2.0148418861546133, abs=1e-9)
    name = "Float64_continuous"
    through = ran(folder / "Feedthrough.fmu", {f"{name}_input": (0.25, [0.1, 1 / 3])}, stop=1.0)
    assert [each for each in changes(through, f"fmu.{name}_output") if each[0]] == [(0.25, 0.1), (0.5, 1 / 3)]
    if version == "3.0":
        still = {"A": np.zeros((3, 3)), "B": np.eye(3), "C": np.eye(3), "D": np.zeros((3, 3))}
        system = ran(folder / "StateSpace.fmu", stop=2.0, step=1.0, values={**still, "u": [1.0, 0.5, 0.0]})
        ramps = [[0.0, 0.0, 0.0], [1.0, 0.5, 0.0], [2.0, 1.0, 0.0]]
        assert [each.tolist() for each in system["fmu.y"].values] == [pytest.approx(each, abs=1e-9) for each in ramps]
