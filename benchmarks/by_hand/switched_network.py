"""Hosts at a switch that send calls and data, and a file that one of them sends by ARQ over a bad line."""

from __future__ import annotations

import random
from dataclasses import dataclass

import simpy

from .measures import mean

HOSTS, RATE, CALL, DATA, LOAD = 4, 1e6, 800.0, 12_000.0, 0.5
DELAY, LOSS, WINDOW, FILE, TIMEOUT = 0.005, 0.05, 16, 400, 0.4
BUFFER = 2e6  # bit


@dataclass
class Frame:
    """A frame, and what becomes of it."""

    is_data: bool
    to: int
    size: float
    came: float
    number: int = -1  # in the file


def run(seed: int, stop: float = 20.0) -> dict[str, float]:
    """The metrics of 20 s."""
    draw = random.Random(seed)
    env = simpy.Environment()
    ports = [simpy.PriorityStore(env) for _ in range(HOSTS + 1)]
    held = [0.0] * (HOSTS + 1)
    up = [simpy.Store(env) for _ in range(HOSTS)]
    line = simpy.Store(env)
    times: dict[bool, list[float]] = {False: [], True: []}
    acknowledged = [env.event() for _ in range(FILE)]
    received: set[int] = set()
    count = {"lost": 0, "repeated": 0, "file": 0}
    order = 0

    def host(index: int) -> simpy.events.ProcessGenerator:
        while True:
            yield env.timeout(draw.expovariate(RATE * LOAD / ((CALL + 0.6 * DATA) / 2)))
            is_data = draw.random() < 0.5
            size = DATA * draw.uniform(0.2, 1.0) if is_data else CALL
            up[index].put(Frame(is_data, draw.randrange(HOSTS), size, env.now))

    def uplink(index: int) -> simpy.events.ProcessGenerator:
        while True:
            frame = yield up[index].get()
            yield env.timeout(frame.size / RATE)
            env.process(switched(frame, 50e-6))

    def switched(frame: Frame, delay: float) -> simpy.events.ProcessGenerator:
        nonlocal order
        yield env.timeout(delay + 20e-6)
        if held[frame.to] + frame.size > BUFFER:
            count["lost"] += 1
            return
        held[frame.to] += frame.size
        order += 1
        ports[frame.to].put(simpy.PriorityItem((frame.is_data, order), frame))

    def port(index: int) -> simpy.events.ProcessGenerator:
        while True:
            frame = (yield ports[index].get()).item
            held[index] -= frame.size
            yield env.timeout(frame.size / RATE)
            if index < HOSTS:
                times[frame.is_data].append(env.now - frame.came)
            else:
                line.put(frame)

    def server() -> simpy.events.ProcessGenerator:
        while True:
            frame = yield line.get()
            yield env.timeout(frame.size / RATE)
            if draw.random() >= LOSS:
                env.process(arrival(frame.number))

    def arrival(number: int) -> simpy.events.ProcessGenerator:
        yield env.timeout(DELAY)
        received.add(number)
        while count["file"] in received:
            count["file"] += 1
        yield env.timeout(DELAY)
        if not acknowledged[number].triggered:
            acknowledged[number].succeed()

    def deliver(number: int) -> simpy.events.ProcessGenerator:
        while not acknowledged[number].triggered:
            env.process(switched(Frame(True, HOSTS, DATA, env.now, number), 0.0))
            yield acknowledged[number] | env.timeout(TIMEOUT)
            count["repeated"] += not acknowledged[number].triggered

    def sender() -> simpy.events.ProcessGenerator:
        yield env.timeout(1.0)
        for number in range(FILE):
            if number >= WINDOW:  # the window moves with its oldest frame
                yield acknowledged[number - WINDOW]
            env.process(deliver(number))

    for index in range(HOSTS):
        env.process(host(index))
        env.process(uplink(index))
    for index in range(HOSTS + 1):
        env.process(port(index))
    env.process(server())
    env.process(sender())
    env.run(stop)
    return {
        "calls": 1000 * mean(times[False]),
        "data": 1000 * mean(times[True]),
        "slow": 1000 * sorted(times[False])[int(0.99 * len(times[False]))],
        **count,
    }
