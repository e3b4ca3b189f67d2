"""Transitions that are taken with a probability."""

from __future__ import annotations

import math
from typing import Any

import pytest

from epicycle.actors import InputPort, ModalActor, transition
from epicycle.runner.execution.engine.errors import ActorError
from tests.actors.feeding import Events, feed
from tests.modes.test_machines import sent


@pytest.mark.slow
def test_transitions_with_probabilities_share_what_is_drawn() -> None:
    """One draw a reaction, in which each that is enabled otherwise has a share of its own."""
    machine: dict[str, Any] = {
        "type": "StateMachine",
        "variables": {"p": 0.1},
        "modes": ["a"],
        "transitions": [
            "a -> a preemptive probability 0.5 on x do y = 1",
            "a -> a probability 0.2 on x do y = 2",
            "a -> a probability 0.25 when x < 0 do y = 0",
            {"from": "a", "to": "a", "on": "x", "probability": "3 * p", "do": "y = 3"},
        ],
    }
    events: dict[str, Events] = {"x": [(float(time), 1) for time in range(1, 2001)]}
    tokens = [value for _, value in feed(machine, events, 2001)[1]["y"]]
    assert len(tokens) == 2000
    for value, share in ((1, 0.5), (2, 0.2), (3, 0.3)):
        assert tokens.count(value) / 2000 == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / 2000))
    few: dict[str, Events] = {"x": events["x"][:100]}
    drawn = feed(machine, few, 2001)[1]["y"]
    assert feed(machine, few, 2001)[1]["y"] == drawn != feed(machine, few, 2001, seed=1)[1]["y"]


def test_the_draws_of_probabilities_are_a_stream_of_their_own() -> None:
    """Whoever adds a probability changes nothing of what is drawn of nondeterministic transitions."""
    drawn = ["a -> b nondeterministic on x", "a -> c nondeterministic on x", "b, c -> a on x"]
    events: dict[str, Events] = {"x": [(float(time), 0) for time in range(1, 101)]}
    machine: dict[str, Any] = {"type": "StateMachine", "modes": ["a", "b", "c"], "transitions": drawn}
    modes = feed(machine, events)[1]["mode"]
    machine["transitions"] = [*drawn[:2], "b, c -> a probability 1 on x"]
    assert feed(machine, events)[1]["mode"] == modes


@pytest.mark.parametrize(
    ("first", "message"),
    [
        (
            "0.5",
            "in mode 'a', the probabilities of transitions that are enabled at once add up to 1.1, more than 1",
        ),
        ("x", "a -> b: 5 is not a probability, which is from 0 to 1"),
        ("'x'", "a -> b probability: \"'x'\" gives 'x', which is not a number"),
    ],
)
def test_probabilities_that_are_none(first: str, message: str) -> None:
    machine = {
        "modes": ["a", "b"],
        "transitions": [f"a -> b probability {first} on x", "a -> b probability 0.6 on x do y = 1"],
    }
    with pytest.raises(ActorError) as caught:
        sent(machine, {"x": [(1.0, 5)]})
    assert str(caught.value).splitlines()[0] == f"it failed in fire() at (1 s, 1): {message}"


class Worn(ModalActor):
    """Fails now and then, the more often the longer it is used."""

    job = InputPort(required=False)

    modes = ("up", "down")

    def initialize(self) -> None:
        super().initialize()
        self.jobs = 0

    @transition("up", "up", on="job", probability=lambda self: 1 - self.jobs / 10)
    def works(self) -> None:
        self.jobs += 1

    @transition("up", "down", on="job", probability=lambda self: self.jobs / 10)
    def fails(self) -> None:
        self.jobs = -self.jobs


def test_methods_may_have_probabilities() -> None:
    actor, found, _ = feed({"type": "Worn"}, {"job": [(float(time), 0) for time in range(1, 12)]}, types=[Worn])
    assert found["mode"][-1][1] == "down"
    assert isinstance(actor, Worn)
    assert len(found["mode"]) == 2 - actor.jobs
    assert 1 <= -actor.jobs <= 10
