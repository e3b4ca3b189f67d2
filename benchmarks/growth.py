"""How the cost of a run grows: `python benchmarks/growth.py [--rounds 3]`.

- actors: a clock and a pipeline of 10 to 100,000 scales, through which as many tokens go that each model makes the same
  number of hops;
- robots: 1 to 64 observers in the collision avoidance scenario;
- memory: what a recorded number takes, once a million of them are recorded.
"""

from __future__ import annotations

import argparse
import gc
import tempfile
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from measure import Row, cpu_seconds, table, take_turns

from epicycle.runner import Simulation, load_model
from epicycle.runner.model import Model

ACTORS = (10, 100, 1_000, 10_000, 100_000)
HOPS = 200_000
ROBOTS = (1, 4, 16, 64)
NUMBERS = 1_000_000

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


def model(text: str, **values: object) -> Model:
    """The model that a text describes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(text.format(**values), encoding="utf-8")
        return load_model(path, max_actors=200_000)


def seconds_of(model: Model, until: float | None = None) -> float:
    """The CPU time of one run."""
    simulation = Simulation(model)
    return cpu_seconds(lambda: simulation.run(until=until))


def actors(rounds: int) -> Iterator[Row]:
    """Pipelines."""
    models = {size: model(PIPELINE, actors=size, stop=HOPS // size - 1) for size in ACTORS}
    took = take_turns({str(size): lambda each=each: seconds_of(each) for size, each in models.items()}, rounds)
    costs = {size: 1e6 * median(took[str(size)]) / HOPS for size in ACTORS}
    how = f"{rounds} rounds of {HOPS:,} hops each, taking turns; CPU time of the run alone"
    for size, cost in costs.items():
        if size == ACTORS[0]:
            continue
        ratio = median([mine / small for mine, small in zip(took[str(size)], took[str(ACTORS[0])], strict=True)])
        result = f"{ratio:.2f}x ({cost:.3g} us a hop)"
        yield Row(f"a hop in a pipeline of {size:,}", f"of {ACTORS[0]}", result, "<= 1.2x", ratio <= 1.2, how)


def robots(rounds: int) -> Iterator[Row]:
    """Robots in one scenario."""
    models = {
        number: load_model(
            "collision_avoidance", set={"observers": number, "observer_starts": starts(number)}, max_actors=200_000
        )
        for number in ROBOTS
    }
    took = take_turns({str(number): lambda each=each: seconds_of(each, 2.0) for number, each in models.items()}, rounds)
    how = f"{rounds} rounds of 2 s of model time, 21 steps of each robot, taking turns; CPU time of the run alone"
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


def rows(rounds: int = 3) -> Iterator[Row]:
    """The table's lines."""
    yield from actors(rounds)
    yield from robots(max(1, rounds // 2))
    yield memory()


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--rounds", type=int, default=3)
    print(table(rows(options.parse_args().rounds)))
