"""Tokens that multiply: how many one tag may hold, and how the error names the actors that multiply them."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from epicycle.actors import Actor
from epicycle.runner.execution.engine import ActorError, LoopError, Simulation
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.text.limits import RAISE_IT
from tests.engine.engine_parts import load


def failure(text: str) -> str:
    """The end of a run that holds too much, with the least permitted limit."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "m.yaml"
        file.write_text(f"model: m\n{text}", encoding="utf-8")
        model = load_model(file, max_actors=1_000)
    with pytest.raises(LoopError) as caught:
        Simulation(model).run(until=10.0)
    return str(caught.value)


def test_a_repeat_without_end() -> None:
    told = failure(
        "actors:\n  c: {type: Const, value: 1}\n  p: {type: Repeat, times: 1000000000}\n  r: {type: Recorder}\n"
        "connections: [c.output -> p.input, p.output -> r.input]\n"
    )
    most = "more than 10,000 tokens and events of aspects, most of them at p.output, r.input"
    assert told == f"too much at (0 s, 1): {most}; {RAISE_IT}"


def test_repeats_that_double_at_each_step() -> None:
    told = failure(
        "actors:\n  c: {type: Clock, period: 1}\n  p: {type: Repeat, count: 40}\n  r: {type: Recorder}\n"
        "connections: ['c.output -> p[0].input', 'p[..-2].output -> p[1..].input', 'p[-1].output -> r.input']\n"
    )
    most = "more than 10,000 tokens and events of aspects, most of them at p[12].output, p[12].input, p[11].input"
    assert told == f"too much at (0 s, 1): {most}; {RAISE_IT}"


def test_duplicates_one_upon_the_other() -> None:
    stack = "".join(f"  d{n}: {{type: Duplicate, probability: 1, copies: 1000, at: r.input}}\n" for n in range(3))
    told = failure(
        "actors:\n  c: {type: Clock, period: 1}\n  r: {type: Recorder}\nconnections: [c.output -> r.input]\n"
        f"aspects:\n{stack}"
    )
    most = "more than 10,000 tokens on their way, most of them at aspect d2"
    assert told == f"too much at (0 s, 3): {most}; {RAISE_IT}"


@pytest.mark.slow
def test_duplicates_that_come_apart_in_time() -> None:
    """Then no tag holds much, and no time is far away."""
    stack = "".join(
        f"  d{n}: {{type: Duplicate, probability: 1, copies: 1000, spacing: 1 ns, at: r.input}}\n" for n in range(6)
    )
    told = failure(
        "actors:\n  c: {type: Clock, period: 1}\n  r: {type: Recorder}\nconnections: [c.output -> r.input]\n"
        f"aspects:\n{stack}"
    )
    most = "more than 50,000 tokens on their way, over all times, most of them at aspect d4"
    assert told == f"too much at (2e-09 s, 1): {most}; {RAISE_IT}"


class Leaver(Actor):
    """Wants to end the program."""

    error: type[BaseException] = SystemExit

    def initialize(self) -> None:
        self.wake_in(0)

    def fire(self) -> None:
        raise self.error("enough")


class Own(BaseException):
    """No ``Exception``."""


@pytest.mark.parametrize("error", [SystemExit, Own, GeneratorExit])
def test_whatever_an_actor_raises_is_its_failure(error: type[BaseException], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Leaver, "error", error)
    with pytest.raises(ActorError) as caught:
        Simulation(load("actors: {a: {type: Leaver}}", types=[Leaver])).run(until=1.0)
    assert (caught.value.path, caught.value.reason) == ("a", f"{error.__name__}: enough")


def test_ctrl_c_is_nobodys_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Leaver, "error", KeyboardInterrupt)
    with pytest.raises(KeyboardInterrupt):
        Simulation(load("actors: {a: {type: Leaver}}", types=[Leaver])).run(until=1.0)


def test_ordinary_crowds_are_welcome() -> None:
    assert Simulation(load("actors: {a: {type: Ticker}}")).run(until=3.0).events == 4
