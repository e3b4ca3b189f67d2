"""Forks with random numbers of their own: all streams are others from there on, and nothing else is."""

from __future__ import annotations

import gc
import types
from functools import lru_cache
from typing import Any

import pytest

from epicycle.actors import Actor, InputPort, OutputPort, Stream, random_stream
from epicycle.runner import Simulation, load_model
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.catalogue.packaged import packaged_models
from tests.demo_models import DURATIONS
from tests.engine.engine_parts import load
from tests.engine.test_snapshots import FEATURES, told

PLAIN = """
actors:
  tick: {type: PoissonClock, mean_interval: 100 ms}
  walk: {type: Random, distribution: {type: Normal}}
  seen: {type: Recorder}
connections: [tick.output -> walk.trigger, walk.output -> seen.input]
run: {stop: 20 s, seed: 3}
"""
PROCESSES = """
actors:
  people: {type: PoissonClock, mean_interval: 1 s}
  desk: {type: Station, service_time: {type: Exponential, mean: 800 ms}}
  seen: {type: Recorder}
connections: [people.output -> desk.input, desk.output -> seen.input]
run: {stop: 60 s, seed: 3}
"""


def streams_in(simulation: Simulation) -> list[Stream]:
    """Every random stream that anything in a run holds."""
    cache = type(lru_cache(len))  # of a function without a memory, which copies of a run have in common
    passed = (type, types.ModuleType, types.CodeType, Model, cache)
    found, seen, waiting = [], {id(simulation.model)}, [simulation._run]
    while waiting:
        thing: Any = waiting.pop()
        kind = type(thing)  # not by isinstance, which asks what a weak proxy refers to
        if id(thing) in seen or issubclass(kind, passed) or thing is simulation.model.graph:
            continue
        seen.add(id(thing))
        if issubclass(kind, Stream):
            found.append(thing)
        is_global = kind is types.FunctionType
        waiting += [thing.__closure__, thing.__defaults__] if is_global else gc.get_referents(thing)
    return found


def assert_all_are_reseeded(model: Model, until: float) -> int:
    simulation = Simulation(model)
    simulation.advance(until)
    fork = simulation.fork(reseed=2**70 + 1)
    known = {id(stream): names for stream, *names in fork.director.streams._made}
    found = streams_in(fork)
    assert {id(each) for each in found} == set(known)
    for stream in found:
        assert stream.state == random_stream(2**70 + 1, *known[id(stream)]).state
    drawn = [each.random() for each in found]
    assert drawn == [random_stream(2**70 + 1, *known[id(each)]).random() for each in found]
    ours, copied = ({each.state for each in streams_in(of)} for of in (simulation, simulation.fork()))
    assert ours == copied
    return len(found)


def test_every_stream_there_is_becomes_another() -> None:
    # Of actors, of aspects at ports, at parameters, at actors and at composites as a whole.
    assert assert_all_are_reseeded(load(FEATURES), 4.0) >= 9


@pytest.mark.slow
@pytest.mark.parametrize("name", packaged_models())
def test_every_stream_of_packaged_models_becomes_another(name: str) -> None:
    model = load_model(name)
    assert_all_are_reseeded(model, min(model.stop or 100.0, DURATIONS.get(name, 100.0)) / 4.0)


@pytest.mark.parametrize("text", [PLAIN, FEATURES, PROCESSES], ids=["plain", "features", "processes"])
def test_what_is_drawn_after_a_fork_depends_on_its_seed_alone(text: str) -> None:
    simulation = Simulation(load(text), keep_log=True)
    simulation.advance(5.0)
    forks = [simulation.fork(reseed=seed) for seed in (7, 7, 8)]
    plain = simulation.fork()
    assert {fork.tag for fork in forks} == {simulation.tag}
    begun = [record.encoded() for record in simulation.log.records]
    for fork in forks:
        fork.advance(6.0)
    again = forks[0].fork()  # and what comes of a fork of it
    first, second, other, same, mine = map(told, (*forks, plain, simulation))
    assert first == second == told(again)
    assert first != other
    assert mine == same == told(Simulation(load(text), keep_log=True))
    assert first != mine
    for each in (first, other):
        assert each[-1][: len(begun)] == begun


class Late(Actor):
    """Draws from its stream when it first fires."""

    input = InputPort(object)
    output = OutputPort(object)

    def fire(self) -> None:
        self.output.send(self.random_stream("late").random())


def test_streams_that_are_made_later_are_other_ones_too() -> None:
    text = "{type: Clock, period: 1 s}\n  late: {type: Late}\n  seen: {type: Recorder}\n"
    links = "connections: [tick.output -> late.input, late.output -> seen.input]\nrun: {stop: 3 s}"
    simulation = Simulation(load(f"actors:\n  tick: {text}{links}", types=[Late]))
    fork = simulation.fork(reseed=11)
    expected = random_stream(11, "late", "late").random(4).tolist()
    assert seen_by(fork) == expected
    assert seen_by(simulation) == random_stream(0, "late", "late").random(4).tolist()


def seen_by(simulation: Simulation) -> list[Any]:
    simulation.run()
    return list(simulation["seen"].tokens)  # type: ignore[attr-defined]


def test_a_model_without_chance_stays_as_it_is() -> None:
    text = "actors: {tick: {type: Clock, period: 1 s}, seen: {type: Recorder}}\n"
    simulation = Simulation(load(text + "connections: [tick.output -> seen.input]\nrun: {stop: 9 s}"))
    simulation.advance(4.0)
    fork = simulation.fork(reseed=1)
    assert told(fork) == told(simulation)


@pytest.mark.parametrize("text", [PLAIN, PROCESSES], ids=["plain", "processes"])
def test_a_fork_before_the_beginning(text: str) -> None:
    simulation = Simulation(load(text), keep_log=True)
    fork = simulation.fork(reseed=5)
    assert told(fork.fork()) == told(fork)
    fork = Simulation(load(text), keep_log=True).fork(reseed=5)
    fork.advance(30.0)
    assert told(fork.fork()) == told(fork) == told(Simulation(load(text), seed=5, keep_log=True))


def test_a_snapshot_of_a_fork_of_a_fork() -> None:

    simulation = Simulation(load(PROCESSES))
    for seed in range(3):
        simulation.advance(10.0 * (seed + 1))
        simulation = simulation.fork(reseed=seed)
    snapshot = simulation.snapshot()
    expected = told(simulation)
    again = Simulation(simulation.model)
    again.restore(snapshot)
    assert told(again) == expected
