"""Random networks of actors, and the results of their runs: the same with every core.

As a program it makes runs with the core that EPICYCLE_CORE asks for: a line of JSON in, one out.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from simpy.events import Event

from epicycle.actors import CORE, Actor, InputPort, OutputPort, Parameter, Process, Recorder
from epicycle.actors.expression import Formula
from epicycle.runner import Simulation, load_model
from epicycle.runner.execution.engine import ActorError, LoopError, errors
from epicycle.runner.model.text.problems import ModelError
from tests.engine.engine_parts import Join, Ticker


class Numbers(Protocol):
    """Where a network comes from: ``random.Random``, or Hypothesis in its place."""

    def random(self) -> float: ...
    def randint(self, low: int, high: int, /) -> int: ...
    def choice(self, items: Any, /) -> Any: ...


class Moody(Actor):
    """Asks for wake-ups and cancels them, sends to single channels, and fails now and then."""

    input: InputPort[Any] = InputPort(required=False, multi=True)
    output: OutputPort[Any] = OutputPort(float, multi=True, depends_on=())

    def initialize(self) -> None:
        self.wakes = [self.wake_in(0.5 * number) for number in range(3)]

    def fire(self) -> None:
        stream = self.random
        due = sum(wake.due for wake in self.wakes)
        self.wakes = [wake for wake in self.wakes if not wake.due]
        if self.wakes and stream.random() < 0.3:
            self.wakes.pop().cancel()
        if len(self.wakes) < 4:
            self.wakes.append(self.wake_in(stream.choice([0.0, 0.25, 1.0])))
        if stream.random() < 0.02:
            raise ValueError(f"{self.path} is out of sorts at {self.tag}")
        for _ in range(due):
            if self.output.width and stream.random() < 0.5:
                self.output.send(float(due), int(stream.integers(self.output.width)))
            else:
                self.output.send(self.now)


class Keeper(Actor):
    """Sends the first tokens of both inputs together; what waits for another one is lost."""

    input: InputPort[Any] = InputPort(multi=True)
    trigger: InputPort[Any] = InputPort()
    output: OutputPort[Any] = OutputPort(float)

    def fire(self) -> None:
        for token, _ in zip(self.input.tokens, self.trigger.tokens, strict=False):
            self.output.send(token)


class Patient(Process):
    """Reads and waits in turn, and yields to SimPy's own events."""

    input: InputPort[Any] = InputPort(required=False)
    output: OutputPort[Any] = OutputPort(float)

    def run(self) -> Generator[Event, Any, None]:
        while True:
            token = yield self.read(self.input)
            yield self.wait(0.25)
            self.output.send(token)
            yield self.environment.timeout(0.13)
            self.output.send(token)


class Odd(Actor):
    """Sends what arithmetic finds hard, several at a time now and then."""

    output: OutputPort[Any] = OutputPort(float)
    kind = Parameter(str, "floats")

    def initialize(self) -> None:
        self.wake_in(0)

    def fire(self) -> None:
        for _ in range(self.random.choice([1, 1, 1, 2])):
            self.output.send(ODD[self.kind][int(self.random.integers(len(ODD[self.kind])))])
        self.wake_in(0.25)


ODD: dict[str, list[Any]] = {
    "floats": [1.5, -0.0, 0.0, 2.0, -3.25, 0.1],
    "beyond": [1.5, -0.0, 1e308, -1e308, 5e-324, float("inf"), float("-inf"), float("nan")],
    "mixed": [1.5, -0.0, 2, 0, -7, 2**53 + 1, True, False, np.float64(0.5)],
}
TYPES = [Keeper, Moody, Patient, Ticker, Join, Odd]
EXPRESSIONS = (
    "a + b", "a - b", "time - a", "a + 2 * b", "a / b", "-a * b - time", "a > b", "a > 0 and not b > 1", "a or b",
    "a if a > b else -b", "max(a, 0.5) ** 2 // (b + 1)", "sqrt(a * a + b * b) % 2", "a < b <= 1", "1 / (a * b)", "-a",
)  # fmt: skip
OF_ANY: list[dict[str, Any]] = [
    {"take": "count"},
    {"take": "rate", "interval": 0.9},
    {"take": "share", "when": "value > 1", "initial": 0, "interval": 0.9},
]
OF_NUMBERS: list[dict[str, Any]] = [
    {"take": "last"},
    {"take": "max"},
    {"take": "sum"},
    {"take": "mean", "interval": 0.9},
    {"take": "mean", "after": "mser5"},
    {"take": "std", "after": 1},
    {"take": "quantile", "p": 0.3},
    {"take": "time_mean", "initial": 0, "interval": 0.9},
    {"take": "time_mean", "after": 0.5},
    {"take": "time_std"},
    {"take": "time_quantile", "p": 0.5},
]
SENDS_NUMBERS = ("Scale", "AddSubtract", "MultiplyDivide", "Counter", "Integrator", "Accumulator", "Expression")
TIMES = ("0 s", "100 ms", "250 ms", "0.5 s", "1 s")


def _source(numbers: Numbers) -> dict[str, Any]:
    kind = numbers.choice(["Clock", "Clock", "PoissonClock", "Ticker", "Const", "SingleEvent", "Moody", "Odd", "Odd"])
    if kind == "Clock":
        period = numbers.choice([0.25, 0.3, 1.0])
        given: dict[str, Any] = {"period": period}
        if numbers.random() < 0.5:
            given["values"] = numbers.choice([[1.5], [1, 2.5, -3], [7]])
        if numbers.random() < 0.3:
            given["offsets"] = numbers.choice([[0.0, 0.1], [0.0, 0.0, 0.2]])
        if numbers.random() < 0.3:
            given["stop_time"] = 3
        return {"type": kind, **given}
    if kind == "PoissonClock":
        return {"type": kind, "mean_interval": numbers.choice([0.2, 0.7]), "fire_at_start": numbers.random() < 0.5}
    if kind == "Ticker":
        return {"type": kind, "period": 0.5, "limit": numbers.randint(1, 12)}
    if kind == "Odd":
        return {"type": kind, "kind": numbers.choice([*ODD, "floats"])}
    return {"type": kind} if kind == "Moody" else {"type": kind, "value": numbers.choice([1, 2.0, -0.0])}


def _between(numbers: Numbers) -> tuple[dict[str, Any], list[str]]:
    """An actor with inputs and the names of these."""
    distribution = numbers.choice(
        [
            {"type": "Exponential", "mean": 0.3},
            {"type": "Gamma", "mean": 0.3, "shape": numbers.choice([0.3, 1, 2.5, 40])},
            {"type": "Uniform", "high": 0.5},
            {"type": "Normal", "mean": 1, "standard_deviation": 0.3},
            {"type": "Constant", "value": 0.25},
            {"type": "LogNormal", "median": 0.2},
        ]
    )
    formula: dict[str, Any] = {"expression": numbers.choice(EXPRESSIONS), "hold": numbers.random() < 0.7}
    if numbers.random() < 0.3:
        formula["gives"] = numbers.choice(["any value", "number"])
    names = [name for name in Formula(formula["expression"]).names if name != "time"]
    kinds: list[tuple[dict[str, Any], list[str]]] = [
        ({"type": "TimeDelay", "delay": numbers.choice(TIMES)}, ["input"]),
        ({"type": "TimeDelay"}, ["input", "delay"]),
        ({"type": "Scale", "factor": numbers.choice([2, 0.1, -1.5]), "offset": numbers.choice([0, 1, 0.5])}, ["input"]),
        ({"type": "Scale"}, ["input", "factor"]),
        ({"type": "AddSubtract"}, ["plus", "minus", "plus"]),
        ({"type": "MultiplyDivide"}, ["multiply", "divide"]),
        ({"type": "Server", "distribution": distribution, "servers": numbers.choice([1, 2, None])}, ["input"]),
        ({"type": "Server", "service_time": numbers.choice(TIMES), "capacity": numbers.choice([None, 2])}, ["input"]),
        ({"type": "Server", "servers": numbers.choice([1, 2])}, ["input", "service_time"]),
        (
            {
                "type": "Queue",
                "persistent_trigger": numbers.random() < 0.5,
                "capacity": numbers.choice([None, 1, 3]),
            },
            ["input", "trigger"],
        ),
        ({"type": "Merge", "discard": numbers.random() < 0.3}, ["input", "input", "input"]),
        ({"type": "Counter"}, ["increment", "decrement", "increment", "reset"]),
        ({"type": "Integrator", "method": numbers.choice(["hold", "trapezoid"])}, ["input", "trigger"]),
        ({"type": "Accumulator"}, ["input", "reset"]),
        ({"type": "Random", "distribution": distribution}, ["trigger"]),
        ({"type": "Expression", **formula}, names),
        ({"type": "Expression", **formula}, names),  # as often as two others
        ({"type": "Router"}, ["input"]),
        ({"type": "Sampler"}, ["input", "trigger"]),
        ({"type": "MostRecent"}, ["input", "trigger"]),
        ({"type": "Moody"}, ["input"]),
        ({"type": "Keeper"}, ["input", "trigger", "input"]),
        ({"type": "Patient"}, ["input"]),
        ({"type": "Join"}, ["input", "input"]),
    ]
    return numbers.choice(kinds)  # type: ignore[no-any-return]


OUTPUTS = {"Server": ["output", "size", "rejected"], "Queue": ["output", "size"]}
ASPECTS: list[dict[str, Any]] = [
    {"type": "PacketLoss", "probability": 0.3},
    {"type": "Latency", "delay": 0.1},
    {"type": "Duplicate", "probability": 0.3},
    {"type": "Probe"},
]
AT_ACTORS: list[dict[str, Any]] = [
    {"type": "ExecutionTime", "time": "50 ms"},
    {"type": "CrashRestart", "mtbf": 1.5, "repair": 0.3},
]


def network(numbers: Numbers, rules: Sequence[dict[str, Any]] = ()) -> dict[str, Any]:
    """A model, as in a JSON file; it need not be valid.  Its directors may have some of these rules."""
    actors: dict[str, Any] = {}
    sources: list[str] = []
    connections: list[dict[str, Any]] = []
    for index in range(numbers.randint(1, 2)):
        actors[f"s{index}"] = _source(numbers)
        sources.append(f"s{index}.output")
    ends: list[str] = []
    for index in range(numbers.randint(1, 6)):
        actors[f"a{index}"], inputs = _between(numbers)
        for place, name in enumerate(inputs):
            if place and name == inputs[0] and numbers.random() < 0.5:
                continue
            wire: dict[str, Any] = {"from": numbers.choice(sources), "to": f"a{index}.{name}"}
            if numbers.random() < 0.25:
                wire["delay"] = numbers.choice(TIMES)
            connections.append(wire)
        outputs = OUTPUTS.get(actors[f"a{index}"]["type"], ["output"])
        sources += [f"a{index}.{name}" for name in outputs]
        ends.append(f"a{index}.{numbers.choice(outputs)}")
    crossings = [wire["to"] for wire in connections if wire["to"].rpartition(".")[2] in ("plus", "increment")]
    if crossings and numbers.random() < 0.5:  # a loop
        wire = {"from": numbers.choice(ends), "to": numbers.choice(crossings), "delay": numbers.choice(TIMES)}
        connections.append(wire)
    actors["sink"] = {"type": "Recorder", "capacity": numbers.choice([0, 3, None])}
    connections += [{"from": port, "to": "sink.input"} for port in dict.fromkeys(ends)]
    model: dict[str, Any] = {"actors": actors, "connections": connections}
    if numbers.random() < 0.4:
        model["aspects"] = {"one": {**numbers.choice(ASPECTS), "at": numbers.choice(connections)["to"]}}
    if numbers.random() < 0.15:
        path = numbers.choice([name for name in actors if name != "sink"])
        model.setdefault("aspects", {})["two"] = {**numbers.choice(AT_ACTORS), "at": path}
    prefix = ""
    if numbers.random() < 0.3:
        part = {"actors": dict(actors), "connections": connections, "director": {"start": 1}}
        if numbers.random() < 0.5:
            part["director"] = {"drift": 1.5}
        elif numbers.random() < 0.3:
            del part["director"]
        if rules and "director" in part and numbers.random() < 0.3:
            part["director"].update(numbers.choice(rules))
        model = {"composites": {"Part": part}, "actors": {"part": {"type": "Part"}}}
        prefix = "part."
        if numbers.random() < 0.3:  # two of them in another one, each of which may have what the other one sends
            part |= {"inputs": {"into": None}, "outputs": {"out": None}}
            part["connections"] = [*connections, {"from": ends[0], "to": "out"}, {"from": "into", "to": "sink.input"}]
            around: dict[str, Any] = {"actors": {"part": {"type": "Part"}, "twin": {"type": "Part"}}}
            around["connections"] = [
                {"from": "part.out", "to": "twin.into"},
                {"from": "twin.out", "to": "part.into", "delay": numbers.choice(TIMES)},
            ]
            if numbers.random() < 0.7:
                around["director"] = numbers.choice([{}, {"drift": 0.5}, *rules])
            model = {"composites": {"Part": part, "Around": around}, "actors": {"around": {"type": "Around"}}}
            prefix = "around.part."
        ends = [f"{prefix}{port}" for port in ends]
    if rules and numbers.random() < 0.7:
        model["director"] = numbers.choice(rules)
    model["run"] = {"stop": numbers.choice([3, 6.05]), "seed": numbers.randint(0, 5), "record": ends[:2]}
    metrics: dict[str, Any] = {}
    for place in range(3):
        end = numbers.choice(ends)
        there = actors[end.removeprefix(prefix).partition(".")[0]]
        is_number = end.endswith("size") or (there["type"] in SENDS_NUMBERS and there.get("gives") != "any value")
        is_number = is_number and there.get("expression") not in ("a > b", "a < b <= 1", "a > 0 and not b > 1")
        metrics[f"m{place}"] = {"of": end, **numbers.choice([*OF_ANY, *(3 * OF_NUMBERS if is_number else ())])}
    model["metrics"] = metrics
    return model


def outcome(model: dict[str, Any], way: str) -> list[str]:
    """The results of a run as texts; ``way``: at once, in steps, or via a snapshot."""
    try:
        path = Path(tempfile.gettempdir()) / f"network-{os.getpid()}.yaml"
        path.write_text(json.dumps({"model": "network", **model}), encoding="utf-8")
        # Few tokens at one tag: loops that duplicate them end soon, in an error that is compared, too.
        made = load_model(path, types=TYPES, max_actors=200)
        path.unlink()
    except ModelError as error:
        return [error.problems[0].message]
    errors.MAX_MICROSTEPS = 200
    simulation = Simulation(made, keep_log=True)
    try:
        if way == "steps":
            while simulation.step():
                pass
        elif way == "snapshot":
            for _ in range(7):
                simulation.step()
            snapshot = simulation.snapshot()
            simulation.advance(until=2.0)
            simulation.restore(snapshot)
        results = simulation.finish() if way == "steps" else simulation.run()
    except (ActorError, LoopError) as error:
        results = simulation.results("an error")
        end = [str(error).replace(str(path), "network.yaml")]
    else:
        end = []
    recorders = [actor for actor in simulation.actors.values() if type(actor) is Recorder]
    return [
        *end,
        results.digest,
        str(results.events),
        repr(results.outcomes),
        repr(results.aspects),
        repr({name: (signal.tags, signal.tokens) for name, signal in results.signals.items()}),
        f"{results.end} {results.stopped} {results.firings} {simulation.tag}",
        repr([[vars(each).get(name) for name in ("seen", "tokens", "tags")] for each in recorders]),
        hashlib.sha256(b"".join(record.encoded() for record in simulation.log.records)).hexdigest(),
    ]


if __name__ == "__main__":
    print(CORE, flush=True)
    for line in sys.stdin:
        print(json.dumps(outcome(**json.loads(line))), flush=True)
