"""Monitors in a run: what they say of it, and that they change nothing in it."""

from __future__ import annotations

import json
import math
import random  # noqa: TID251 (what to try, and not what a model draws)
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import Actor, OutputPort, Parameter
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.execution.results import Results, Verdict
from epicycle.runner.interface.cli import main
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.text.problems import ModelError
from tests.engine.engine_parts import load


class Steps(Actor):
    """Sends values at their times."""

    is_source = True
    output = OutputPort(object)
    values = Parameter(object, doc="pairs of a time in s and what is sent then")

    def initialize(self) -> None:
        self._left = [(float(time), value) for time, value in self.values]
        for time in dict.fromkeys(time for time, _ in self._left):
            self.wake_in(time)

    def fire(self) -> None:
        while self._left and self._left[0][0] <= self.now:
            self.output.send(self._left.pop(0)[1])


def model(values: list[Any], monitors: str, more: str = "") -> Model:
    text = f"""
actors:
  a: {{type: Steps, values: {json.dumps(values)}}}
  b: {{type: Steps, values: [[1, 10], [6, 20]]}}
run: {{stop: 10 s}}
{more}
monitors:
  {monitors}
"""
    return load(text, types=[Steps])


def run(values: list[Any], monitors: str, more: str = "") -> Results:
    return Simulation(model(values, monitors, more)).run()


def broken(robustness: float, time: float) -> Verdict:
    return Verdict(False, robustness, time, {"a.output": 7})


RISING = [[0, 1], [2, 3], [4, 7], [7, 2]]


@pytest.mark.parametrize(
    ("source", "verdict"),
    [
        ("always a.output < 6", Verdict(False, -1.0, 4.0, {"a.output": 7})),
        ("always a.output < 8", Verdict(True, 1.0)),
        ("always after 5 s a.output < 6", Verdict(False, -1.0, 5.0, {"a.output": 7})),
        ("always within 3999 ms a.output < 6", Verdict(True, 3.0)),
        ("always within 4 s a.output < 6", Verdict(False, -1.0, 4.0, {"a.output": 7})),
        ("eventually a.output > 7", Verdict(False, 0.0, 7.0, {"a.output": 2})),  # the end of the run
        ("eventually within 3 s a.output > 3.5", Verdict(False, -0.5, 3.0, {"a.output": 3})),
        ("eventually (a.output > 5 for 3 s)", Verdict(False, -2.0, 7.0, {"a.output": 2})),
        ("eventually (a.output > 5 for 2999 ms)", Verdict(True, 2.0)),
        ("eventually within 12 s a.output > 9", Verdict(missing="the run was too short to tell")),
        ("a.output < 4 until a.output == 7", Verdict(True, 0.0)),
        ("always (a.output > 5 implies eventually within 3 s a.output < 3)", Verdict(True, 1.0)),
        (
            "always (a.output > 5 implies eventually within 2 s a.output < 3)",
            Verdict(False, -2.0, 4.0, {"a.output": 7}),
        ),
        ("always b.output < 15", Verdict(False, -5.0, 6.0, {"b.output": 20})),
        ("always a.output < b.output", Verdict(True, 3.0)),  # from 1 s on
        ("always (sends b.output implies a.output < 6)", Verdict(False, -1.0, 6.0, {"a.output": 7})),
        ("eventually from 1 s to 1 s sends b.output", Verdict(True, float("inf"))),
        ("eventually from 2 s to 3 s sends b.output", Verdict(False, float("-inf"), 3.0)),
        ("always a.output < 6 or always b.output < 30", Verdict(True, 10.0)),
        ("not eventually a.output > 6", Verdict(False, -1.0, 4.0, {"a.output": 7})),
    ],
)
def test_verdicts(source: str, verdict: Verdict) -> None:
    assert run(RISING, f"it: {source}").monitors["it"] == verdict


def test_margins_that_are_linear_between_tokens() -> None:
    results = run([[0, 8], [4, 0]], "low: {property: always a.output >= 2, between: linear}")
    assert results.monitors["low"] == Verdict(False, -2.0, 3.000000001, {"a.output": 8})
    results = run([[0, 8], [4, 0]], "low: {property: always a.output > 2, between: linear}")
    assert results.monitors["low"] == Verdict(False, -2.0, 3.0, {"a.output": 8})


@pytest.mark.parametrize("between", ["hold", "linear"])
def test_every_token_of_a_tag_counts(between: str) -> None:
    sent = [[0, 1], [2, 9], [2, 3]]
    found = run(sent, f"low: {{property: always after 2 s a.output < 5, between: {between}}}").monitors["low"]
    assert (found.holds, found.robustness, found.time) == (False, -4.0, 2.0)
    found = run(sent, f"high: {{property: eventually a.output > 5, between: {between}}}").monitors["high"]
    assert found == Verdict(True, 4.0)


@pytest.mark.parametrize(
    ("source", "verdict"),
    [
        ("always from 2 s to 2 s a.output < 5", Verdict(False, -4.0, 2.0, {"a.output": 9})),
        ("always after 2 s a.output < 5", Verdict(False, -4.0, 2.0, {"a.output": 9})),
        ("eventually within 2 s a.output > 5", Verdict(True, 4.0)),
        ("eventually (a.output > 5 for 0 s)", Verdict(False, -2.0, 6.0, {"a.output": 3})),  # the 3 is of that instant
        ("eventually (a.output > 5 and eventually within 0 s a.output < 4)", Verdict(True, 1.0)),
        (
            "eventually (a.output < 4 and eventually within 0 s a.output > 5)",
            Verdict(False, -2.0, 6.0, {"a.output": 3}),
        ),
        ("always a.output < 9.5 and (a.output < 5 until a.output == 9)", Verdict(True, 0.0)),
        ("a.output < 5 until a.output == 3", Verdict(False, -2.0)),  # the 9 comes before the 3
    ],
)
def test_operators_within_an_instant(source: str, verdict: Verdict) -> None:
    assert run([[0, 1], [2, 9], [2, 3]], f"it: {source}").monitors["it"] == verdict


class Both(Actor):
    """Sends the numbers of each list at one of two ports, the first port first."""

    is_source = True
    x = OutputPort(object)
    y = OutputPort(object)
    later = Parameter(bool, False, doc="whether y sends a microstep after x")

    def initialize(self) -> None:
        self._steps = [(1, 1), (5, 5), (2, 2)]
        self.wake_in(1.0)
        self._held: Any = None

    def fire(self) -> None:
        if self._held is not None:
            self.y.send(self._held)
            self._held = None
        elif self._steps:
            one, other = self._steps.pop(0)
            self.x.send(one)
            self.x.send(one + 1)
            if self.later:
                self._held = other
                self.wake_in(0.0)
                return
            self.y.send(other)
            self.y.send(other + 1)
        if self._steps:
            self.wake_in(1.0)


@pytest.mark.parametrize(
    ("later", "verdict"),
    [
        (False, Verdict(True, 0.0)),  # the first of each, the second of each
        (True, Verdict(False, -5.0, 1.0, {"p.x": 2, "p.y": 1})),  # at that microstep, y is still what it was
    ],
)
def test_ports_are_compared_once_all_have_sent_what_they_send_at_a_tag(later: bool, verdict: Verdict) -> None:
    built = Model("m", stop=10.0)
    built.add(Both("p", later=later))
    built.monitor("same", "always p.x == p.y")
    assert Simulation(built).run().monitors["same"] == verdict


@pytest.mark.parametrize("between", ["hold", "linear"])
def test_always_is_broken_by_any_token_and_by_none(between: str) -> None:
    for number in range(60):
        draw = random.Random(f"tokens {number}")
        sent = sorted([draw.randrange(4), draw.randrange(9)] for _ in range(draw.randrange(1, 9)))
        draw.shuffle(sent)
        sent.sort(key=lambda each: each[0])  # at one time, in any order
        limit = draw.randrange(9)
        monitors = (
            f"low: {{property: always a.output <= {limit}, between: {between}}}\n"
            f"  high: {{property: eventually a.output > {limit}, between: {between}}}"
        )
        found = run(sent, monitors).monitors
        most = max(value for _, value in sent)
        assert (found["low"].holds, found["low"].robustness) == (most <= limit, limit - most), sent
        assert (found["high"].holds, found["high"].robustness) == (most > limit, most - limit), sent


def test_a_condition_that_cannot_be_judged() -> None:
    results = run([[0, 1], [2, "three"]], "low: always a.output < 5")
    reason = "'a.output < 5' cannot be judged: 'three' < 5, at 2 s"
    assert results.monitors["low"] == Verdict(missing=reason)
    assert results.outcomes["low"].missing == results.outcomes["low_robustness"].missing == reason


def test_a_verdict_is_two_metrics() -> None:
    results = run(RISING, "low: {property: always a.output < 6, unit: m, label: low enough, doc: as it should be}")
    assert results.metrics == {"low": False, "low_robustness": -1.0}
    assert results.units == {"low": "1", "low_robustness": "m"}
    assert results.outcomes["low"].remarks == ["broken at 4 s, where a.output = 7"]


@pytest.mark.parametrize(
    ("source", "unit", "robustness"),
    [
        ("always a.output <= 420 deg", "deg", 420 - 7 * 180 / math.pi),
        ("always a.output <= 420 deg", "rad", 420 * math.pi / 180 - 7),
        ("always a.output <= 2 * 5 m", "cm", 300.0),
        ("always a.output <= 6 m", "cm", -100.0),
        ("always a.output <= 6", "cm", -1.0),  # of what the port sends
        ("always within 3 s a.output <= 6", "ms", 3.0),
        ("always a.output <= 7 km", "km", 6.993),
        ("always a.output <= 7 m", "km", 0.0),
    ],
)
def test_robustness_is_in_its_unit(source: str, unit: str, robustness: float) -> None:
    built = model(RISING, f"it: {{property: {source}, unit: {unit}}}")
    simulation = Simulation(built)
    found = simulation.run()
    verdict = found.monitors["it"]
    assert verdict.robustness == pytest.approx(robustness, abs=1e-12)
    assert found.metrics["it_robustness"] == verdict.robustness
    assert found.units["it_robustness"] == unit
    assert verdict.holds is (robustness >= 0.0)
    assert simulation.robustness("it") == pytest.approx(robustness, abs=1e-12)


@pytest.mark.parametrize(
    ("source", "unit", "message"),
    [
        (
            "always (a.output <= 60 deg and b.output < 3 m)",
            "deg",
            "monitor it: its robustness cannot be given in 'deg': 'b.output < 3 m' compares in 'm'",
        ),
        ("always a.output <= 60 deg", "degs", "monitor it: unit: unknown unit 'degs', did you mean 'deg/s'?"),
    ],
)
def test_a_unit_that_does_not_fit(source: str, unit: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        model(RISING, f"it: {{property: {source}, unit: {unit}}}")
    assert [each.message for each in caught.value.problems] == [message]


def test_an_infinite_robustness_is_no_metric() -> None:
    results = run(RISING, "heard: eventually sends b.output")
    assert results.monitors["heard"] == Verdict(True, float("inf"))
    assert results.metrics == {"heard": True, "heard_robustness": None}
    missing = "it is infinite: no comparison of numbers decides the property"
    assert results.outcomes["heard_robustness"].missing == missing


def test_a_monitor_ends_a_run_when_it_is_broken() -> None:
    found = run(RISING, "low: {property: always a.output < 6, stop: true}")
    assert (found.stopped, found.end) == ("monitor low", 4.0)
    found = run(RISING, "fast: {property: eventually within 5 s a.output > 9, stop: true}")
    assert (found.stopped, found.end) == ("monitor fast", 4.0)  # nothing happens at 5 s
    assert found.monitors["fast"] == broken(-2.0, 5.0)
    found = run(RISING, "linear: {property: always a.output < 6, stop: true, between: linear}")
    assert (found.stopped, found.end) == ("monitor linear", 4.0)


def test_monitors_change_nothing() -> None:
    monitors = "low: {property: always a.output < 6, between: linear}\n  other: sends a.output until b.output > 15"
    watched, plain = run(RISING, monitors), run(RISING, "{}")
    assert (watched.digest, watched.firings) == (plain.digest, plain.firings)


@pytest.mark.parametrize("between", ["hold", "linear"])
def test_snapshots_know_how_far_a_monitor_is(between: str) -> None:
    source = "always (a.output > 5 implies eventually within 3 s a.output < 2)"
    made = model(RISING, f"it: {{property: {source}, between: {between}}}")
    whole = Simulation(made).run()
    simulation = Simulation(made)
    simulation.advance(5.0)
    snapshot = simulation.snapshot()
    assert simulation.run().monitors == whole.monitors
    again = Simulation(made)
    again.restore(snapshot)
    assert again.run().monitors == whole.monitors


def test_monitors_of_a_model_built_in_python() -> None:
    built = Model("m", stop=10.0)
    steps = built.add(Steps("a", values=[[0, 1], [3, 5]]))
    built.monitor("low", "always a.output < 4", unit="m")
    assert Simulation(built).run().monitors["low"] == Verdict(False, -1.0, 3.0, {"a.output": 5})
    with pytest.raises(ModelError, match="there is already a metric 'low'"):
        built.monitor("low", "always a.output < 4")
    with pytest.raises(ModelError, match=r"monitor high: property: 'a\.input' names no output port"):
        built.monitor("high", "always a.input < 4")
    built.forget(steps.path)
    assert (built.output.monitors, built.output.metrics) == ([], [])


def test_a_broken_monitor_is_an_exit_code_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "m.yaml"
    file.write_text(
        "model: m\nactors: {clock: {type: Clock, period: 1}}\nrun: {stop: 10 s}\n"
        "monitors: {early: always within 3 s clock.output < 2, late: eventually clock.output > 8}\n",
        encoding="utf-8",
    )
    assert main(["run", str(file), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    early = {"holds": False, "robustness": -1.0, "time": 2.0, "values": {"clock.output": 2}}
    assert printed["monitors"]["early"] == early
    assert main(["run", str(file), "--json", "--check"]) == 3
    assert main(["run", str(file), "--json", "--check", "--until", "1"]) == 3  # as it is not late yet
    file.write_text(file.read_text(encoding="utf-8").replace("< 2", "< 9"), encoding="utf-8")
    assert main(["run", str(file), "--json", "--check"]) == 0


def drones(monitors: str, count: int = 3) -> Model:
    """Drones that send 1 at first, and 5 + their index after 3, 2, 1 s."""
    return load(
        f"""
parameters: {{n: {count}}}
actors:
  drone: {{type: Steps, count: "${{n}}", values: "${{[[0, 1], [3 - index, 5 + index]]}}"}}
run: {{stop: 5 s}}
monitors:
  {monitors}
""",
        types=[Steps],
    )


@pytest.mark.parametrize(
    ("source", "verdict", "remark"),
    [
        ("for every drone[*], always drone[*].output < 8", Verdict(True, 1.0), ""),
        (
            "for every drone[*], always drone[*].output < 7",
            Verdict(False, 0.0, 1.0, {"drone[2].output": 7}, broken_by=("drone[2]",)),
            "broken by drone[2] at 1 s, where drone[2].output = 7",
        ),
        (
            "'for every drone[*]: always drone[*].output < 3'",
            Verdict(False, -4.0, 1.0, {"drone[2].output": 7}, broken_by=("drone[2]", "drone[1]", "drone[0]")),
            "broken by drone[2] at 1 s, where drone[2].output = 7; then by drone[1] and drone[0]",
        ),
        ("for any drone[*], always drone[*].output < 6", Verdict(True, 1.0), ""),
        (
            "for any drone[*], always drone[*].output < 5",
            Verdict(False, 0.0, 3.0, {"drone[0].output": 5}),
            "broken at 3 s, where drone[0].output = 5",
        ),
        (
            "for every drone[*], eventually within 9 s drone[*].output > 8",
            Verdict(missing="of drone[0]: the run was too short to tell"),
            "",
        ),
        ("for every drone[*].output, eventually drone[*].output > 4.5", Verdict(True, 0.5), ""),
        ("for every drone[*], always drone[*].output <= drone[2].output + 4", Verdict(True, 4.0), ""),
    ],
)
def test_a_monitor_of_every_one_or_any(source: str, verdict: Verdict, remark: str) -> None:
    results = Simulation(drones(f"it: {source}")).run()
    assert results.monitors["it"] == verdict
    assert verdict.remark == remark
    assert results.metrics["it"] is verdict.holds
    assert results.monitors["it"].plain().get("broken_by", []) == list(verdict.broken_by)


def test_many_that_broke_a_monitor() -> None:
    broken_by = tuple(f"drone[{number}]" for number in range(9))
    verdict = Verdict(False, -1.0, broken_by=broken_by)
    assert verdict.remark == "broken by drone[0]; then by drone[1], drone[2], drone[3] and 5 others"


def test_a_monitor_of_every_one_ends_a_run() -> None:
    found = Simulation(drones("it: {property: 'for every drone[*], always drone[*].output < 7', stop: true}")).run()
    assert (found.stopped, found.end) == ("monitor it", 1.0)


def test_a_monitor_of_none() -> None:
    found = Simulation(drones("it: for every drone[*], always drone[*].output < 7", count=0)).run()
    assert found.monitors["it"] == Verdict(missing="its pattern matches nothing in this model")


def test_a_monitor_of_every_one_forgets_what_is_removed() -> None:
    built = drones("it: for every drone[*], always drone[*].output < 7")
    built.forget("drone[2]")
    assert Simulation(built).run().monitors["it"] == Verdict(True, 1.0)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("for all drone[*], always drone[*].output < 7", "monitor it: 'for all' is not supported"),
        ("for every", "monitor it: 'for every' names no pattern"),
        ("for every drone[*]", "monitor it: 'for every' names no property"),
        (
            "for every drone[*], always drone[1].output < 7",
            "monitor it: the property does not name drone[*], so it is the same for all",
        ),
        (
            "for every drones[*], always drones[*].output < 7",
            "monitor it: 'drones[*]' matches no actor, composite or output port, did you mean 'drone[*]'?",
        ),
        ("for every drone[, always drone[.output < 7", "monitor it: 'drone[' is not a pattern: "),
        (
            "for every drone[*], always drone[*].outptu < 7",
            "monitor it: property: 'drone[0].outptu' names no output port, did you mean 'drone[0].output'?",
        ),
        ("for every drone[*], drone[*].output < 7", "monitor it: 'drone[0].output < 7' would only be judged at the"),
    ],
)
def test_a_pattern_that_is_wrong(source: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        drones(f"it: {source}")
    assert [each.message[: len(message)] for each in caught.value.problems] == [message]
