"""Random SimPy programs as data, and a function that plays a process of one: in plain SimPy, and as an actor."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
import simpy

Step = tuple[Any, ...]
END = 60.0625  # no event is at this time: all delays are eighths
TRACE: list[tuple[Any, ...]] = []  # what happens, of all processes


class Shared:
    """What the processes of a program share: made in the environment of the one that comes first."""

    def __init__(self) -> None:
        self.is_open = False

    def open(self, env: Any) -> None:
        if self.is_open:
            return
        self.is_open = True
        self.processes: dict[int, Any] = {}
        self.resource = simpy.Resource(env, capacity=2)
        self.priority = simpy.PriorityResource(env, capacity=1)
        self.preemptive = simpy.PreemptiveResource(env, capacity=1)
        self.container = simpy.Container(env, capacity=10, init=3)
        self.store = simpy.Store(env, capacity=3)
        self.filtered = simpy.FilterStore(env, capacity=4)


def steps(random: np.random.Generator, depth: int = 0) -> list[Step]:
    """What a process does."""
    found: list[Step] = []
    for _ in range(int(random.integers(3, 9))):
        kind = int(random.integers(0, 12 if depth < 2 else 11))
        wait, number = int(random.integers(0, 40)) / 8, int(random.integers(0, 5))
        found.append((kind, wait, number, steps(random, depth + 1) if kind == 11 else ()))
    return found


def program(seed: int) -> list[list[Step]]:
    """The processes of a random program."""
    random = np.random.default_rng(seed)
    return [steps(random) for _ in range(int(random.integers(2, 7)))]


def play(env: Any, shared: Shared, number: int, what: list[Step]) -> Generator[Any, Any, None]:
    """One process of a program; an interrupt ends the step in which it comes."""
    shared.open(env)
    shared.processes[number] = env.active_process
    for at, step in enumerate(what):
        try:
            yield from one(env, shared, number, step)
        except simpy.Interrupt as interrupt:
            cause = interrupt.cause
            TRACE.append((env.now, number, at, "interrupted", getattr(cause, "usage_since", cause)))
        else:
            TRACE.append((env.now, number, at, step[0], len(shared.resource.queue), shared.container.level))


def one(env: Any, shared: Shared, number: int, step: Step) -> Generator[Any, Any, None]:
    kind, wait, which, inner = step
    if kind == 0:
        yield env.timeout(wait)
    elif kind == 1:
        with shared.resource.request() as request:
            yield request
            yield env.timeout(wait)
    elif kind == 2:
        with shared.priority.request(priority=which) as request:
            yield request
            yield env.timeout(wait)
    elif kind == 3:
        with shared.preemptive.request(priority=which, preempt=which % 2 == 0) as request:
            yield request
            yield env.timeout(wait)
    elif kind == 4:
        yield shared.container.put(which + 1) | env.timeout(wait)
    elif kind == 5:
        yield shared.container.get(which + 1) | env.timeout(wait)
    elif kind == 6:
        yield shared.store.put((number, which))
        yield env.timeout(wait)
    elif kind == 7:
        got = yield shared.store.get() | env.timeout(wait)
        TRACE.append((env.now, number, "got", [value for value in got.values() if value is not None]))
    elif kind == 8:
        yield shared.filtered.put(which) & env.timeout(wait)
    elif kind == 9:
        yield shared.filtered.get(lambda item: item == which) | env.timeout(wait)
    elif kind == 10:
        other = shared.processes.get(which)
        if other is not None and other.is_alive and other is not env.active_process:
            other.interrupt(number)
        yield env.timeout(wait)
    else:
        child = env.process(play(env, shared, 10 * number + 10, inner))
        yield child | env.timeout(wait + 5)
