"""What the packaged disturbances do to the scenario, with and without observers."""

from __future__ import annotations

import json
import math
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from epicycle.aspects import ClockOffset, ExecutionTime, Latency
from epicycle.runner import ModelError, Results, Simulation, load_model
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue.packaged import packaged_disturbances
from epicycle.runner.model.language.disturbance import load_disturbance
from epicycle.runner.model.text.problems import Problems

NAMES = sorted(packaged_disturbances())


@pytest.mark.parametrize("observers", [0, 4])
@pytest.mark.parametrize("name", NAMES)
def test_disturbance_acts_on_the_scenario(name: str, observers: int) -> None:
    model = load_model("collision_avoidance", set={"observers": observers}, disturb=name)
    plain = load_model("collision_avoidance", set={"observers": observers})
    own = {woven.name for woven in model.aspects} - {woven.name for woven in plain.aspects}
    results = Simulation(model, seed=3).run(until=1.5)
    assert own <= results.aspects.keys()
    if observers:
        acts = {name: counts for name in own if (counts := results.aspects[name]) != {"violated": 0}}
        assert all(sum(count or 0 for count in counts.values()) > 0 for counts in acts.values()), acts
    for path, signal in results.signals.items():
        if path.endswith(".state"):
            assert all(math.isfinite(x) for token in signal.tokens for x in (*token.position, *token.velocity))


@pytest.mark.parametrize("name", NAMES)
def test_disturbance_says_what_it_is(name: str) -> None:
    problems = Problems()
    disturbance = load_disturbance(name, problems)
    assert disturbance
    assert len(problems) == 0
    assert disturbance.root.name == name
    assert len(disturbance.root.doc) > 50
    declared = load_model("collision_avoidance", disturb=name).declared
    assert [each for each, said in disturbance.root.parameters.items() if not (said.value and declared[each].doc)] == []
    # Why a parameter has its value is said in a comment before it.
    text = packaged_disturbances()[name].read_text(encoding="utf-8")
    assert "parameters:\n  #" in text


def test_all_of_them_together() -> None:
    model = load_model("collision_avoidance", set={"observers": 2}, disturb=NAMES)
    assert Simulation(model, seed=1).run(until=0.5).events > 0


def test_two_disturbances_without_an_aspect_of_the_model(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = "--set observers=3 --disturb shared_radio --disturb gps_drift --without packet_loss --until 1 --json"
    assert main(["run", "collision_avoidance", *arguments.split()]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["aspects"].keys() - {"plans_due", "plans_heard"} == {
        *("measurement_failure", "radio", "gps_drift", "gps_noise", "keeps_off_obstacle", "keeps_off_robots")
    }
    assert result["aspects"]["radio"]["utilisation"] > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("observers", [0, 4])
@pytest.mark.parametrize("name", NAMES)
def test_robots_are_safe_or_it_is_told(name: str, observers: int) -> None:
    for seed in (1, 2):
        results = Simulation(
            load_model("collision_avoidance", set={"observers": observers}, disturb=name), seed=seed
        ).run()
        for metric, aspect in (
            ("min_obstacle_distance", "keeps_off_obstacle"),
            ("min_robot_distance", "keeps_off_robots"),
        ):
            distance = results.metrics[metric]
            assert (results.aspects[aspect]["violated"] == 0) == (distance is None or distance >= 2.0)


# -- what each of them means ------------------------------------------------------------------------------------------


def values(results: Results, actor: str, port: str, event: str = "send") -> dict[int, Any]:
    """What a port sent, or an aspect did at it, by tick."""
    return {
        round(record.tag.seconds * 10): record.value
        for record in results.log.records
        if (record.actor, record.port, record.event) == (actor, port, event)
    }


def test_gps_drift_is_in_what_a_robot_says_and_not_in_where_it_is() -> None:
    """The believed place walks away from the true one by 0.13 m / sqrt(s) in each direction, at 99.9 %."""
    squares, count = 0.0, 0
    settings = {
        "observers": 2,
        "gps_noise": 0,
        "**.sensor.along": 1e-9,
        "**.sensor.across": 1e-9,
        "**.controller.horizon": 3,
    }
    for seed in range(4):
        model = load_model("collision_avoidance", set=settings, disturb="gps_drift")
        results = Simulation(model, seed=seed, keep_log=True).run(until=1.6)
        obstacle = values(results, "obstacle", "state")
        for robot in ("main", "observer[0]", "observer[1]"):
            state, plan, seen = (
                values(results, f"{robot}.{actor}", port)
                for actor, port in (("vehicle", "state"), ("controller", "plan"), ("sensor", "measurement"))
            )
            error = {tick: plan[tick].state.position - state[tick].position for tick in range(17)}
            assert np.abs(error[0]).max() == 0.0
            for tick in range(17):
                # It measures from where it is, and says that it did so from where it believes to be.
                assert seen[tick].observer.tolist() == plan[tick].state.position.tolist()
                away = obstacle[tick].position - state[tick].position
                assert seen[tick].value == pytest.approx(away, abs=1e-6)
            steps = np.diff([error[tick] for tick in range(17)], axis=0) / (0.13 * math.sqrt(0.1))
            squares, count = squares + float((steps**2).sum()), count + steps.size
    low, high = stats.chi2.interval(0.999, count)
    assert low <= squares <= high


def test_range_limited_sensors_fail_where_the_obstacle_is_far() -> None:
    model = load_model("collision_avoidance", set={"observers": 2}, disturb="range_limited")
    results = Simulation(model, seed=2, keep_log=True).run(until=2.5)
    obstacle, near = values(results, "obstacle", "state"), set()
    for robot in ("main", "observer[0]", "observer[1]"):
        state = values(results, f"{robot}.vehicle", "state")
        failed = values(results, f"{robot}.sensor", "measurement", "failed")
        for tick, own in state.items():
            is_far = math.dist(own.position, obstacle[tick].position) > 15.0
            assert (tick in failed) == is_far
            near.add(is_far)
    assert near == {True, False}


def test_airtime_of_the_shared_radio_grows_with_the_robots() -> None:
    share = []
    for robots in (1, 3, 5):
        model = load_model("collision_avoidance", set={"observers": robots - 1, "horizon": 3}, disturb="shared_radio")
        share.append(Simulation(model, seed=1).run(until=1.0).aspects["radio"]["utilisation"])
    # A plan of 3 steps has 1 + 5 + 2 * 4 numbers, a measurement 7, 64 bits each, beside what every message has.
    airtime = 2 * (242e-6 + 768e-6) + (14 + 7) * 64e-6
    assert share[0] == pytest.approx(airtime / 0.1, rel=0.11)  # up to the airtime of the last tick
    for robots, each in ((3, share[1]), (5, share[2])):  # what collides takes its time only once
        assert 0.6 * robots * share[0] < each <= robots * share[0]


def test_sensors_drop_out_in_runs() -> None:
    settings = {"observers": 0, "dropout": 0.5, "**.controller.horizon": 3, "arrival_near.tolerance": 0}
    model = load_model("collision_avoidance", set=settings, disturb="sensor_dropout_burst")
    results = Simulation(model, seed=4, keep_log=True).run(until=20)
    failed = values(results, "main.sensor", "measurement", "failed")
    lengths = [len(list(run)) for is_failed, run in groupby(tick in failed for tick in range(201)) if is_failed]
    error = stats.norm.ppf(0.9995) * math.sqrt(1 - 1 / 5) * 5 / math.sqrt(len(lengths))
    assert abs(np.mean(lengths) - 5) < error
    assert np.mean(lengths) > 2.5  # more than the 2 of independent failures


def test_a_crashed_robot_is_silent_and_moves_on() -> None:
    """Meanwhile nothing comes from it but its motion; what it believes begins with the prior again."""
    settings = {"observers": 7, "mtbf": "2 s", "restart_time": "550 ms", "**.controller.horizon": 3}
    model = load_model("collision_avoidance", set=settings, disturb="robot_crash")
    results = Simulation(model, seed=1, keep_log=True).run(until=3)
    down: dict[str, list[tuple[float, float]]] = {}
    for record in results.log.records:
        if record.event == "restarted":
            down.setdefault(record.actor, []).append((record.tag.seconds - record.value, record.tag.seconds))
    assert len(down) >= 3
    for robot, times in down.items():
        assert list(values(results, f"{robot}.vehicle", "state")) == list(range(31))
        for actor, port in (("sensor", "measurement"), ("controller", "plan"), ("estimator", "estimate")):
            said = values(results, f"{robot}.{actor}", port)
            for begin, end in times:
                assert end - begin == pytest.approx(0.55)
                assert [tick for tick in said if begin < tick / 10 < end] == []
        estimates = values(results, f"{robot}.estimator", "estimate")
        for begin, end in times:  # from one measurement the filter cannot learn a speed, of which the variance was 4
            assert estimates[math.ceil(end * 10)].covariance[2, 2] == pytest.approx(4.0)
            assert estimates[math.floor(begin * 10)].covariance[2, 2] < 3.9


def test_a_controller_that_is_ready_by_the_next_tick_is_fast_enough() -> None:
    """Solving for less than a period changes nothing of what happens at the ticks, and for longer it does."""
    ways = []
    for disturb, settings in (
        ((), {}),
        ("slow_controller", {"solve_time": "90 ms", "solve_spread": 0}),
        ("slow_controller", {"solve_time": "101 ms", "solve_spread": 0}),
    ):
        model = load_model("collision_avoidance", set={"observers": 2, **settings}, disturb=disturb)
        states = Simulation(model, seed=1).run(until=2.5).signals["main.state"]
        ways.append([token.position.tolist() for token in states.tokens])
    assert ways[0] == ways[1] != ways[2]


def test_every_plan_is_as_old_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """How old the controllers take plans to be, against when their makers were where the plans begin: none is wrong."""
    from epicycle.actors.robotics.numerics import reachability
    from epicycle.actors.robotics.numerics.warm_up import compile_kernels

    compile_kernels()
    used: list[tuple[float, np.ndarray]] = []
    original = reachability.peer_tubes

    def watched(plans: np.ndarray, now: float, *rest: Any) -> Any:
        used.append((now, plans.copy()))
        return original(plans, now, *rest)

    monkeypatch.setattr(reachability, "peer_tubes", watched)
    ages = wrong = 0
    for seed in (1, 2):
        used.clear()
        model = load_model("collision_avoidance", set={"observers": 3}, disturb="slow_controller")
        results = Simulation(model, seed=seed, keep_log=True).run()
        when: dict[tuple[float, ...], list[int]] = {}
        for record in results.log.records:
            if record.port == "state" and record.actor.endswith(".vehicle"):
                place = (*record.value.position.tolist(), *record.value.velocity.tolist())
                when.setdefault(place, []).append(record.tag.time)
        plans = [record.value for record in results.log.records if record.port == "plan"]
        assert all(plan.time == plan.state.time for plan in plans)
        assert len(plans) == len(used)
        for plan, (now, known) in zip(plans, used, strict=True):
            solved_for = when[*plan.state.position.tolist(), *plan.state.velocity.tolist()]
            for row in known:
                made_at = when[tuple(row[3:7].tolist())]
                if len(solved_for) == len(made_at) == 1:  # at the start, robots stand where they were
                    ages += 1
                    wrong += round((solved_for[0] - made_at[0]) / 1e8) != round((now - row[0]) / 0.1)
    assert ages > 900
    assert wrong == 0


@pytest.mark.parametrize("time", ["60 ms", {"trigger": "60 ms", "peer_plans": 0}])
def test_controllers_that_take_60_ms_bring_every_run_home(time: Any) -> None:
    """Only solving takes them time; if hearing a plan did, too, they would be busy for longer than there is time."""
    arrivals = []
    for seed in range(1, 7):
        model = load_model("collision_avoidance", set={"observers": 3})
        model.weave("slow", ExecutionTime(time=time), at="**.controller")
        arrivals.append(Simulation(model, seed=seed).run().metrics["arrival_time"])
    assert all(4.5 < arrival < 6.0 for arrival in arrivals), arrivals


def test_a_robot_whose_clock_is_wrong_trusts_its_own_data() -> None:
    """A second ahead in all that it says, it fuses its own measurements in time, and its estimates are fresh to it."""
    alone = load_model("collision_avoidance", set={"observers": 0})
    right = Simulation(alone, seed=1, keep_log=True).run(until=2)
    alone.weave("ahead", ClockOffset(offset=1), at="main")
    wrong = Simulation(alone, seed=1, keep_log=True).run(until=2)
    estimates = values(wrong, "main.estimator", "estimate")
    for tick, expected in values(right, "main.estimator", "estimate").items():
        assert estimates[tick].time == pytest.approx(expected.time + 1)
        assert estimates[tick].mean.tolist() == pytest.approx(expected.mean.tolist())
    assert values(wrong, "main.estimator", "too_late") == {}
    here, there = (values(run, "main.vehicle", "state")[20].position for run in (right, wrong))
    assert there == pytest.approx(here, abs=1e-6)


def test_an_estimate_that_is_late_is_not_taken_for_fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    from epicycle.actors.robotics.numerics import reachability
    from epicycle.actors.robotics.numerics.warm_up import compile_kernels

    compile_kernels()
    ages: list[float] = []
    original = reachability.expected_target

    def watched(*arguments: Any) -> Any:
        ages.append(arguments[-3])
        return original(*arguments)

    monkeypatch.setattr(reachability, "expected_target", watched)
    model = load_model("collision_avoidance", set={"observers": 0})
    model.weave("late", Latency(delay=0.4), at="main.controller.estimate")
    Simulation(model, seed=1).run(until=2)
    assert ages == pytest.approx([0.4] * 17)  # from 0.4 s on


@pytest.mark.parametrize("latency", ["1 us", "30 ms"])
def test_plans_and_controls_count_from_the_next_tick_on(latency: str) -> None:
    """What ``latency`` says of itself, without which a disturbance that brings one could not put it at zero."""
    digests = {
        Simulation(load_model("collision_avoidance", set={"latency": each}), seed=5).run(until=1.0).digest
        for each in (latency, "100 ms")
    }
    assert len(digests) == 1


DISTURBANCE = """
disturbance: leaky
parameters: {leak: {value: 0.25, unit: "1", min: 0, max: 1}, fast: "${mean_service < 1}"}
aspects: {leaky: {type: PacketLoss, probability: "${leak if not fast else 0}", at: server.input}}
"""


def test_a_disturbance_in_python_is_the_one_of_the_command_line(tmp_path: Path) -> None:
    file = tmp_path / "leaky.yaml"
    file.write_text(DISTURBANCE)
    at_once = load_model("mm1", disturb=[file], set={"leak": 0.5})
    later = load_model("mm1")
    (woven,) = later.disturb(file, set={"leak": "0.5"})
    assert (woven.name, woven.ports) == ("leaky", ["server.input"])
    counts = [Simulation(model, seed=2).run(until=200).digest for model in (at_once, later, load_model("mm1"))]
    assert counts[0] == counts[1] != counts[2]
    # It can be swept.
    swept = [load_model("mm1", disturb=str(file), set={"leak": leak}).aspects[0].aspect for leak in (0.1, 0.2)]
    assert [repr(aspect) for aspect in swept] == ["PacketLoss(probability=0.1)", "PacketLoss(probability=0.2)"]


@pytest.mark.parametrize("gap", ["{value: 100, unit: ms}", "{value: 0.1, unit: s}", "{value: , unit: ms}"])
def test_parameters_of_a_model_keep_their_units_in_a_later_disturbance(gap: str, tmp_path: Path) -> None:
    actors = "actors: {clock: {type: Clock, period: '${gap}'}, seen: {type: Recorder}}\n"
    model, file = tmp_path / "m.yaml", tmp_path / "late.yaml"
    model.write_text(f"model: m\nparameters: {{gap: {gap}}}\n{actors}connections: [clock.output -> seen.input]\n")
    file.write_text("disturbance: late\naspects: {late: {type: Latency, delay: '${gap}', at: seen.input}}\n")
    at_once, later = load_model(model, disturb=file, set={"gap": "0.1 s"}), load_model(model, set={"gap": "0.1 s"})
    (woven,) = later.disturb(file)
    assert repr(woven.aspect) == repr(at_once.aspects[0].aspect) == "Latency(delay=0.1)"


def test_what_is_wrong_with_a_disturbance_of_a_model_that_is_made(tmp_path: Path) -> None:
    file = tmp_path / "leaky.yaml"
    file.write_text(DISTURBANCE)
    model = load_model("mm1")
    before = list(model.aspects)
    here = Path(__file__).name

    def told(**values: object) -> list[str]:
        with pytest.raises(ModelError) as caught:
            model.disturb(file, set=values)
        assert model.aspects == before
        text = str(caught.value).replace(f"{tmp_path}/", "")
        lines = [line.rpartition(here)[2] for line in text.splitlines()]
        return [line.partition("error: ")[2] or line for line in lines if "error:" in line or "help:" in line]

    assert told(leek=0.5) == ["'leek' matches no parameter, did you mean 'leak'?"]
    assert told(leak=2) == ["leak: 2 is out of bounds, expected a number from 0 to 1"]
    assert told(load=0.5) == ["'load' is a parameter of the model, not of the disturbance leaky"]
    file.write_text(DISTURBANCE.replace("server.input", "server.inptu") + "set: {mean_service: 2}")
    assert told() == [
        "'mean_service' can no longer be set: the model has been built",
        "   help: load the model together with the disturbance: load_model(..., disturb='leaky.yaml')",
    ]
    file.write_text(DISTURBANCE.replace("server.input", "server.inptu"))
    assert told()[0] == "aspect leaky: 'server.inptu' matches no port, did you mean 'server.input'?"
    file.write_text(DISTURBANCE)
    model.disturb(file)
    before = list(model.aspects)
    assert told() == ["there is already an aspect 'leaky'", "   help: unweave it first"]
