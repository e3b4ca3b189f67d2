"""Throws problems at the solver that no scenario poses, as ``make robust`` does.

    python -m tests.actors.robotics.numerics.robustness [--count N] [--gap G]

Starts inside an obstacle or a peer, at no distance at all, tubes that contradict each other or the obstacle,
covariances over twenty orders of magnitude, up to 64 peers, vehicles that are too fast, and numbers from upstream
that are none.  Checked is what must hold whatever is asked: an answer without an exception, finite controls within
f2, speeds within f1 unless the vehicle is too fast already, no violation that is not a number; and that the worst
takes at most 20 times as many Newton steps, and as long, as the median at the gap that the bound was made for, 1e-5.
"""

from __future__ import annotations

import argparse
import gc
import heapq
import importlib
import time
from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

PREFIX = "epicycle.actors.robotics.numerics."
barrier = importlib.import_module(PREFIX + "barrier")
horizon = importlib.import_module(PREFIX + "horizon")
information = importlib.import_module(PREFIX + "mutual_information")
reachability = importlib.import_module(PREFIX + "reachability")

STEPS = 10
PERIOD = 0.1
LIMIT = 8.0  # Vmax in m/s and Amax in m/s^2
KINDS = ("plain", "inside", "at zero", "contradictory", "huge", "crowd", "fast", "not a number")

RULES = barrier.Rules()
BOUND = 20.0  # times the median
SLOWEST, OTHERS, ROUNDS = 200, 1000, 15  # how many problems are timed again, and how often

Posed = tuple[str, Any, np.ndarray]


class Answer(NamedTuple):
    """What came of a problem."""

    posed: Posed
    wrong: str
    steps: int  # of Newton's
    seconds: float


def pose(random: np.random.Generator) -> Posed:
    """A kind of trouble, a problem of that kind, and starts."""
    kind = KINDS[int(random.integers(len(KINDS)))]
    scale = 10.0 ** random.uniform(-1.0, 1.5)
    position, speed = random.normal(scale=scale, size=2), random.uniform(0.0, 0.999 * LIMIT)
    if kind == "fast":
        speed = LIMIT * 10.0 ** random.uniform(-0.05, 3.0)
    angle = random.uniform(0.0, 2.0 * np.pi)
    velocity = speed * np.array([np.cos(angle), np.sin(angle)])
    coasting = position + PERIOD * np.arange(STEPS)[:, np.newaxis] * velocity
    peers = 64 if kind == "crowd" else int(random.integers(0, 5))
    peer_start = random.normal(scale=scale, size=(peers, 1, 2))
    peer_mean = peer_start + 0.1 * np.arange(STEPS)[:, np.newaxis] * random.normal(scale=4.0, size=(peers, 1, 2))
    state = random.normal(scale=scale, size=4)
    root = random.normal(size=(4, 4)) * 10.0 ** random.uniform(-2.0, 1.0)
    if kind == "huge":
        root *= 10.0 ** random.uniform(-10.0, 10.0, size=4)[:, np.newaxis]
    tube_centre = coasting + random.normal(scale=0.3, size=(1, 2))
    tube_radius = 0.2 + 0.4 * np.arange(1.0, STEPS + 1)
    if random.random() < 0.3:
        tube_radius[int(random.integers(STEPS)) :] = np.inf
    if kind == "inside":
        state[:2] = position + random.normal(scale=0.5, size=2)
        peer_mean -= peer_mean[:, :1] - position
    if kind == "at zero":
        state[:2], state[2:] = position, velocity
        peer_mean[:] = coasting
        root[:] = 0.0 if random.random() < 0.5 else root
    if kind == "contradictory":
        tube_centre = coasting + random.normal(scale=20.0, size=(STEPS, 2))
        tube_radius = 10.0 ** random.uniform(-6.0, 1.0, size=STEPS)
        state[:2] = tube_centre[5]
    transition = np.eye(4)
    transition[0, 2] = transition[1, 3] = PERIOD
    means, covariances = reachability.propagate(state, root @ root.T, transition, np.zeros((4, 4)), STEPS, 2)
    points = means[-1] + random.normal(scale=10.0 ** random.uniform(-3.0, 2.0), size=(9, 2))
    known = random.random() < 0.9
    problem = horizon.HorizonProblem(
        period=PERIOD,
        position=position,
        velocity=velocity,
        max_speed=LIMIT,
        max_acceleration=LIMIT,
        tube_centre=tube_centre,
        tube_radius=tube_radius,
        safe_distance=2.0,
        margin=float(random.choice([0.0, 2.0])),
        obstacle_mean=means[np.newaxis][:known].copy(),
        obstacle_covariance=covariances[np.newaxis][:known].copy(),
        peer_mean=peer_mean,
        peer_distance=2.0
        + 2.0 * (tube_radius[:1] + 0.4 * random.integers(0, 20, size=(peers, 1)) + np.zeros((peers, STEPS))),
        objective=horizon.INFORM if random.random() < 0.5 else horizon.REACH_GOAL,
        goal=random.normal(scale=scale, size=(1, 2)),
        sigma_positions=points,
        sigma_weights=np.append(0.0, np.full(8, 0.125)),
        others_distance=information.pairwise_distance(points, peer_mean, 2.0),
        measurement_variance=2.0,
        range_penalty=float(random.choice([0.0, 1e-3, 1.0])),
        measurement_range=float(random.choice([0.0, 5.0, 30.0])),
    )
    if kind == "not a number":
        problem = spoilt(problem, random)
    starts = np.clip(random.normal(scale=4.0, size=(2, STEPS, 2)), -5.6, 5.6) * random.choice([0.0, 1e-6, 1.0])
    return kind, problem, starts


def spoilt(problem: Any, random: np.random.Generator) -> Any:
    """The problem with one number that is none, or infinite."""
    fields = [name for name in problem._fields if name not in ("objective", "period", "max_speed", "max_acceleration")]
    filled = [name for name in fields if np.size(getattr(problem, name))]
    name, bad = str(random.choice(filled)), float(random.choice([np.nan, np.inf, -np.inf]))
    value = np.array(getattr(problem, name), dtype=float)
    value.flat[int(random.integers(value.size))] = bad
    return problem._replace(**{name: value if value.ndim else float(value)})


def wrong(problem: Any, solution: Any) -> str:
    """What must hold and does not."""
    controls = solution.controls
    if not np.isfinite(controls).all():
        return "controls are not finite"
    if np.hypot(*controls.T).max() > LIMIT * (1 + 1e-9):
        return "f2 is broken"
    if np.isnan(solution.violation):
        return "the violation is not a number"
    speeds = problem.velocity + PERIOD * np.cumsum(controls, axis=0)[:-1]
    if np.hypot(*problem.velocity) < LIMIT and np.hypot(*speeds.T).max() > LIMIT * (1 + 1e-9):
        return "f1 is broken"
    return ""


def timed(posed: Posed, rules: Any) -> tuple[float, Any]:
    """Seconds of CPU time, and the solution."""
    _, problem, starts = posed
    before = time.process_time()
    solution = barrier.solve(problem, starts, rules)
    return time.process_time() - before, solution


def run(count: int, seed: int, rules: Any = RULES) -> Iterator[Answer]:
    """The answers to so many problems."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        posed = pose(random)
        took, solution = timed(posed, rules)
        yield Answer(posed, wrong(posed[1], solution), solution.iterations, took)


def worst_over_median(slow: list[Posed], others: list[Posed], rules: Any) -> float:
    """In time; they take turns, and the least of each counts, as the pace of a machine changes by the second."""
    asked = [*((posed, rules) for posed in slow), *((posed, RULES) for posed in others)]
    times = [[timed(*each)[0] for each in asked] for _ in range(ROUNDS)]
    least = np.min(times, axis=0)
    return float(least[: len(slow)].max() / np.median(least[len(slow) :]))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--count", type=int, default=100_000)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--gap", type=float, default=RULES.gap)
    given = options.parse_args()
    rules = barrier.Rules(given.gap)
    usual = float(np.median([each.steps for each in run(OTHERS, 0)]))  # and compiles
    gc.disable()  # or the worst would be the one during which Python collects
    numbers: dict[str, list[tuple[int, float]]] = {kind: [] for kind in KINDS}
    troubles: Counter[tuple[str, str]] = Counter()
    slow: list[tuple[float, int, Posed]] = []
    others: list[Posed] = []
    for number, answer in enumerate(run(given.count, given.seed, rules)):
        kind = answer.posed[0]
        numbers[kind].append((answer.steps, answer.seconds))
        if answer.wrong:
            troubles[kind, answer.wrong] += 1
        if number % max(1, given.count // OTHERS) == 0:
            others.append(answer.posed)
        heapq.heappush(slow, (answer.seconds, number, answer.posed))
        if len(slow) > SLOWEST:
            heapq.heappop(slow)
    for kind, found in numbers.items():
        steps, times = np.array(found).T
        print(
            f"{kind:14} {len(steps):6} problems, median, worst: Newton steps {np.median(steps):4.0f}, "
            f"{steps.max():4.0f}; time {1e6 * np.median(times):5.0f} us, {1e6 * times.max():6.0f} us"
        )
    steps = np.array([each[0] for found in numbers.values() for each in found])
    over = steps.max() / usual, worst_over_median([posed for _, _, posed in slow], others, rules)
    print(f"all: worst over median {over[0]:.1f} in steps, {over[1]:.1f} in time (goal: {BOUND:.0f})")
    print("\n".join(f"WRONG: {kind}: {trouble} ({n})" for (kind, trouble), n in troubles.items()) or "nothing is wrong")
    raise SystemExit(bool(troubles or max(over) > BOUND))


if __name__ == "__main__":
    main()
