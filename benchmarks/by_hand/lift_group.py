"""A group of four lifts: each goes on in its direction as long as somebody ahead wants it, then it turns round."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

import simpy

from .measures import mean

LIFTS, FLOORS, PLACES, PACE, DOORS, STEP = 4, 12, 8, 2.0, 6.0, 1.0


@dataclass
class Passenger:
    """Somebody who wants to go from a floor to another."""

    came: float
    origin: int
    to: int


@dataclass
class Lift:
    """A lift, with those who wait for it and those in it."""

    awake: simpy.Event
    at: int = 0
    way: int = 1
    calls: list[Passenger] = field(default_factory=list)
    aboard: list[Passenger] = field(default_factory=list)
    idle: float = 0.0

    def turn(self) -> None:
        """Choose the direction: that of the first goal ahead, of who waits here, or of any other goal."""
        goals = [person.origin for person in self.calls] + [person.to for person in self.aboard]
        ahead = [goal - self.at for goal in goals if (goal - self.at) * self.way > 0]
        here = [person.to - self.at for person in self.calls if person.origin == self.at]
        others = [goal - self.at for goal in goals if goal != self.at]
        self.way = 1 if [*ahead, *here, *others, self.way][0] > 0 else -1


def run(seed: int, stop: float = 2 * 3600.0) -> dict[str, float]:
    """The metrics of two hours."""
    draw = random.Random(seed)
    env = simpy.Environment()
    lifts = [Lift(env.event()) for _ in range(LIFTS)]
    waits: list[float] = []
    stays: list[float] = []

    def people() -> simpy.events.ProcessGenerator:
        while True:
            yield env.timeout(draw.expovariate(1 / 8.0))
            if draw.random() < 0.8:
                origin, to = 0, 1 + int(draw.random() * (FLOORS - 1))
            else:
                origin = 1 + int(draw.random() * (FLOORS - 1))
                to = (origin + 1 + int(draw.random() * (FLOORS - 1))) % FLOORS
            lift = min(lifts, key=lambda each: len(each.calls) + len(each.aboard))
            lift.calls.append(Passenger(env.now, origin, to))
            if not lift.awake.triggered:
                lift.awake.succeed()

    def drive(lift: Lift) -> simpy.events.ProcessGenerator:
        while True:
            if not lift.calls and not lift.aboard:
                since, lift.awake = env.now, env.event()
                yield lift.awake
                lift.idle += env.now - since
            lift.turn()
            off = [person for person in lift.aboard if person.to == lift.at]
            room = PLACES - len(lift.aboard) + len(off)
            on = [each for each in lift.calls if each.origin == lift.at and (each.to - lift.at) * lift.way > 0][:room]
            if on or off:
                waits.extend(env.now - person.came for person in on)
                stays.extend(env.now - person.came for person in off)
                lift.calls = [person for person in lift.calls if person not in on]
                lift.aboard = [person for person in lift.aboard if person not in off] + on
                yield env.timeout(DOORS + STEP * len(on + off))
            else:
                yield env.timeout(PACE)
                lift.at += lift.way

    env.process(people())
    for lift in lifts:
        env.process(drive(lift))
    env.run(stop)
    return {
        "passengers": len(stays),
        "wait": mean(waits),
        "longest_wait": max(waits) / 60,
        "stay": mean(stays),
        "idle": 100 * sum(lift.idle for lift in lifts) / stop / LIFTS,
    }
