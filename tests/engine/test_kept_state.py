"""What snapshots keep of user-defined actors and aspects, and what they refuse."""

from __future__ import annotations

import itertools
import threading
from collections import Counter, OrderedDict, defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import pytest
import simpy

from epicycle.actors import Actor, Clock, EpicycleError, InputPort, OutputPort, Recorder
from epicycle.aspects import CommunicationAspect, JoinPoint
from epicycle.runner import Model, Simulation
from epicycle.runner.execution.engine import CopyError, SnapshotError, Tracer
from tests.engine.engine_parts import Script, Ticker, load
from tests.engine.test_snapshots import assert_goes_on


class Gatherer(Actor):
    """Keeps tokens in many ways."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def __init__(self, path: str, tell: Callable[[Any], None] = print, **parameters: object) -> None:
        super().__init__(path, **parameters)
        self.tell = tell
        self.kept: list[Any] = []
        self.places = {"in": self.input, "me": self}
        self.react = self.keep

    def keep(self, token: Any) -> None:
        self.kept.append(token)

    def initialize(self) -> None:
        total = 0.0

        def add(token: float) -> float:
            nonlocal total
            total += token
            return total

        self.add = add

    def fire(self) -> None:
        assert self.places == {"in": self.input, "me": self}
        self.react(self.input.value)
        self.tell(self.now)
        self.output.send(self.add(self.random.random()))


class Library(Actor):
    """Keeps its state in what the standard library, NumPy and SimPy have for it, and in classes of its own."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def initialize(self) -> None:
        self.counts: Counter[str] = Counter()
        self.queues: dict[Any, deque[Any]] = defaultdict(deque)
        self.order: OrderedDict[str, Any] = OrderedDict(port=self.input)
        self.cells = np.array([None, self.input, [1.0]], dtype=object)
        self.seen = {self.input: {self.input, self.output}}
        self.last = deque([0.0], maxlen=2)
        self.resource = simpy.Container(self.context.environment, init=100)
        self.frozen = Frozen([0.0])
        self.numbers = itertools.count()
        self.fraction = Fraction(1, 3)
        self.loop: list[Any] = [self]
        self.loop.append(self.loop)
        self.alias = self.queues[self.input]
        self.view = MappingProxyType({"input": self.input})

    def fire(self) -> None:
        assert self.order["port"] is self.cells[1] is self.view["input"] is self.input
        assert self.seen == {self.input: {self.input, self.output}}
        assert self.loop[0] is self
        assert self.loop[1] is self.loop
        self.counts["fired"] += 1
        self.alias.append(self.input.value)
        self.last.append(self.random.random())
        self.cells[2].append(self.last[0])
        self.frozen.values.append(self.last[1])
        self.fraction /= 2
        self.resource.get(1)
        self.output.send(
            [self.counts["fired"], list(self.alias), *self.cells[2], *self.frozen.values, *self.last, self.frozen.total]
        )
        self.output.send(
            [list(self.queues[self.input]), float(self.fraction), self.resource.level, next(self.numbers) >= 0]
        )


@dataclass(frozen=True)
class Frozen:
    """Is frozen, but what it holds is not; and it knows more than its fields say."""

    values: list[float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "total", 7.0)


class Echo(CommunicationAspect):
    """Lets a token pass, and does it again later, by a function that it makes on the spot."""

    def __init__(self) -> None:
        super().__init__()
        self.passed = 0

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        self.passed += 1
        number = self.passed
        point.forward(token)
        point.later(0.7, lambda _: point.forward([number, token, point.random.random()]), None)


def own_model(heard: list[float]) -> tuple[Model, Gatherer, Echo]:
    model = Model("own", stop=6)
    clock, gatherer = model.add(Clock("clock", period=1)), model.add(Gatherer("gatherer", heard.append))
    sink = model.add(Recorder("sink"))
    model.connect(clock.output, gatherer.input)
    model.connect(gatherer.output, sink.input)
    echo = Echo()
    model.weave("echo", echo, at=sink.input)
    return model, gatherer, echo


def test_actors_and_aspects_of_ones_own() -> None:
    model, gatherer, echo = own_model([])
    assert_goes_on(model, 12)
    simulation = Simulation(model)
    simulation.run()
    assert simulation[gatherer] is simulation["gatherer"]
    assert len(simulation[gatherer].kept) == simulation[echo].passed == 7
    assert (gatherer.kept, echo.passed) == ([], 0)


def test_all_kinds_of_state() -> None:
    text = "actors: {t: {type: Ticker}, lib: {type: Library}, late: {type: TimeDelay, delay: 1.5}}\n"
    model = load(text + "connections: [t.output -> lib.input, lib.output -> late.input]", types=[Library])
    model.stop = 8
    assert_goes_on(model, 20)


def test_chains_may_be_long() -> None:
    model = load(
        "actors: {t: {type: Ticker}, s: {type: Scale, count: 400}}\n"
        'connections: ["t.output -> s[0].input", "s[..-2].output -> s[1..].input"]\nrun: {stop: 1}'
    )
    assert_goes_on(model, 1)


def test_functions_lead_to_where_they_led() -> None:
    heard: list[float] = []
    model, *_ = own_model(heard)
    simulation = Simulation(model)
    simulation.advance(3)
    simulation.restore(simulation.snapshot())
    simulation.run()
    assert heard == [0, 1, 2, 3, 4, 5, 6]


def test_a_fork_goes_its_own_way() -> None:
    model = load(
        "actors: {t: {type: Ticker}, s: {type: Scale}, probe: {type: Probe}}\n"
        "connections: [t.output -> s.input, s.output -> probe.input]\n"
    )
    model.stop = 3
    simulation = Simulation(model)
    simulation.advance(1)
    fork = simulation.fork()
    fork["s"].factor = 10.0  # type: ignore[attr-defined]
    values = []
    for each in (simulation, fork):
        each.run()
        values.append([tokens[0] for _, _, tokens in each["probe"].seen])  # type: ignore[attr-defined]
    assert values == [[0, 1, 2, 3], [0, 1, 20, 30]]


class Writer(Actor):
    """Holds what cannot be copied."""

    input: InputPort[Any] = InputPort(Any)

    def initialize(self) -> None:
        self.held = {"lock": threading.Lock()}

    def fire(self) -> None:
        with self.held["lock"]:
            pass


class Sharer(Writer):
    """Says so."""

    copies_share: ClassVar[tuple[str, ...]] = ("held",)


class Locked(CommunicationAspect):
    """Keeps such a thing at its ports."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.memory["lock"] = threading.Lock()
        point.forward(token)


def written(kind: type[Actor]) -> Model:
    model = load(
        f"actors: {{t: {{type: Ticker}}, w: {{type: {kind.__name__}}}}}\nconnections: [t.output -> w.input]",
        types=[kind],
    )
    model.stop = 4
    return model


def refused(doing: Callable[[], object], error: type[EpicycleError] = SnapshotError) -> str:
    with pytest.raises(error) as caught:
        doing()
    return str(caught.value)


def test_what_cannot_be_copied_is_named() -> None:
    simulation = Simulation(written(Writer))
    simulation.step()
    reason = "lock, which cannot be copied (cannot pickle '_thread.lock' object): define __deepcopy__ in "
    reason += "its class, or name the attribute in copies_share to let copies of the run share it"
    assert refused(simulation.snapshot, CopyError) == f"w.held holds a {reason}"
    assert simulation.run().end == 4  # nothing has happened to it
    assert_goes_on(written(Sharer), 4)
    model = written(Sharer)
    model.weave("locked", Locked(), at="w.input")
    simulation = Simulation(model)
    simulation.step()
    assert refused(simulation.fork, CopyError) == f"aspect locked at w.input holds a {reason}"


# -- processes --------------------------------------------------------------------------------------------------------


def test_processes_go_back_by_way_of_the_beginning(monkeypatch: pytest.MonkeyPatch) -> None:
    def behaviour(self: Script) -> Any:
        resource = simpy.Resource(self.environment)
        while True:
            token = yield self.read(self.input)
            with resource.request() as request:
                yield request
                yield self.environment.timeout(self.random.random())
            self.output.send(token)

    monkeypatch.setattr(Script, "behaviour", staticmethod(behaviour))
    text = "actors: {t: {type: Ticker}, s: {type: Script}, probe: {type: Probe}}\n"
    model = load(text + "connections: [t.output -> s.input, s.output -> probe.input]\nrun: {stop: 6 s}")
    assert_goes_on(model, 12)
    simulation = Simulation(model)
    simulation.advance(3)
    snapshot = simulation.snapshot()
    assert repr(snapshot) == f"<Snapshot of m, seed 0, at {simulation.tag}>"
    model.graph.actors["t"].period = 0.5  # type: ignore[attr-defined]
    assert refused(lambda: simulation.restore(snapshot)) == (
        f"m has processes, so its run was repeated from the start to go back to {snapshot.tag}, but the repeated run "
        "is different: the model was changed, or something depends on more than model and seed"
    )
    simulation.run()  # it is where it was


# -- what is refused --------------------------------------------------------------------------------------------------


def test_what_cannot_be_kept() -> None:
    model = load("actors: {t: {type: Ticker, limit: 3}}")
    untold = "the run of m reports to log_to or to a tracer, which cannot be undone: leave them out"
    records: list[Any] = []
    for options in ({"keep_log": True, "log_to": records.append}, {"tracer": Tracer(model.graph.actors, print)}):
        simulation = Simulation(model, **options)
        assert refused(simulation.snapshot) == refused(simulation.fork) == untold
        assert refused(lambda: simulation.restore(Simulation(model).snapshot())) == untold  # noqa: B023
    simulation = Simulation(model)
    simulation.run()
    assert refused(simulation.snapshot) == "the run of m is over: take a snapshot before its end"
    other = Simulation(load("actors: {t: {type: Ticker, limit: 3}}"), seed=5)
    assert refused(lambda: simulation.restore(other.snapshot())) == (
        "<Snapshot of m, seed 5, at (0 s, 0)> is of another model than this simulation of m"
    )


def test_a_run_that_is_over_goes_back() -> None:
    model = load("actors: {t: {type: Ticker, limit: 3}}")
    simulation = Simulation(model, seed=1)
    snapshot = Simulation(model, seed=7).snapshot()
    simulation.run()
    simulation.restore(snapshot)
    assert (simulation.seed, simulation.run().seed) == (7, 7)


def test_parts_that_are_not_there() -> None:
    model = load("actors: {ticker: {type: Ticker}}")
    simulation = Simulation(model)
    assert simulation["ticker"] is simulation.actors["ticker"] is not model.graph.actors["ticker"]
    assert refused(lambda: simulation["tiker"], EpicycleError) == "tiker is not part of m, did you mean 'ticker'?"
    assert refused(lambda: simulation[Ticker("ticker")], EpicycleError) == "Ticker() is not part of m"
    assert refused(lambda: simulation[Echo()], EpicycleError) == "Echo() is not part of m"
