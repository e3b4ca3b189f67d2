"""An actor whose output does not depend on an input at once: wake-ups and tokens are separate firings."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

from epicycle.actors import Actor, InputPort, OutputPort
from epicycle.runner.execution.engine import ActorError, Simulation
from tests.engine.engine_parts import Probe, load, seen, sends, simulate


class Echo(Actor):
    """Sends at 0, 1, ... s, and tells at what tags which inputs had tokens; it reads after it has sent."""

    is_source: ClassVar[bool] = True
    early: InputPort[Any] = InputPort(Any, required=False)
    first: InputPort[Any] = InputPort(Any, required=False)
    second: InputPort[Any] = InputPort(Any, required=False)
    output: OutputPort[Any] = OutputPort(Any, depends_on=())
    answer: OutputPort[Any] = OutputPort(Any, depends_on=("early",))

    def initialize(self) -> None:
        self.wake = self.wake_in(0)
        self.firings: list[Any] = []

    def fire(self) -> None:
        woken = self.wake.due and not (self.firings and self.firings[-1][0] == self.now)
        if woken:
            self.output.send(f"at {self.now:g}")
            self.wake = self.wake_in(1)
        found = {name: port.tokens for name, port in self.inputs.items() if port.present}
        self.firings.append((self.now, woken, found))


def test_tokens_wait_until_all_that_belongs_to_them_is_there() -> None:
    # The inputs are reached at depths 1 (early), 1 (first) and 3 (second); a token for `first` is there from the
    # beginning of the tag on, for its connection has a delay.
    simulation, _ = simulate(
        """
actors: {echo: {type: Echo}, clock: {type: Ticker}, a: {type: Scale}, b: {type: Scale}}
connections:
  - clock.output -> a.input, echo.early
  - a.output -> b.input
  - b.output -> echo.second
  - {from: clock.output, to: echo.first, delay: 1 s}
""",
        until=1,
        types=[Echo],
    )
    assert simulation["echo"].firings == [  # type: ignore[attr-defined]
        (0.0, True, {}),
        (0.0, False, {"early": (0,)}),
        (0.0, False, {"second": (0.0,)}),
        (1.0, True, {}),
        (1.0, False, {"early": (1,)}),
        (1.0, False, {"first": (0,), "second": (1.0,)}),
    ]


def test_what_an_actor_sends_itself_comes_in_a_firing_of_its_own() -> None:
    simulation, results = simulate(
        """
actors: {echo: {type: Echo}, probe: {type: Probe}}
connections: [echo.output -> echo.first, echo.output -> probe.input]
""",
        until=0,
        types=[Echo],
    )
    assert simulation["echo"].firings == [(0.0, True, {}), (0.0, False, {"first": ("at 0",)})]  # type: ignore[attr-defined]
    assert seen(simulation) == [(0.0, 1, ("at 0",))]
    assert sends(results) == [(0.0, 1, "echo.output", "at 0")]


def test_tokens_that_are_held_when_a_run_fails_are_not_there_in_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    text = """
actors: {echo: {type: Echo}, clock: {type: Ticker}, probe: {type: Probe}}
connections: [clock.output -> echo.second, echo.output -> probe.input, {from: clock.output, to: echo.first, delay: 1 s}]
"""
    untouched, _ = simulate(text, until=2, types=[Echo])

    def broken(_: Actor) -> None:
        raise ValueError("no")

    model = load(text, types=[Echo])
    for kind in (Probe, Echo):
        with monkeypatch.context() as patch:
            patch.setattr(kind, "fire", broken)
            with pytest.raises(ActorError, match="no"):
                Simulation(model).run(until=2)
    simulation = Simulation(model)
    simulation.run(until=2)
    assert simulation["echo"].firings == untouched["echo"].firings  # type: ignore[attr-defined]
