"""What holds of every type of actor that came with state machines, resources, control and Ptolemy's own models.

Each says in whole messages what is wrong in the five likeliest ways, goes on from a snapshot and through a crash as if
nobody had looked, and tells why it fired.  A type that has no row here is found missing.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import pytest
import yaml

from epicycle.actors import declared_parameters, declared_ports, has_own_ports, robotics
from epicycle.runner.execution.engine import Firing, Simulation, Tracer
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.catalogue.types import built_in
from epicycle.runner.model.text.problems import ModelError, Problem
from tests.actors.feeding import load

# Those that there were before; they have tests of their own.
OLD = {
    "ODE", "Accumulator", "AddSubtract", "BooleanSwitch", "BroadcastChannel", "CircularMotion", "Clock",
    "Comparator", "Const", "Counter", "CurrentMicrostep", "CurrentTime", "Difference", "Display", "DistanceMonitor",
    "Estimator", "Expression", "FilterPyEstimator", "Function", "GoalMonitor", "Histogram", "Integrator",
    "LogicGate", "LookupTable", "Machine", "MathFunction", "Merge", "MostRecent", "MovingAverage",
    "MovingStatistics", "MultiplyDivide", "PoissonClock", "Queue", "Ramp", "Random", "Recorder", "Repeat", "Replay",
    "ResettableTimer", "RobustController", "Router", "Sampler", "Scale", "Select", "Sensor", "SeparationMonitor",
    "Sequence", "Server", "SingleEvent", "Station", "Stop", "Switch", "Synchronizer", "Test", "TimeDelay",
    "TimeGap", "Timer", "UnscentedEstimator", "Vehicle",
}  # fmt: skip
CAR = "car.pose"  # what is fed by it; all else is fed with tokens
BEATS: list[Any] = [[n / 4, n] for n in range(12)]
TRUTHS = [[n / 4, n % 3 > 0] for n in range(12)]
LISTS = [[n / 4, [n, n + 1]] for n in range(12)]
FIELDS = [[n / 4, {"x": n % 2, "y": n}] for n in range(12)]


@dataclass
class Row:
    """An actor that works, and a parameter that does not, with what is said of it."""

    parameters: str  # in YAML
    feeds: dict[str, Any]
    wrong: str = ""  # one of the parameters, of a wrong type or out of range
    message: str = ""


ROWS = {
    "PID": Row("integral: 1", {"measurement": BEATS},
        "filter_time: -1 s", "it.filter_time: -1 is out of bounds, expected a number in s >= 0"),
    "Ackermann": Row("speed: 1", {"trigger": BEATS, "steering": BEATS},
        "wheelbase: 0", "it.wheelbase: 0 is out of bounds, expected a number in m > 0"),
    "ArqReceiver": Row("", {"input": [[n / 4, {"number": n, "data": n}] for n in range(12)]},
        "repeat: two", "it.repeat: 'two' is not one of all, one"),
    "ArqSender": Row("timeout: 0.3 s", {"input": BEATS, "ack": [[1.3, 0]]},
        "window: 0", "it.window: 0 is out of bounds, expected an integer >= 1"),
    "Batch": Row("number: 3", {"input": BEATS},
        "number: 0", "it.number: 0 is out of bounds, expected an integer >= 1"),
    "BlockExpression": Row("number: 2, expression: 'block[1]'", {"input": BEATS},
        "number: two", "it.number: 'two' is not an integer >= 1"),
    "BooleanSelect": Row("", {"true_input": BEATS, "false_input": BEATS, "control": TRUTHS},
        "unread: gone", "it.unread: 'gone' is not one of kept, lost"),
    "Changes": Row("by: 1", {"input": BEATS},
        "by: -1", "it.by: -1 is out of bounds, expected a number >= 0"),
    "Collect": Row("", {"input": BEATS},
        "joined: maybe", "it.joined: 'maybe' is not true or false"),
    "Commutator": Row("block: 2", {"input": BEATS},
        "block: 0", "it.block: 0 is out of bounds, expected an integer >= 1"),
    "DeadZone": Row("low: 1, high: 2", {"input": BEATS},
        "low: 3", "it: low is 3 and high is 2: low must not be above high"),
    "Default": Row("", {"preferred": BEATS[::2], "alternate": BEATS}),
    "Derivative": Row("", {"input": BEATS}),
    "DiscreteFilter": Row("design: {type: FirstOrder, time_constant: 1 s, period: 250 ms}", {"input": BEATS},
        "design: FirstOrder",
        "it.design: 'FirstOrder' is not a mapping {type: ...} with one of the types Butterworth, FirstOrder"),
    "Equals": Row("", {"input": BEATS},
        "tolerance: -1", "it.tolerance: -1 is out of bounds, expected a number >= 0"),
    "Extreme": Row("take: least", {"input": BEATS},
        "take: most", "it.take: 'most' is not one of greatest, least"),
    "Filter": Row("condition: token > 2", {"input": BEATS},
        "condition: token >",
        "it.condition: 'token >' is not an expression: invalid syntax"),
    "FirstOfInstant": Row("", {"input": BEATS}),
    "HoldingExpression": Row("expression: a + b, held: {b: 1}", {"a": BEATS},
        "held: {c: 1}", "it: held: 'c' is not a name in the expression 'a + b'"),
    "Hysteresis": Row("lower: 1, upper: 5", {"input": BEATS},
        "lower: 5", "it: lower is 5 and upper is 5: lower must be below upper"),
    "InertialSensor": Row("turn_rate_noise: 1", {"pose": CAR},
        "turn_rate_noise: -1", "it.turn_rate_noise: -1 is out of bounds, expected a number >= 0"),
    "Inhibit": Row("", {"input": BEATS, "inhibit": BEATS[::3]}),
    "IsPresent": Row("", {"input": BEATS}),
    "LatestOfAll": Row("", {"input": BEATS}),
    "Limiter": Row("rising: 1", {"input": BEATS},
        "rising: -1", "it.rising: -1 is out of bounds, expected a number >= 0"),
    "Link": Row("rate: 5 bit/s, loss: 0.5", {"input": BEATS},
        "loss: 2", "it.loss: 2 is out of bounds, expected a number from 0 to 1"),
    "Match": Row("key: x", {"input": FIELDS},
        "key: x +", "it.key: 'x +' is not an expression: invalid syntax"),
    "NetworkSwitch": Row("port: 0, rate: 3 bit/s", {"input": BEATS},
        "latency: -1", "it.latency: -1 is out of bounds, expected a number in s >= 0"),
    "Pool": Row("capacity: 2", {"acquire": BEATS, "release": [[t, n] for t, n in BEATS if t > 1]},
        "capacity: -1", "it.capacity: -1 is out of bounds, expected an integer >= 0"),
    "Pools": Row("capacity: {a: 2, b: 3}", {"acquire": BEATS, "release": [[t, n] for t, n in BEATS if t > 1]},
        "amount: {c: 1}", "it: amount: there is no pool 'c'; valid names: a, b"),
    "Previous": Row("", {"input": BEATS}),
    "Pulse": Row("repeat: true", {"trigger": BEATS},
        "indexes: [1, 0]", "it: indexes: [1, 0] is not an ascending list of whole numbers >= 0"),
    "Quantizer": Row("step: 0.3", {"input": BEATS},
        "step: 0", "it.step: 0 is out of bounds, expected a number > 0"),
    "RangeBearingSensor": Row("landmark: [3, 4], range_deviation: 1", {"pose": CAR},
        "landmark: [3]", "it.landmark: [3] is not a list of 2 numbers in m"),
    "RangeScanner": Row("beams: 3, deviation: 1, discs: [[3, 4, 1]]", {"pose": CAR},
        "beams: 0", "it.beams: 0 is out of bounds, expected an integer from 1 to 10000"),
    "RecordAssembler": Row("fields: [a, b]", {"a": BEATS, "b": BEATS[2:]},
        "fields: []", "it: fields: the list is empty; name at least one field"),
    "RecordDisassembler": Row("fields: [x, y]", {"input": FIELDS},
        "fields: [x, x]", "it: fields: 'x' is listed twice"),
    "Register": Row("", {"input": BEATS, "trigger": BEATS[::2]}),
    "Sequencer": Row("", {"input": BEATS, "number": [[t, n ^ 1] for t, n in BEATS]},
        "first: a", "it.first: 'a' is not an integer"),
    "SetFields": Row("draw: {z: {type: Normal}}", {"input": FIELDS},
        "set: {z: x +}", "it.set: z: 'x +' is not an expression: invalid syntax"),
    "SetVariable": Row("value: 3", {"input": BEATS},
        "delayed: 2", "it.delayed: 2 is not true or false"),
    "SharedQueue": Row("capacity: 2", {"input": BEATS, "trigger": BEATS[::3]},
        "capacity: 0", "it.capacity: 0 is out of bounds, expected an integer >= 1"),
    "Spread": Row("", {"input": LISTS}),
    "StateMachine": Row(
        "modes: [a, b], transitions: [a -> b after 0.7 s, b -> a on go when go > 2 do o = go]", {"go": BEATS},
        "transitions: [a -> c]", "it: a -> c: there is no mode 'c'; modes: a, b"),
    "StateSpace": Row("a: [[-1]], b: [[1]]", {"input": BEATS, "trigger": BEATS},
        "a: [[1, 2]]", "it: a: 1 x 2, expected 1 x 1: it must be square"),
    "TextFunction": Row("function: upper", {"text": [[t, f"a{n}"] for t, n in BEATS]},
        "ignore_case: 1", "it.ignore_case: 1 is not true or false"),
    "TimeAverage": Row("", {"input": BEATS}),
    "TimeCompare": Row("", {"first": BEATS, "second": BEATS[1:]},
        "nonnegative: 5", "it.nonnegative: 5 is not true or false"),
    "TransferFunction": Row("denominator: [1, 1]", {"input": BEATS, "trigger": BEATS},
        "denominator: [0, 1]",
        "it: denominator: the first coefficient, that of the highest power, must not be 0 or missing"),
    "Unbatch": Row("", {"input": LISTS}),
    "Unicycle": Row("speed: 1", {"trigger": BEATS, "turn_rate": BEATS},
        "max_speed: -1", "it.max_speed: -1 is out of bounds, expected a number in m/s >= 0"),
    "Variable": Row("", {"input": BEATS},
        "delayed: 2", "it.delayed: 2 is not true or false"),
    "VaryingRandom": Row("distribution: {type: Normal}, varying: [mean]", {"trigger": BEATS, "mean": BEATS},
        "varying: [median]", "it: varying: Normal has no parameter 'median', did you mean 'mean'?"),
    "WaitingLine": Row("discipline: lifo", {"input": BEATS, "trigger": BEATS[::3]},
        "discipline: lilo", "it.discipline: 'lilo' is not one of fifo, lifo, random, did you mean 'lifo'?"),
    "WaitingTime": Row("", {"waiter": BEATS, "waited_for": BEATS[::3]}),
    "WaypointFollower": Row("waypoints: [[3, 4], [5, 6]]", {"pose": CAR},
        "waypoints: [1]", "it.waypoints: [1] is not a list of n x 2 numbers in m"),
}  # fmt: skip


def test_each_new_type_has_a_row() -> None:
    others = {"ModalActor", *robotics.__all__}  # one for programs; tests/actors/robotics has tests of robots
    assert sorted(ROWS) == sorted({*built_in().actors} - OLD - others)


def text(kind: str, parameters: str, feeds: dict[str, Any], more: str = "") -> str:
    """A model with the actor ``it``; of a parameter that is given twice, the second counts."""
    given = yaml.safe_load(f"{{{parameters.removeprefix(', ')}}}")
    actors: dict[str, Any] = {"it": {"type": kind, **given}}
    actors |= {name: {"type": "Feed", "events": each} for name, each in feeds.items() if each != CAR}
    joins = [f"{each if each == CAR else f'{name}.output'} -> it.{name}" for name, each in feeds.items()]
    if CAR in feeds.values():
        actors |= {"tick": {"type": "Clock", "period": 0.25}, "car": {"type": "Unicycle", "speed": 3, "turn_rate": 1}}
        joins.append("tick.output -> car.trigger")
    if "output" in declared_ports(built_in().actors[kind]):
        actors["seen"] = {"type": "Recorder"}
        joins.append("it.output -> seen.input")
    lines = [f"  {name}: {json.dumps(each)}" for name, each in actors.items()]
    return "\n".join(["model: m", "actors:", *lines, f"connections: {json.dumps(joins)}", more, ""])


def problems(kind: str, *changes: Any) -> list[Problem]:
    """What is wrong with the model of a row, parameters and feeds changed."""
    with pytest.raises(ModelError) as caught:
        load(text(kind, *changes))
    return list(caught.value.problems)


def told(found: list[Problem]) -> list[tuple[str, tuple[str, ...]]]:
    return [(each.message, each.help) for each in found]


@pytest.mark.parametrize("kind", ROWS)
def test_a_parameter_that_there_is_not(kind: str) -> None:
    row, parameters = ROWS[kind], list(declared_parameters(built_in().actors[kind]))
    (found,) = problems(kind, f"{row.parameters}, no_such: 1", row.feeds)
    assert found.message == f"it: {kind} has no parameter 'no_such'"
    assert found.help == (f"valid parameters: {', '.join(parameters) or 'none'}",)
    assert found.position is not None
    assert (found.position.line, found.position.column) == (3, found.position.source.index('"no_such"') + 1)


@pytest.mark.parametrize("kind", [kind for kind, row in ROWS.items() if row.wrong])
def test_a_value_that_cannot_be(kind: str) -> None:
    row = ROWS[kind]
    (found,) = problems(kind, f"{row.parameters}, {row.wrong}", row.feeds)
    assert found.message == row.message
    assert found.position is not None
    assert found.position.line == 3


@pytest.mark.parametrize("kind", ROWS)
def test_ports_that_there_are_not_and_those_that_are_missing(kind: str) -> None:
    row = ROWS[kind]
    ports = load(text(kind, row.parameters, row.feeds)).graph.actors["it"].inputs
    found = told(problems(kind, row.parameters, {**row.feeds, "zzz": []}))
    helps = [f"valid input ports: {', '.join(ports)}"]
    if has_own_ports(built_in().actors[kind]):
        helps.append(f"its parameters determine further ports; 'epicycle describe {kind}' says how")
    assert found == [(f"it: {kind} has no input port 'zzz'", tuple(helps))]
    if missing := [name for name, port in ports.items() if port.required]:
        assert [message for message, _ in told(problems(kind, row.parameters, {}))] == [
            f"it.{name} is not connected, but {kind} needs it" for name in missing
        ]


CRASH = "aspects: {crash: {type: CrashRestart, at: it, times: [1.2 s], repair: 0.2 s}}"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ROWS)
def test_snapshots_crashes_and_traces(kind: str) -> None:
    row, whole = ROWS[kind], {}
    for more in ("", CRASH):
        model = load(text(kind, row.parameters, row.feeds, more))
        results = Simulation(model, keep_log=True).run(until=5)
        whole[more] = results.digest
        events = [r.event for r in results.log.records if r.aspect and r.event != "skipped"]
        assert events == (["crashed", "restarted"] if more else [])
        cut = Simulation(model)
        for time in (0.9, 1.3, 2.0):  # the second is within the crash
            cut.advance(time)
            snapshot = cut.snapshot()
            assert cut.fork().run(until=5).digest == results.digest
            cut.restore(snapshot)
        assert cut.run(until=5).digest == results.digest
        assert firings(model) == results.digest
    assert whole[""] != whole[CRASH]


def firings(model: Model) -> str:
    """The digest of a traced run, in whose trace each token of the actor has a cause."""
    found: list[Firing] = []
    digest = Simulation(model, tracer=Tracer({"it": model.graph.actors["it"]}, found.append)).run(until=5).digest
    assert any(firing.records for firing in found)
    assert all(firing.arrivals or firing.wakes for firing in found)
    return digest
