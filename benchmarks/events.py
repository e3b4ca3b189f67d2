"""The discrete-event core against SimPy, written by hand: `python -m benchmarks.events [--rounds 5]`.

Three pieces of work, each as a model of ours, as SimPy processes with a Store before each, and as bare callbacks on
SimPy's events:

- pipeline: a clock, ten delays and ten scales in turn; one token is on its way at a time;
- full pipeline: the same with the period of the clock equal to the delays, so that all actors are busy at each tick;
- queue: Poisson -> server -> sink, from the same random numbers on all sides.

Packaged models of queues, with all that they record and measure, are run by both cores in turns.

Ours omits nothing: it has firing order, event log and digest, which the SimPy programs lack.  It runs twice: unchanged,
and without native forms, as actors in plain Python run, including those of users.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Generator, Iterator
from dataclasses import astuple
from pathlib import Path
from typing import Any

import simpy

from benchmarks.measure import Row, compare, cpu_seconds, table, take_turns
from epicycle.actors import CORE, random_stream
from epicycle.runner import Simulation, load_model
from epicycle.runner.model.build.model import Model

HOPS = 200_000  # in each of five rounds
JOBS = 200_000
PAIRS = 10
DELAY = 0.01  # s
FULL, SPARSE = 0.01, 1.0  # periods of the clock, s
BUSY = 0.75  # mean service time, s; customers come every second

PIPELINE = """\
model: pipeline
actors:
  clock: {{type: Clock, period: {period} s, values: [1.0]}}
  delay: {{type: TimeDelay, count: {pairs}, delay: {delay} s}}
  scale: {{type: Scale, count: {pairs}, factor: 2}}
  sink: {{type: Recorder, capacity: 0}}
connections:
  - clock.output -> delay[0].input
  - delay[*].output -> scale[*].input
  - scale[..-2].output -> delay[1..].input
  - scale[-1].output -> sink.input
run: {{stop: {stop} s}}
"""
QUEUE = """\
model: queue
actors:
  source: {{type: PoissonClock, mean_interval: 1 s, fire_at_start: false}}
  server: {{type: Server, distribution: {{type: Exponential, mean: {busy}}}}}
  sink: {{type: Recorder, capacity: 0}}
connections:
  - source.output -> server.input
  - server.output -> sink.input
run: {{stop: {stop} s, seed: 1}}
"""

PLAIN = "ours, without native forms"
STORES = "SimPy, Stores"
# Models, and what is set in them; the last is a condition of the study waiting_time.
QUEUES = {"mm1": "", "mg1": "", "mm1 under the highest load of waiting_time": "load=0.9"}
GOALS = {"compiled": (20.0, 20.0, 10.0), "python": (1.2, 1.2, 1.2)}
OF_USERS = (5.5, 5.5, 2.0)  # without native forms, the library's actors are plain Python, like those of users
REASON = "docs/performance.md explains the parts of a hop and a job"

Events = Generator[simpy.Event, Any, None]


def model(text: str, **values: object) -> Model:
    """The model that a text describes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(text.format(pairs=PAIRS, delay=DELAY, busy=BUSY, **values), encoding="utf-8")
        return load_model(path)


class Ours:
    """A model of ours; ``done`` is how many tokens came to its sink."""

    def __init__(self, model: Model, forms: str = "on") -> None:
        self.model = model
        self.forms = forms
        self.done = 0

    def __call__(self) -> float:
        os.environ["EPICYCLE_FORMS"] = self.forms
        simulation = Simulation(self.model)
        seconds = cpu_seconds(simulation.run)
        self.done = simulation["sink"].seen  # type: ignore[attr-defined]
        return seconds


class Stores:
    """SimPy processes with a Store before each."""

    def __init__(self, build: Callable[[Stores], None], stop: float) -> None:
        self.build = build
        self.stop = stop
        self.done = 0
        self.environment = simpy.Environment()

    def __call__(self) -> float:
        self.environment, self.done = simpy.Environment(), 0
        self.build(self)
        return cpu_seconds(lambda: self.environment.run(self.stop + 1e-6))

    def start(self, process: Events) -> None:
        """Start a process."""
        self.environment.process(process)

    def sink(self, source: simpy.Store) -> Events:
        """Takes all tokens."""
        while True:
            yield source.get()
            self.done += 1


def pipeline_of_stores(period: float) -> Callable[[Stores], None]:
    """Builds the pipeline of processes."""

    def clock(simulation: Stores, to: simpy.Store) -> Events:
        while True:
            yield to.put(1.0)
            yield simulation.environment.timeout(period)

    def delay(simulation: Stores, source: simpy.Store, to: simpy.Store) -> Events:
        while True:
            token = yield source.get()
            yield simulation.environment.timeout(DELAY)
            yield to.put(token)

    def scale(simulation: Stores, source: simpy.Store, to: simpy.Store) -> Events:
        while True:
            token = yield source.get()
            yield to.put(2 * token)

    def build(simulation: Stores) -> None:
        stores = [simpy.Store(simulation.environment) for _ in range(2 * PAIRS + 1)]
        simulation.start(clock(simulation, stores[0]))
        for number in range(2 * PAIRS):
            actor = scale if number % 2 else delay
            simulation.start(actor(simulation, stores[number], stores[number + 1]))
        simulation.start(simulation.sink(stores[-1]))

    return build


def queue_of_stores(simulation: Stores) -> None:
    """Builds the queue of processes."""
    environment = simulation.environment
    between, service = random_stream(1, "source"), random_stream(1, "server")
    waiting, served = simpy.Store(environment), simpy.Store(environment)

    def source() -> Events:
        number = 0
        while True:
            yield environment.timeout(between.exponential(1.0))
            yield waiting.put(number)
            number += 1

    def server() -> Events:
        while True:
            job = yield waiting.get()
            yield environment.timeout(service.exponential(BUSY))
            yield served.put(job)

    simulation.start(source())
    simulation.start(server())
    simulation.start(simulation.sink(served))


class Callbacks(Stores):
    """Functions that call each other, or let SimPy call them later."""

    def after(self, delay: float, call: Callable[[simpy.Event], None], value: Any = None) -> None:
        """Let SimPy call a function."""
        callbacks = self.environment.timeout(delay, value).callbacks
        assert callbacks is not None
        callbacks.append(call)

    def count(self, token: Any) -> None:
        """Take a token."""
        self.done += 1


def pipeline_of_callbacks(period: float) -> Callable[[Stores], None]:
    """Builds the pipeline of functions."""

    def delay(simulation: Callbacks, onward: Callable[[Any], None]) -> Callable[[Any], None]:
        return lambda token: simulation.after(DELAY, lambda event: onward(event.value), token)

    def scale(onward: Callable[[Any], None]) -> Callable[[Any], None]:
        return lambda token: onward(2 * token)

    def build(simulation: Stores) -> None:
        assert isinstance(simulation, Callbacks)
        onward: Callable[[Any], None] = simulation.count
        for _ in range(PAIRS):
            onward = delay(simulation, scale(onward))

        def tick(_: object) -> None:
            onward(1.0)
            simulation.after(period, tick)

        tick(None)

    return build


def queue_of_callbacks(simulation: Stores) -> None:
    """Builds the queue of functions."""
    assert isinstance(simulation, Callbacks)
    between, service = random_stream(1, "source"), random_stream(1, "server")
    waiting: deque[int] = deque()
    busy = False
    number = 0

    def come(_: object) -> None:
        nonlocal number
        waiting.append(number)
        number += 1
        serve()
        simulation.after(between.exponential(1.0), come)

    def serve() -> None:
        nonlocal busy
        if waiting and not busy:
            busy = True
            simulation.after(service.exponential(BUSY), leave, waiting.popleft())

    def leave(event: simpy.Event) -> None:
        nonlocal busy
        busy = False
        simulation.count(event.value)
        serve()

    simulation.after(between.exponential(1.0), come)


def seconds_of(name: str, setting: str) -> float:
    """The CPU time of a run of a packaged model; the first one warms up."""
    made = load_model(name, set=[setting] if setting else [])
    return [cpu_seconds(Simulation(made).run) for _ in range(3)][-1]


def by_core(core: str, name: str, setting: str) -> Callable[[], float]:
    """The same in a process with one of the cores."""
    words = [sys.executable, "-m", "benchmarks.events", "--model", name, "--set", setting]

    def run() -> float:
        environment = {**os.environ, "EPICYCLE_CORE": core, "EPICYCLE_FORMS": "on"}
        return float(subprocess.run(words, env=environment, capture_output=True, text=True, check=True).stdout)

    return run


def queues(rounds: int) -> Iterator[Row]:
    """Packaged models of queues, by both cores."""
    for work, setting in QUEUES.items():
        ours, peer = "compiled core", "Python core of the same sources"
        cores = {name: by_core(core, work.split()[0], setting) for name, core in ((ours, "compiled"), (peer, "python"))}
        how = f"{rounds} runs by each core, in processes that take turns; CPU time of the run alone, metrics included"
        results = take_turns(cores, rounds)
        yield compare(f"{work}: a run as packaged", results, peer, ours, how=how, goal=8.0, unit=(1e-3, "ms"))


def without_compiler(rounds: int) -> Iterator[Row]:
    """Against SimPy, where the core is Python."""
    words = [sys.executable, "-m", "benchmarks.events", "--rounds", str(rounds), "--against-stores"]
    environment = {**os.environ, "EPICYCLE_CORE": "python"}
    done = subprocess.run(words, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    yield from (Row(*each) for each in json.loads(done.stdout))


def rows(rounds: int = 5) -> Iterator[Row]:
    """The table's lines."""
    yield from comparisons(rounds)
    if CORE == "compiled":
        yield from without_compiler(rounds)
        yield from queues(rounds)


def comparisons(rounds: int) -> Iterator[Row]:
    """Against SimPy."""
    length = 2 * PAIRS
    ticks = HOPS // length
    work = [
        ("pipeline of 20 actors, one token at a time", SPARSE, HOPS),
        ("pipeline of 20 actors, all busy", FULL, HOPS),
        ("Poisson -> server -> sink", 0.0, JOBS),
    ]
    for (name, period, size), goal, of_users in zip(work, GOALS[CORE], OF_USERS, strict=True):
        if period:
            stop = period * ticks
            build, build_bare = pipeline_of_stores(period), pipeline_of_callbacks(period)
            made = model(PIPELINE, period=period, stop=stop)
        else:
            stop = float(size)
            build, build_bare = queue_of_stores, queue_of_callbacks
            made = model(QUEUE, stop=stop)
        ours, plain = Ours(made), Ours(made, "off")
        stores, bare = Stores(build, stop), Callbacks(build_bare, stop)
        contenders = {"ours": ours, PLAIN: plain, STORES: stores, "SimPy, bare callbacks": bare}
        results = take_turns(contenders, rounds)
        # Rounding to nanoseconds may move a job over the end.
        assert ours.done > 0.9 * size / (length if period else 1)
        assert max(ours.done, stores.done, bare.done) - min(ours.done, stores.done, bare.done) <= 1
        what = "token hops" if period else "jobs"
        how = f"{rounds} rounds of {size:,} {what} in one process, taking turns; CPU time of the run alone"
        unit = size * 1e-6, f"us a {what.rsplit(maxsplit=1)[-1].rstrip('s')}"
        title = f"{name}: {rounds * size:,} {what}" + ("" if CORE == "compiled" else ", without a compiler")
        yield compare(title, results, STORES, "ours", how=how, reason=REASON, goal=goal, unit=unit)
        yield compare(title, results, "SimPy, bare callbacks", "ours", how=how, unit=unit)
        if CORE == "compiled":
            title = f"{name}, without native forms, as actors of users in plain Python run"
            yield compare(title, results, STORES, PLAIN, how=how, reason=REASON, goal=of_users, unit=unit)


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--model", help="only print how long a run of a packaged model takes (s)")
    options.add_argument("--set", default="", help="a setting for this model")
    options.add_argument("--against-stores", action="store_true", help="only compare this core with SimPy's Stores")
    given = options.parse_args()
    if given.against_stores:
        print(json.dumps([astuple(each) for each in comparisons(given.rounds) if each.peer == STORES]))
    else:
        print(seconds_of(given.model, given.set) if given.model else table(rows(given.rounds)))
