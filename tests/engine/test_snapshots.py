"""Runs that are stepped, kept, gone back to and forked: from there on everything is as in a run that nobody touched."""

from __future__ import annotations

import itertools
import random  # noqa: TID251 (where to look, and not what a model draws)
import threading
from collections import Counter, OrderedDict, defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import pytest
import simpy

from epicycle.actors import Actor, Clock, EpicycleError, InputPort, OutputPort, Recorder
from epicycle.aspects import Aspect, CommunicationAspect, JoinPoint
from epicycle.runner import Model, Simulation, load_model
from epicycle.runner.catalogue import packaged_disturbances, packaged_models
from epicycle.runner.engine import ActorError, CopyError, SnapshotError, Tracer
from tests.aspects.strengths import AT_WORK
from tests.aspects.testing.test_non_interference import GRID, at_home
from tests.conformance.conformance_parts import TYPES
from tests.demo_models import DURATIONS
from tests.engine.engine_parts import Plan, Script, Ticker, load

CONFORMANCE = sorted((Path(__file__).parents[1] / "conformance" / "models").glob("*.yaml"))
CONFORMANCE = [path for path in CONFORMANCE if path.stem != "DEFixedPointLimitation"]  # which we refuse
FEATURES = """
parameters: {period: 100 ms}
composites:
  Late:
    inputs: [in]
    outputs: [out]
    director: {start: 1, drift: 1.5}
    actors: {hold: {type: TimeDelay, delay: 150 ms}, twice: {type: Scale, factor: 2}}
    connections: [in -> hold.input, hold.output -> twice.input, twice.output -> out]
  Line:
    inputs: [in]
    outputs: [out]
    actors: {hold: {type: TimeDelay, delay: 30 ms}}
    connections: [in -> hold.input, hold.output -> out]
actors:
  tick: {type: PoissonClock, mean_interval: "${period}"}
  walk: {type: Random, distribution: {type: Normal}}
  late: {type: Late, count: 2}
  join: {type: Join}
  server: {type: Server, distribution: {type: Exponential, mean: 90 ms}}
  seen: {type: Recorder}
connections:
  - tick.output -> walk.trigger, server.input
  - {from: walk.output, to: "late[*].in", delay: 10 ms}
  - late[*].out -> join.input
  - join.output, server.output -> seen.input
  - walk.output -> seen.input
aspects:
  noise: {type: Noise, at: "late[0].twice.factor", deviation: 0.1}
  line: {type: Line, at: server.input}
  slow: {type: ExecutionTime, at: join, time: 20 ms}
  crash: {type: CrashRestart, at: "late[1]", mtbf: 1 s, repair: 200 ms}
  drift: {type: ClockDrift, at: server, deviation: 0.01}
  loss: {type: GilbertElliott, at: "late[*].in", p: 0.2, r: 0.5}
  bus: {type: Bus, at: seen.input, factor: 5 ms}
  watch: {type: Probe, at: seen.input, when: walk.output > 0, until: 5 s}
run: {stop: 8 s, seed: 3, record: ["late[*].out", server.output]}
metrics:
  mean: {of: walk.output, take: mean, interval: 0.9}
  waiting: {of: walk.output, take: time_mean, initial: 0}
  rate: {of: server.output, take: rate}
  settled: {of: walk.output, take: quantile, p: 0.9, after: mser5}
"""


def told(simulation: Simulation) -> tuple[Any, ...]:
    """All that a run comes to in the end."""
    results = simulation.run()
    signals = {name: (signal.tags, list(map(repr, signal.tokens))) for name, signal in results.signals.items()}
    return (
        results.digest, results.events, results.outcomes, results.aspects, signals, results.end, results.stopped,
        results.firings, [record.encoded() for record in simulation.log.records],
    )  # fmt: skip


def steps_of(model: Model, until: int = 1_000_000) -> int:
    simulation, steps = Simulation(model), 0
    while steps < until and simulation.step():
        steps += 1
    return steps


def assert_goes_on(model: Model, number: int, seed: int = 0, keep_log: bool = True) -> None:
    """Snapshots at so many random tags, and forks at some of them, go on as the run did."""
    expected = told(Simulation(model, keep_log=keep_log))
    steps = steps_of(model)
    places = sorted(random.Random(seed).sample(range(steps + 1), min(number, steps + 1)))
    simulation, snapshots, forks, done = Simulation(model, keep_log=keep_log), [], [], 0
    for place in places:
        while done < place:
            assert simulation.step()
            done += 1
        snapshots.append(simulation.snapshot())
        if len(forks) < 2:
            forks.append(simulation.fork())
        assert snapshots[-1].tag == simulation.tag
    assert told(simulation) == expected
    for snapshot in reversed(snapshots):
        simulation.restore(snapshot)
        assert simulation.tag == snapshot.tag
        assert told(simulation) == expected
    assert [told(fork) for fork in forks] == [expected] * len(forks)


# -- every model, every aspect ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", packaged_models())
def test_snapshots_of_packaged_models(name: str) -> None:
    short = ["observers=1", "disturbance=0.5"] if name == "collision_avoidance" else []
    model = load_model(name, set=short)
    model.stop = min(model.stop or 100.0, DURATIONS.get(name, 300.0))
    assert_goes_on(model, 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", packaged_models())
def test_a_hundred_snapshots_of_packaged_models(name: str) -> None:
    assert_goes_on(load_model(name), 100, keep_log=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", packaged_disturbances())
def test_snapshots_of_packaged_disturbances(name: str) -> None:
    assert_goes_on(load_model("collision_avoidance", disturb=name, set=["observers=2"]), 10)


@pytest.mark.parametrize("path", CONFORMANCE, ids=lambda path: path.stem)
def test_snapshots_of_conformance_models(path: Path) -> None:
    assert_goes_on(load_model(path, types=TYPES), 4)


@pytest.mark.parametrize("aspect", AT_WORK, ids=repr)
def test_snapshots_with_aspects(aspect: Aspect) -> None:
    model = load(GRID.format(2, 40))
    woven = at_home(aspect, "grid", "first[*]" if "actor" in aspect.stands_at else "first[*].*")
    assert woven is not None
    model.weave(woven.name, woven.aspect, at=woven.at)
    model.connect("second[*].output -> third.input", delay="3 ms") if model.add(Recorder("third")) else None
    assert_goes_on(model, 6)


@pytest.mark.parametrize("seed", range(3))
def test_snapshots_of_all_there_is(seed: int) -> None:
    model = load(FEATURES, set=[f"period={100 + seed} ms"])
    assert_goes_on(model, 12, seed)


# -- any number of simulations of one model ---------------------------------------------------------------------------


def parts_of(model: Model) -> dict[str, Any]:
    """What a model holds, down to the tokens in its ports; what cannot change by its identity."""
    found: dict[str, Any] = {}
    for path, actor in model.graph.actors.items():
        found |= {f"{path}.{name}": value for name, value in vars(actor).items() if name not in ("inputs", "outputs")}
        for name, port in {**actor.inputs, **actor.outputs}.items():
            slots = {each for base in type(port).__mro__ for each in getattr(base, "__slots__", ())}
            found |= {f"{path}.{name}.{each}": getattr(port, each) for each in slots}
    for woven in model.aspects:
        found |= {f"{woven.name}.{name}": value for name, value in vars(woven.aspect).items()}
        found |= {f"{woven.name}: {name}": value for name, value in vars(woven).items()}
    return {name: (id(value), repr(value)) for name, value in found.items()}


@pytest.mark.parametrize("name", ["bouncing_ball", "car_wash", "all there is"])
def test_a_run_does_not_touch_its_model(name: str) -> None:
    model = load(FEATURES) if name == "all there is" else load_model(name)
    model.check()
    before = parts_of(model)
    simulation = Simulation(model)
    simulation.run()
    assert parts_of(model) == before
    assert simulation.actors.keys() == model.graph.actors.keys()


@pytest.mark.parametrize("name", ["mm1", "machine_shop", "inspection_paradox", "all there is"])
def test_simulations_take_turns(name: str) -> None:
    model = load(FEATURES) if name == "all there is" else load_model(name)
    model.stop = min(model.stop or 500.0, 20_000.0 if name == "machine_shop" else 500.0)
    seeds = (1, 2, 1)
    alone = [told(Simulation(model, seed=seed, keep_log=True)) for seed in seeds]
    together = [Simulation(model, seed=seed, keep_log=True) for seed in seeds]
    going = list(together)
    while going:
        going = [simulation for simulation in going if simulation.step()]
    assert [told(simulation) for simulation in together] == alone
    assert alone[0] == alone[2] != alone[1]


def test_simulations_in_threads() -> None:
    model = load(FEATURES)
    alone = [told(Simulation(model, seed=seed, keep_log=True)) for seed in range(4)]
    found: dict[int, Any] = {}

    def work(seed: int) -> None:
        found[seed] = told(Simulation(model, seed=seed, keep_log=True))

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [found[seed] for seed in range(4)] == alone


def test_a_run_in_pieces() -> None:
    model = load("actors: {t: {type: Ticker}, probe: {type: Probe}}\nconnections: [t.output -> probe.input]\n")
    model.stop = 5
    expected = told(Simulation(model, keep_log=True))
    simulation = Simulation(model, keep_log=True)
    assert simulation.tag == (0, 0)
    assert [simulation.step(), simulation.advance(0.5), simulation.advance(2.5)] == [True, True, True]
    assert (simulation.tag.seconds, len(simulation["probe"].seen)) == (2.0, 3)  # type: ignore[attr-defined]
    assert simulation.advance(2.0)  # that is past
    assert simulation.results("looked at").events == 3
    assert not simulation.advance(5.0)
    assert not simulation.step()
    assert not simulation.advance(7.0)
    assert told(simulation) == expected
    over = "a Simulation runs once: make another one for another run"
    for again in (simulation.run, simulation.step, simulation.finish, lambda: simulation.advance(9)):
        with pytest.raises(RuntimeError) as caught:
            again()
        assert str(caught.value) == over


def test_a_run_that_is_ended_early() -> None:
    model = load("actors: {t: {type: Ticker}, probe: {type: Probe}}\nconnections: [t.output -> probe.input]\n")
    model.metric("ticks", of="t.output", take="time_mean")
    simulation = Simulation(model)
    simulation.advance(3.5)
    results = simulation.finish()
    assert (results.stopped, results.end, simulation["probe"].wrapped) == ("stop time", 3.0, 1)  # type: ignore[attr-defined]
    assert results.metrics == Simulation(model).run(until=3.5).metrics == {"ticks": pytest.approx(4.5 / 3.5)}
    simulation = Simulation(model)
    simulation.step()
    assert simulation.finish().stopped == "the program"


def test_what_stands_so_far_does_not_change_what_comes() -> None:
    model = load(FEATURES)
    simulation = Simulation(model, keep_log=True)
    while simulation.step():
        simulation.results("looked at")
    assert told(simulation) == told(Simulation(model, keep_log=True))


def test_a_step_that_fails_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def act(self: Plan) -> None:
        raise ValueError("no")

    monkeypatch.setattr(Plan, "act", act)
    model = load(
        "actors: {t: {type: Ticker}, plan: {type: Plan}, probe: {type: Probe}}\nconnections: [t.output -> plan.input]\n"
    )
    simulation = Simulation(model)
    with pytest.raises(ActorError, match=r"plan failed in fire\(\) at \(0 s, 1\): ValueError: no"):
        simulation.step()
    assert simulation["probe"].wrapped == 1  # type: ignore[attr-defined]
    with pytest.raises(RuntimeError):
        simulation.step()


# -- actors and aspects of one's own ----------------------------------------------------------------------------------


class Gatherer(Actor):
    """Keeps what comes in many ways."""

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
    reason = "lock, which cannot be copied (cannot pickle '_thread.lock' object): let its class say how, with "
    reason += "__deepcopy__, or name the attribute in copies_share for copies of the run to have it in common"
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
                yield self.environment.timeout(round(self.random.random() * 1e9))
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
        f"m has processes, so a run goes back to {snapshot.tag} by way of its beginning, but came to something else "
        "there: the model was changed, or something depends on more than model and seed"
    )
    simulation.run()  # it is where it was


# -- what is refused --------------------------------------------------------------------------------------------------


def test_what_cannot_be_kept() -> None:
    model = load("actors: {t: {type: Ticker, limit: 3}}")
    untold = "the run of m is told to log_to or to a tracer, which cannot be untold: leave them out"
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
    assert refused(lambda: simulation["tiker"], EpicycleError) == "tiker is no part of m, did you mean 'ticker'?"
    assert refused(lambda: simulation[Ticker("ticker")], EpicycleError) == "Ticker() is no part of m"
    assert refused(lambda: simulation[Echo()], EpicycleError) == "Echo() is no part of m"
