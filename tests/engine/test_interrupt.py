"""Ctrl-C: a run ends between two firings, and its records can be read wherever it was interrupted."""

import gc
import os
import signal
import sys
import threading
import time
from types import FrameType
from typing import Any

import pytest

from epicycle.actors import Actor, Clock, InputPort, OutputPort, Tag
from epicycle.runner import Model, Signal, Simulation
from epicycle.runner.support.interrupt import held
from tests.engine.engine_parts import load


class Interrupted(Actor):
    """Gets Ctrl-C in its third firing, before it has sent anything."""

    input = InputPort(object)
    first, second = OutputPort(object), OutputPort(object)
    seconds = 0.0

    def initialize(self) -> None:
        self.firings = 0

    def fire(self) -> None:
        self.firings += 1
        if self.firings == 3:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(self.seconds)
        self.first.send(self.firings)
        self.second.send(self.firings)


class Slow(Interrupted):
    """Runs for longer than a user waits."""

    seconds = 30.0


def simulation_of(kind: type[Actor], **options: Any) -> Simulation:
    model = Model("m")
    model.add(Clock("clock", period=1))
    model.add(kind("actor"))
    model.connect("clock.output", "actor.input")
    model.record("actor.first", "actor.second")
    return Simulation(model, **options)


def test_the_firing_is_finished() -> None:
    simulation = simulation_of(Interrupted, keep_log=True)
    with pytest.raises(KeyboardInterrupt):
        simulation.run(until=10.0)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    results = simulation.results("interrupted")
    assert results["actor.first"].tokens == results["actor.second"].tokens == [1, 2, 3]
    assert len(results.log.records) == 9  # with three ticks
    assert threading.active_count() == 1


def test_a_firing_that_takes_long_is_broken_off() -> None:
    simulation, start = simulation_of(Slow), time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        simulation.run(until=10.0)
    assert time.monotonic() - start < 10
    results = simulation.results("interrupted")
    assert results["actor.first"].tokens == results["actor.second"].tokens == [1, 2]


def test_who_has_taken_the_signal_keeps_it() -> None:
    caught: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: caught.append(number))
    try:
        results = simulation_of(Interrupted).run(until=10.0)
    finally:
        signal.signal(signal.SIGINT, before)
    assert (caught, len(results["actor.first"])) == ([signal.SIGINT], 11)


def test_what_must_not_be_cut_in_two_is_held() -> None:
    done: list[str] = []

    def write() -> None:
        with held():
            os.kill(os.getpid(), signal.SIGINT)
            done.append("a whole line")

    with pytest.raises(KeyboardInterrupt):
        write()
    assert done == ["a whole line"]


@pytest.mark.parametrize("tokens", [[1.0, 2.0], [1, 2], [1.0, "x"], [1, 2.0], [1, 2**70]])
def test_a_signal_can_be_read_wherever_it_was_broken_off(tokens: list[Any]) -> None:
    """Ctrl-C between any two instructions."""
    for steps in range(1_000):
        found, left = Signal("s"), [steps]

        def watch(frame: FrameType, event: str, _: object, left: list[int] = left) -> Any:
            frame.f_trace_opcodes = True
            if event == "opcode":
                left[0] -= 1
                if left[0] < 0:
                    raise KeyboardInterrupt
            return watch

        gc.disable()  # a callback of a collection would be interrupted, too
        sys.settrace(watch)
        try:
            for time_, token in enumerate(tokens):
                found.add(Tag(time_, 0), token)
            is_whole = True
        except KeyboardInterrupt:
            is_whole = False
        finally:
            sys.settrace(None)
            gc.enable()
        number = len(found)
        assert found.tokens == tokens[:number]
        assert found.tags == [Tag(time_, 0) for time_ in range(number)]
        assert list(found) == list(zip(found.tags, found.tokens, strict=True))
        assert len(found.values) == number
        if is_whole:
            assert number == len(tokens)
            assert steps > 20
            return
    pytest.fail("never whole")


def test_a_run_that_is_all_in_c_can_be_interrupted() -> None:
    """None of its actors runs Python code: the director makes sure that signals are handled."""
    model = load(
        "actors: {clock: {type: Clock, period: 1 us}, hold: {type: TimeDelay}, seen: {type: Recorder, capacity: 0}}\n"
        "connections: [clock.output -> hold.input, hold.output -> seen.input]\nrun: {stop: 1000 s}\n"
    )
    started = time.perf_counter()
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        Simulation(model).run()
    timer.join()
    assert time.perf_counter() - started < 10.0
