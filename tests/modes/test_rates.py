"""Transitions with rates: Markov chains in continuous time."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest

from epicycle.actors import InputPort, ModalActor, OutputPort, transition
from epicycle.actors.modes.text import read_transition
from epicycle.runner.execution.engine.errors import ActorError
from tests.actors.feeding import feed
from tests.modes.test_machines import sent

MACHINE: dict[str, Any] = {
    "type": "StateMachine",
    "variables": {"n": 0},
    "modes": ["a", "b"],
    "transitions": [
        "a -> a rate 3 when n < 2 do n = n + 1; y = n",
        {"from": "a", "to": "b", "rate": "1000 mHz", "do": "n = 0"},
        "b -> a rate 0.5*4",
    ],
}


def test_the_first_of_the_rates_wins() -> None:
    """From a, b is entered at once with 1/4; else n grows, and after twice 3 of 4 only the way to b is left."""
    modes = feed(MACHINE, {}, 4000)[1]["mode"]
    visits = [(start, mode) for (start, mode), (_, before) in zip(modes[1:], modes, strict=False) if mode != before]
    stays: dict[str, list[float]] = {"a": [], "b": []}
    for (start, mode), (end, _) in pairwise(visits):
        stays[mode].append(end - start)
    assert len(stays["b"]) > 2000
    for mode, mean in (("a", 1.0), ("b", 0.5)):  # both are exponential, however often a is entered from itself
        found = sum(stays[mode]) / len(stays[mode])
        assert found == pytest.approx(mean, abs=4 * mean / math.sqrt(len(stays[mode])))
    grown = [value for _, value in feed(MACHINE, {}, 4000)[1]["y"]]
    share = grown.count(1) / len(stays["a"])
    assert share == pytest.approx(0.75, abs=4 * math.sqrt(0.75 * 0.25 / len(stays["a"])))


def test_a_rate_follows_a_held_input() -> None:
    """It is 0 up to 10 s: the time that was drawn with another rate counts no more."""
    machine = {
        "type": "StateMachine",
        "held": {"x": 0},
        "modes": ["a"],
        "transitions": ["a -> a rate x do y = x"],
    }
    sends = feed(machine, {"x": [(10.0, 50), (20.0, 0), (30.0, 100)]}, 40)[1]["y"]
    assert {math.floor(time / 10) for time, _ in sends} == {1, 3}
    for value in (50, 100):
        count = [each for _, each in sends].count(value)
        assert count == pytest.approx(10 * value, abs=4 * math.sqrt(10 * value))


def test_whatever_else_is_enabled_goes_first() -> None:
    machine = {"modes": ["a", "b"], "transitions": ["a -> b rate 1e12", "a -> b immediate do y = 1"]}
    assert sent(machine, {}, 1) == sent({**machine, "transitions": machine["transitions"][1:]}, {}, 1)


class Decay(ModalActor):
    """Atoms that decay."""

    more = InputPort(required=False)
    left = OutputPort(int)

    modes = ("some", "none")

    def initialize(self) -> None:
        super().initialize()
        self.atoms = 200

    @transition("some", "some", rate=lambda self: 2.0 * self.atoms)
    def decays(self) -> None:
        self.atoms -= 1
        self.left.send(self.atoms)

    @transition("some", "none", when=lambda self: self.atoms == 0)
    def ends(self) -> None: ...


def test_methods_may_have_rates() -> None:
    sends = feed({"type": "Decay"}, {}, 100, types=[Decay])[1]["left"]
    assert [left for _, left in sends] == list(range(199, -1, -1))
    half = next(time for time, left in sends if left == 100)
    assert half == pytest.approx(math.log(2) / 2, abs=0.2)
    assert feed({"type": "Decay"}, {}, 100, types=[Decay])[1]["left"] == sends


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        ("x", "a -> b: -1 is not a rate, which is a number >= 0"),
        ("'x'", "a -> b rate: \"'x'\" gives 'x', which is not a number"),
    ],
)
def test_rates_that_are_none(rate: str, message: str) -> None:
    machine = {"held": {"x": -1}, "modes": ["a", "b"], "transitions": [f"a -> b rate {rate}", "b -> a on x"]}
    with pytest.raises(ActorError) as caught:
        sent(machine, {})
    assert str(caught.value).splitlines()[0] == f"it failed in fire() at (0 s, 1): {message}"


@pytest.mark.parametrize(
    ("line", "value", "more"),
    [
        ("a -> b rate n / 3 when x do y = 1", "n / 3", {"when": "x"}),
        ("a -> b rate 2", "2.0", {}),
        ("a -> b rate (1 if x else 2) on x", "(1 if x else 2)", {"on": ("x",)}),
        ("a -> b immediate rate 3 * n history", "3 * n", {"immediate": True, "history": True}),
        ("a -> b probability 1 / n priority 2", "1 / n", {"priority": 2}),
    ],
)
def test_a_rate_ends_where_the_next_word_begins(line: str, value: str, more: dict[str, Any]) -> None:
    read = read_transition(line)
    assert (read.rate or read.probability).source == value
    for name, given in more.items():
        found = getattr(read, name)
        assert (found.source if name == "when" else found) == given
