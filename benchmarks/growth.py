"""How the cost of a run grows: `python -m benchmarks.growth [--rounds 3]`.

- actors: a clock and a pipeline of 10 to 100,000 scales, with as many tokens as give each model the same number of
  hops; the same with SimPy processes and Stores, whose cost also grows with the working set;
- robots: 1 to 64 observers in the collision avoidance scenario;
- memory: what a recorded number takes, once a million of them are recorded, and an actor of a pipeline.
"""

from __future__ import annotations

import argparse
import gc
import subprocess
import sys
import tempfile
import tracemalloc
from collections.abc import Generator, Iterator
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import simpy

from benchmarks.measure import Row, cpu_seconds, table, take_turns
from epicycle.runner import Simulation, load_model
from epicycle.runner.model.build.model import Model

ROOT = Path(__file__).parents[1]
ACTORS = (10, 100, 1_000, 10_000, 100_000)
HOPS = 200_000
ROBOTS = (1, 4, 16, 64)
NUMBERS = 1_000_000
WEIGHED = 3_000  # actors of the pipeline whose memory is measured

PIPELINE = """\
model: pipeline
actors:
  clock: {{type: Clock, period: 1 s, values: [1.0]}}
  scale: {{type: Scale, count: {actors}, offset: 1}}
connections:
  - clock.output -> scale[0].input
  - scale[..-2].output -> scale[1..].input
run: {{stop: {stop} s}}
"""
RECORDED = """\
model: recorded
actors: {{clock: {{type: Clock, period: 1 ms, values: [0.1, 0.2, 0.3]}}}}
run: {{stop: {stop} ms, record: [clock.output]}}
"""

CACHES = (
    "a hop takes the same instructions in every pipeline, but in large ones the next actor, whose size the table has, "
    "is not in the processor's caches"
)

Events = Generator[simpy.Event, Any, None]


def model(text: str, **values: object) -> Model:
    """The model that a text describes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(text.format(**values), encoding="utf-8")
        return load_model(path, max_actors=200_000)


def seconds_of(model: Model, until: float) -> float:
    """The CPU time of a run's tags after the first, which touches everything for the first time."""
    simulation = Simulation(model)
    simulation.step()
    return cpu_seconds(lambda: simulation.advance(until))


def seconds_of_processes(size: int) -> float:
    """The CPU time of a pipeline of SimPy's processes, with a Store before each."""
    environment = simpy.Environment()
    stores = [simpy.Store(environment) for _ in range(size)]

    def clock() -> Events:
        for _ in range(HOPS // size):
            yield stores[0].put(1.0)
            yield environment.timeout(1.0)

    def scale(source: simpy.Store, to: simpy.Store | None) -> Events:
        while True:
            token = yield source.get()
            if to is not None:
                yield to.put(token + 1.0)

    environment.process(clock())
    for source, to in zip(stores, [*stores[1:], None], strict=True):
        environment.process(scale(source, to))
    environment.run(0.5)  # every process has started to wait
    return cpu_seconds(environment.run)


def seconds_of_ours(size: int) -> float:
    """The CPU time of a pipeline of ours."""
    stop = HOPS // size
    pipeline = model(PIPELINE, actors=size, stop=stop)
    seconds_of(pipeline, stop)
    return seconds_of(pipeline, stop)


CONTENDERS = {"ours": seconds_of_ours, "SimPy": seconds_of_processes}


def alone(contender: str, size: int) -> float:
    """The time of a contender in a new process; in a used one, a model is scattered over memory that others left."""
    command = [sys.executable, "-m", "benchmarks.growth", "--contender", contender, "--size", str(size)]
    return float(subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout)


def actors(rounds: int) -> Iterator[Row]:
    """Pipelines, and the cost of their working set without our code."""
    how = (
        f"{rounds} rounds of {HOPS:,} hops each, taking turns, each in a new process; CPU time of the "
        "tags after the first, without the end of the run, after another run"
    )
    for contender, work, limit in (
        ("ours", "a hop in a pipeline", 1.5),
        ("SimPy", "for comparison: a hop of SimPy's with Stores", None),
    ):
        found = {str(size): partial(alone, contender, size) for size in ACTORS}
        yield from _grown(work, take_turns(found, rounds), limit, how)


def _grown(work: str, took: dict[str, list[float]], limit: float | None, how: str) -> Iterator[Row]:
    """The time of a hop in pipelines of all sizes, against the smallest."""
    first = took[str(ACTORS[0])]
    for size in ACTORS[1:]:
        mine = took[str(size)]
        ratio = median([each / small for each, small in zip(mine, first, strict=True)])
        result = f"{ratio:.2f}x ({1e6 * median(mine) / HOPS:.3g} us against {1e6 * median(first) / HOPS:.3g})"
        goal, is_met = ("", None) if limit is None else (f"<= {limit:g}x", ratio <= limit)
        yield Row(f"{work}, {size:,} actors", f"{ACTORS[0]} actors", result, goal, is_met, how, CACHES)


def robots(rounds: int) -> Iterator[Row]:
    """Robots in one scenario."""
    models = {
        number: load_model(
            "collision_avoidance", set={"observers": number, "observer_starts": starts(number)}, max_actors=200_000
        )
        for number in ROBOTS
    }
    took = take_turns({str(number): lambda each=each: seconds_of(each, 2.0) for number, each in models.items()}, rounds)
    how = f"{rounds} rounds of 2 s of model time, 21 steps of each robot, taking turns; CPU time after the first tag"
    costs = {number: median(took[str(number)]) / (21 * (number + 1)) for number in ROBOTS}
    first = ROBOTS[0]
    for number in ROBOTS[1:]:
        ratio = costs[number] / costs[first]
        peers = number / first
        result = f"{ratio:.3g}x ({1000 * costs[number]:.3g} ms a step, {peers:g}x the peers)"
        yield Row(
            f"a step of one of {number + 1} robots", f"of {first + 1}", result, f"<= {peers:g}x", ratio <= peers, how
        )


def starts(number: int) -> list[list[float]]:
    """Places for so many observers, 4 m apart in rows of eight."""
    return [[20.0 + 4.0 * (each // 8), 4.0 * (each % 8) - 14.0] for each in range(number)]


def memory() -> Row:
    """What recording takes."""
    simulation = Simulation(model(RECORDED, stop=NUMBERS - 1))
    gc.collect()
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    results = simulation.run()
    gc.collect()
    taken = (tracemalloc.get_traced_memory()[0] - before) / len(results["clock.output"])
    tracemalloc.stop()
    how = f"tracemalloc before and after a run that records {NUMBERS:,} numbers, tags included"
    return Row("memory for a recorded number", "", f"{taken:.3g} bytes", "<= 32 bytes", taken <= 32, how)


def size_of_an_actor() -> Iterator[Row]:
    """What an actor of a pipeline takes in the model, and in each run."""
    gc.collect()
    tracemalloc.start()
    sizes = [tracemalloc.get_traced_memory()[0]]
    pipeline = model(PIPELINE, actors=WEIGHED, stop=3)
    gc.collect()
    sizes.append(tracemalloc.get_traced_memory()[0])
    simulation = Simulation(pipeline)
    simulation.run()
    gc.collect()
    sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    how = f"tracemalloc before and after, {WEIGHED:,} actors; in the model with its wiring and its place in the file"
    taken = (sizes[1] - sizes[0]) / WEIGHED
    yield Row("memory for an actor of a pipeline, in the model", "", f"{taken:,.0f} bytes", "", None, how)
    taken = (sizes[2] - sizes[1]) / WEIGHED
    work = "memory for an actor of a pipeline, in a run"
    yield Row(work, "", f"{taken:,.0f} bytes", "<= 2,200 bytes", taken <= 2_200, how)


def rows(rounds: int = 3) -> Iterator[Row]:
    """The table's lines."""
    yield from actors(rounds)
    yield from robots(rounds)
    yield memory()
    yield from size_of_an_actor()


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--rounds", type=int, default=3)
    options.add_argument("--contender", choices=CONTENDERS, help=argparse.SUPPRESS)
    options.add_argument("--size", type=int, help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.contender:
        print(CONTENDERS[given.contender](given.size))
    else:
        print(table(rows(given.rounds)))
