"""Reactive and process actors are equivalent: models that exchange them send the same, tag by tag."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, ClassVar

import numpy as np
import pytest
import simpy

from epicycle.actors import Actor, InputPort, OutputPort, Parameter, Process
from tests.engine.engine_parts import seen, sends, simulate


class Tick(Process):
    """The twin of Ticker."""

    output = OutputPort(int)
    period = Parameter(float, 1.0, unit="s")

    def run(self) -> Generator[Any, Any, None]:
        count = 0
        while True:
            self.output.send(count)
            count += 1
            yield self.wait(self.period)


class Gain(Process):
    """The twin of Scale."""

    is_source: ClassVar[bool] = False
    input = InputPort(float)
    output = OutputPort(float)
    factor = Parameter(float, 1.0)

    def run(self) -> Generator[Any, Any, None]:
        while True:
            token = yield self.read(self.input)
            self.output.send(self.factor * token)


class Serve(Actor):
    """Deals with one token after the other, each for the same time, which may be none."""

    input = InputPort(float)
    output = OutputPort(float, depends_on=())
    seconds = Parameter(float, 0.0, unit="s")

    def initialize(self) -> None:
        self.queue: list[float] = []
        self.busy: Any = None

    def fire(self) -> None:
        self.queue += self.input.tokens
        if self.busy is not None and self.busy.due:
            self.output.send(self.queue.pop(0))
            self.busy = None
        if self.queue and self.busy is None:
            self.busy = self.wake_in(self.seconds)


class Server(Process):
    """The twin of Serve."""

    is_source: ClassVar[bool] = False
    input = InputPort(float)
    output = OutputPort(float, depends_on=())
    seconds = Parameter(float, 0.0, unit="s")

    def run(self) -> Generator[Any, Any, None]:
        while True:
            token = yield self.read(self.input)
            yield self.wait(self.seconds)
            self.output.send(token)


TWINS = {"Ticker": "Tick", "Scale": "Gain", "Serve": "Server"}
TYPES = (Tick, Gain, Serve, Server)


def network(seed: int) -> str:
    """A random model of clocks, gains and servers: any may feed any that is declared later, servers all of them."""
    random = np.random.default_rng(seed)
    actors, ports, wires = [], [], []
    for index in range(int(random.integers(4, 12))):
        kind = "Ticker" if index < 2 else str(random.choice(["Ticker", "Scale", "Serve"], p=[0.1, 0.5, 0.4]))
        value = {"Ticker": "period", "Scale": "factor", "Serve": "seconds"}[kind]
        actors.append(f"a{index}: {{type: {kind}, {value}: {random.choice([0.25, 0.5, 1.0, 1.5])}}}")
        if kind == "Serve" and random.random() < 0.3:
            actors[-1] = f"a{index}: {{type: Serve, seconds: 0}}"
        if kind != "Ticker":
            delay = random.choice(["", ", delay: 0", ", delay: 0.25", ", delay: 0.3"])
            wires.append(f"{{from: {random.choice(ports)}.output, to: a{index}.input{delay}}}")
        ports.append(f"a{index}")
    indent = "\n      "
    return f"""
composites:
  Room:
    outputs: [{", ".join(f"o{index}" for index in range(len(ports)))}]
    DIRECTOR
    actors:{indent}{indent.join(actors)}
    connections:{indent}- {f"{indent}- ".join(wires)}
      - {f"{indent}- ".join(f"a{index}.output -> o{index}" for index in range(len(ports)))}
actors: {{room: {{type: Room}}, probe: {{type: Probe}}}}
connections:
{chr(10).join(f"  - room.o{index} -> probe.input" for index in range(len(ports)))}
"""


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("director", ["doc: transparent", "director: {}", "director: {start: 3, drift: 1.25}"])
def test_twins_send_the_same(seed: int, director: str) -> None:
    text = network(seed).replace("DIRECTOR", director)
    random = np.random.default_rng(seed)
    simulation, reactive = simulate(text, until=6, types=TYPES)
    assert len(sends(reactive)) > 12
    for share in (1.0, 0.5):
        mixed = text
        for kind, twin in TWINS.items():
            parts = mixed.split(f"type: {kind},")
            ways = [twin if random.random() < share else kind for _ in parts[1:]]
            mixed = parts[0] + "".join(f"type: {way},{part}" for way, part in zip(ways, parts[1:], strict=True))
        other, results = simulate(mixed, until=6, types=TYPES)
        assert sends(results) == sends(reactive)
        assert results.digest == reactive.digest
        assert seen(other) == seen(simulation)


class Shop(Process):
    """SimPy as its users know it: a preempted machine, a store, a container, a condition and an interrupt."""

    output: OutputPort[Any] = OutputPort(Any)

    def run(self) -> Generator[Any, Any, None]:
        environment = self.environment
        machine = simpy.PreemptiveResource(environment)
        store = simpy.Store(environment, capacity=1)
        tank = simpy.Container(environment, init=0, capacity=10)
        begun = environment.now

        def say(what: str) -> None:
            self.output.send((what, environment.now - begun))

        def job(name: str, priority: int, start: int) -> Generator[Any, Any, None]:
            yield environment.timeout(start)
            left = 3.0
            while left:
                with machine.request(priority=priority) as request:
                    yield request
                    since = environment.now
                    try:
                        yield environment.timeout(left)
                        left = 0.0
                    except simpy.Interrupt as interrupt:
                        left -= environment.now - since
                        say(f"{name} yields after {environment.now - interrupt.cause.usage_since:g}")
            say(f"{name} done")
            yield store.put(name)

        def clerk() -> Generator[Any, Any, None]:
            while True:
                name = yield store.get()
                yield tank.put(4)
                say(f"{name} stored")

        def watch(clerk: Any) -> Generator[Any, Any, None]:
            yield tank.get(7) | environment.timeout(20)
            say("enough")
            clerk.interrupt("go home")

        jobs = [environment.process(job("slow", 1, 0)), environment.process(job("urgent", 0, 1))]
        work = environment.process(clerk())
        environment.process(watch(work))
        try:
            yield simpy.AllOf(environment, jobs) & work
        except simpy.Interrupt as interrupt:
            say(str(interrupt.cause))


@pytest.mark.parametrize(("director", "rate"), [("director: {}", 1.0), ("director: {start: 5, drift: 4}", 4.0)])
def test_simpys_own_words_go_by_local_time(director: str, rate: float) -> None:
    text = f"composites:\n  C: {{{director}, actors: {{shop: {{type: Shop}}}}}}\nactors: {{c: {{type: C}}}}"
    _, results = simulate(text, types=[Shop])
    told = [(time * rate, token) for time, _, _, token in sends(results)]
    assert told == [
        (local, (what, local))
        for local, what in [
            (1.0, "slow yields after 1"),
            (4.0, "urgent done"),
            (4.0, "urgent stored"),
            (6.0, "slow done"),
            (6.0, "slow stored"),
            (6.0, "enough"),
            (6.0, "go home"),
        ]
    ]
