"""A run inside a program's own SimPy environment: one clock, shared resources, and errors at their places."""

from __future__ import annotations

import math
from collections.abc import Generator
from heapq import heappop, heappush
from typing import Any

import pytest
import simpy

from epicycle.actors import Clock, EpicycleError, InputPort, Scale
from epicycle.actors import Process as BaseProcess
from epicycle.aspects import PacketLoss
from epicycle.bridges import Process
from epicycle.runner import ActorError, Model, Simulation

Behaviour = Generator[Any, Any, None]


class Counting(BaseProcess):
    """Counts tokens that come while it waits for others."""

    input = InputPort(object)

    def run(self) -> Behaviour:
        self.seen: list[float] = []
        while True:
            yield self.read(self.input)
            self.seen.append(self.now)


def ticking(**options: Any) -> Model:
    model = Model("ticking", seed=3, **options)
    clock = model.add(Clock("clock", period=0.1))
    counting = model.add(Counting("counting"))
    model.connect(clock.output, counting.input)
    model.weave("loss", PacketLoss(probability=0.3), at=counting.input)
    model.metric("heard", of=clock.output, take="count")
    return model


def test_an_attached_run_is_the_run_that_it_is_alone() -> None:
    alone = Simulation(ticking(stop=5.0)).run()
    env = simpy.Environment()
    env.process(iter_timeouts(env, 0.25))
    results = env.run(until=Simulation(ticking(stop=5.0)).attach(env))
    assert (results.digest, results.metrics, results.stopped) == (alone.digest, alone.metrics, "stop time")
    assert env.now == 5.0


def test_all_microsteps_of_a_time_are_taken() -> None:
    def delayed() -> Model:
        model = Model("delayed", stop=0.5)
        clock, first, second = (model.add(each) for each in (Clock("clock", period=0.1), Scale("a"), Scale("b")))
        model.connect(clock.output, first.input, delay=0.0)
        model.connect(first.output, second.input, delay=0.0)
        return model

    alone = Simulation(delayed()).run()
    env = simpy.Environment()
    results = env.run(until=Simulation(delayed()).attach(env))
    assert (results.digest, results.events) == (alone.digest, 18)


def iter_timeouts(env: Any, delay: float) -> Behaviour:
    while True:
        yield env.timeout(delay)


def test_at_one_instant_events_of_simpy_come_before_tags() -> None:
    order: list[str] = []

    def outside(env: Any) -> Behaviour:
        for _ in range(3):
            yield env.timeout(0.1)  # which adds up to 0.30000000000000004
            order.append(f"outside {env.now:.1f}")

    class Noting(Counting):
        def fire(self) -> None:
            order.append(f"tag {self.now:.1f}")
            super().fire()

    model = Model("noting")
    clock = model.add(Clock("clock", period=0.1, offset=0.1))
    noting = model.add(Noting("noting"))
    model.connect(clock.output, noting.input)
    env = simpy.Environment()
    Simulation(model).attach(env)
    env.process(outside(env))
    env.run(until=0.35)
    assert order == ["tag 0.0", "outside 0.1", "tag 0.1", "outside 0.2", "tag 0.2", "outside 0.3", "tag 0.3"]


def test_a_run_begins_at_the_time_of_its_environment_and_ends_when_asked() -> None:
    env = simpy.Environment(initial_time=2)
    simulation = Simulation(ticking())
    done = simulation.attach(env)
    env.run(until=3.05)
    seen: Any = simulation["counting"]
    assert min(seen.seen) >= 2
    assert max(seen.seen) == 3
    results = simulation.finish()
    assert (results.stopped, done.triggered, done.value) == ("the program", True, results)
    env.run(until=4)  # goes on without it
    assert max(seen.seen) == 3


def test_an_attached_run_shares_resources_with_the_program() -> None:
    env = simpy.Environment()
    lathe = simpy.Resource(env)
    got: list[tuple[str, float]] = []

    class Worker(BaseProcess):
        def run(self) -> Behaviour:
            with lathe.request() as request:
                yield request | self.environment.timeout(100)
                got.append(("inside", self.now))
                yield self.wait(2)

    def outside(env: Any) -> Behaviour:
        with lathe.request() as request:
            yield request
            got.append(("outside", env.now))
            yield env.timeout(1.5)

    env.process(outside(env))
    model = Model("workshop")
    model.add(Worker("worker"))
    Simulation(model).attach(env)
    env.process(outside(env))
    env.run()
    assert got == [("outside", 0), ("outside", 1.5), ("inside", 3.0)]  # a process begins at the first tag


def test_what_an_attached_run_refuses() -> None:
    env = simpy.Environment()
    simulation = Simulation(ticking())
    simulation.attach(env)
    for act in (simulation.run, simulation.step, lambda: simulation.attach(env)):
        with pytest.raises(EpicycleError) as caught:
            act()
        assert str(caught.value) == (
            "the run of ticking is attached to a SimPy environment, which lets its time pass: run that"
        )
    with pytest.raises(EpicycleError) as caught:
        simulation.snapshot()
    assert str(caught.value) == "the run of ticking is attached to a SimPy environment, which cannot be copied"
    begun = Simulation(ticking())
    begun.step()
    with pytest.raises(EpicycleError) as caught:
        begun.attach(env)
    assert str(caught.value) == "the run of ticking has begun: attach another Simulation to the environment"
    with pytest.raises(EpicycleError) as caught:
        Simulation(ticking()).attach(simpy.Environment(initial_time=-1))
    assert str(caught.value) == (
        "ticking cannot be attached to an environment whose time is -1: a run has no time before 0 s"
    )


def test_an_error_of_an_attached_run_names_the_actor() -> None:
    def failing(env: Any) -> Behaviour:
        yield env.timeout(1)
        raise ValueError("no more parts")

    env = simpy.Environment()
    model = Model("factory")
    model.add(Process("line", function=failing))
    Simulation(model).attach(env)
    with pytest.raises(ActorError) as caught:
        env.run(until=3)
    assert str(caught.value).splitlines()[0] == "line failed in run() at (1 s, 1): ValueError: no more parts"
    env.run(until=3)  # the program can go on
    assert env.now == 3


def test_an_error_of_the_program_is_its_own() -> None:
    def failing(env: Any) -> Behaviour:
        yield env.timeout(0.15)
        raise ValueError("no more parts")

    env = simpy.Environment()
    simulation = Simulation(ticking(stop=1.0))
    done = simulation.attach(env)
    env.process(failing(env))
    with pytest.raises(ValueError, match=r"^no more parts$"):
        env.run(until=3)
    env.run(until=done)
    assert done.value.digest == Simulation(ticking(stop=1.0)).run().digest


def test_two_runs_share_an_environment() -> None:
    alone = [Simulation(ticking(stop=5.0), seed=seed).run().digest for seed in (1, 2)]
    env = simpy.Environment()
    first, second = (Simulation(ticking(stop=5.0), seed=seed).attach(env) for seed in (1, 2))
    env.run(until=first & second)
    assert [first.value.digest, second.value.digest] == alone
    assert env.now == 5.0


def test_what_an_environment_shows_to_everybody_suffices() -> None:
    """An environment that keeps its events elsewhere, as another version of SimPy might."""

    class Other(simpy.Environment):
        def __init__(self) -> None:
            super().__init__()
            self.hidden, self._queue = self._queue, None  # type: ignore[assignment]

        def schedule(self, event: Any, priority: Any = 1, delay: float = 0) -> None:
            heappush(self.hidden, (self.now + delay, priority, next(self._eid), event))

        def peek(self) -> float:
            return self.hidden[0][0] if self.hidden else math.inf

        def step(self) -> None:
            if not self.hidden:
                raise simpy.core.EmptySchedule
            self._now, _, _, event = heappop(self.hidden)
            callbacks, event.callbacks = event.callbacks, None
            for callback in callbacks:
                callback(event)

    env = Other()
    env.process(iter_timeouts(env, 0.25))
    results = env.run(until=Simulation(ticking(stop=5.0)).attach(env))
    assert results.digest == Simulation(ticking(stop=5.0)).run().digest
