"""A fleet of drones that share chargers and get waypoints over a lossy radio, by ARQ; each battery in closed form."""

from __future__ import annotations

import math
import random

import simpy

from .measures import mean

DRONES, CHARGERS, PERIOD, TIMEOUT, WINDOW, DEADLINE = 6, 2, 1.0, 0.25, 4, 0.5
LATENCY, JITTER, LOSS, BURST = 0.04, 0.02, 0.1, 4.0


class Radio:
    """A channel that loses messages in bursts, delays the others, and keeps their order."""

    def __init__(self, env: simpy.Environment, draw: random.Random) -> None:
        self.env, self.draw, self.is_bad, self.last = env, draw, False, 0.0

    def delay(self) -> float | None:
        """How long a message takes that is sent now; None if it is lost."""
        turn = 1 / BURST if self.is_bad else LOSS / (1 - LOSS) / BURST
        if self.draw.random() < turn:
            self.is_bad = not self.is_bad
        if self.is_bad:
            return None
        self.last = max(self.last, self.env.now + LATENCY + self.draw.expovariate(1 / JITTER))
        return self.last - self.env.now


class Uplink:
    """The way of waypoints from the base to one drone."""

    def __init__(self, env: simpy.Environment, draw: random.Random) -> None:
        self.env, self.frames, self.acks = env, Radio(env, draw), Radio(env, draw)
        self.planned: list[float] = []  # when each was
        self.acknowledged: list[simpy.Event] = []
        self.received: set[int] = set()
        self.ages: list[float] = []
        self.oldest = 0  # that is not acknowledged

    def plan(self, offset: float) -> simpy.events.ProcessGenerator:
        """Plan a waypoint in each period."""
        yield self.env.timeout(offset)
        while True:
            self.planned.append(self.env.now)
            self.acknowledged.append(self.env.event())
            self.env.process(self.deliver(len(self.planned) - 1))
            yield self.env.timeout(PERIOD)

    def deliver(self, number: int) -> simpy.events.ProcessGenerator:
        """Send a waypoint until it is acknowledged; the window moves with its oldest frame."""
        while number - self.oldest >= WINDOW:
            yield self.acknowledged[self.oldest]
            self.move()
        while not self.acknowledged[number].triggered:
            self.env.process(self.transmit(number))
            yield self.acknowledged[number] | self.env.timeout(TIMEOUT)

    def move(self) -> None:
        """Move the window beyond what is acknowledged."""
        while self.oldest < len(self.planned) and self.acknowledged[self.oldest].triggered:
            self.oldest += 1

    def transmit(self, number: int) -> simpy.events.ProcessGenerator:
        """One try: the frame, and its acknowledgement."""
        delay = self.frames.delay()
        if delay is None:
            return
        yield self.env.timeout(delay)
        self.received.add(number)
        while len(self.ages) in self.received:
            self.ages.append(self.env.now - self.planned[len(self.ages)])
        delay = self.acks.delay()
        if delay is not None:
            yield self.env.timeout(delay)
            if not self.acknowledged[number].triggered:
                self.acknowledged[number].succeed()
                self.move()


def run(seed: int, stop: float = 3600.0) -> dict[str, float]:
    """The metrics of an hour."""
    draw = random.Random(seed)
    env = simpy.Environment()
    chargers = simpy.Resource(env, CHARGERS)
    uplinks = [Uplink(env, draw) for _ in range(DRONES)]
    times = {"flying": 0.0, "returning": 0.0, "waiting": 0.0, "charging": 0.0}

    def drone() -> simpy.events.ProcessGenerator:
        charge = 1.0
        while True:
            since, mode = env.now, "flying"
            try:
                yield env.timeout((charge - 0.25) * 1200)
                times[mode] += env.now - since
                since, mode = env.now, "returning"
                yield env.timeout(40)
                times[mode] += env.now - since
                with chargers.request() as plug:
                    since, mode = env.now, "waiting"
                    yield plug
                    times[mode] += env.now - since
                    charge = 0.25 - 40 / 1000 - (env.now - since) / 20000
                    since, mode = env.now, "charging"
                    yield env.timeout(300 * math.log((1 - charge) / (1 - 0.95)))
                    times[mode] += env.now - since
                charge = 0.95
            except simpy.Interrupt:  # the end
                times[mode] += env.now - since
                return

    fleet = [env.process(drone()) for _ in range(DRONES)]
    for index, uplink in enumerate(uplinks):
        env.process(uplink.plan(PERIOD * index / DRONES))
    env.run(stop)
    for each in fleet:
        each.interrupt()
    env.run(stop + 1e-9)
    ages = [age for uplink in uplinks for age in uplink.ages]
    return {
        "planned": sum(len(uplink.planned) for uplink in uplinks),
        "delivered": len(ages),
        "in_time": sum(age <= DEADLINE for age in ages),
        "latency": 1000 * mean(ages),
        "latency_99": 1000 * sorted(ages)[int(0.99 * len(ages))],
        **{mode: 100 * times[mode] / stop / DRONES for mode in ("flying", "waiting")},
    }
