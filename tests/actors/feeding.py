"""One actor under test in a model of its own: tokens in at given times, tokens out."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from epicycle.actors import Actor, OutputPort, Parameter
from epicycle.runner.execution.engine import Results, Simulation
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.build.model import Model

Events = Sequence[tuple[float, Any]]


class Feed(Actor):
    """Sends given tokens at given times; several of one time at the same tag."""

    is_source: ClassVar[bool] = True
    output: OutputPort[Any] = OutputPort(Any)
    events: Parameter[Any] = Parameter(object, shape=(None,))

    def initialize(self) -> None:
        for time in dict.fromkeys(time for time, _ in self.events):
            self.wake_at(time)

    def fire(self) -> None:
        for time, token in self.events:
            if abs(time - self.now) < 0.5e-9:
                self.output.send(token)


def load(text: str, types: Sequence[type] = ()) -> Model:
    """The model that a text describes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "m.yaml"
        path.write_text(text, encoding="utf-8")
        return load_model(path, types=[Feed, *types])


def model_of(
    actor: Mapping[str, Any], inputs: Mapping[str, Events | list[Events]], types: Sequence[type] = ()
) -> Model:
    """A model in which ``actor`` is fed: ``inputs`` has (time, token) pairs by port, or a list of such per channel."""
    actors: dict[str, Any] = {"it": actor}
    connections = []
    for port, events in inputs.items():
        channels = events if isinstance(events, list) and events and isinstance(events[0], list) else [events]
        for number, each in enumerate(channels):
            name = f"{port}_{number}"
            actors[name] = {"type": "Feed", "events": each}
            connections.append(f"{name}.output -> it.{port}")
    # JSON is YAML.
    return load(json.dumps({"model": "m", "actors": actors, "connections": connections}), types)


def feed(
    actor: Mapping[str, Any],
    inputs: Mapping[str, Events | list[Events]],
    until: float = 1000.0,
    types: Sequence[type] = (),
    seed: int = 0,
) -> tuple[Actor, dict[str, list[tuple[float, Any]]], Results]:
    """The actor after the run, what it sent as (time, token) by port, and the results."""
    simulation = Simulation(model_of(actor, inputs, types), keep_log=True, seed=seed)
    results, it = simulation.run(until=until), simulation["it"]
    sent: dict[str, list[tuple[float, Any]]] = {name: [] for name in it.outputs}
    for record in results.log.records:
        if record.event == "send" and record.actor == "it":
            sent[record.port].append((record.tag.seconds, record.value))
    return it, sent, results


def tokens(sent: dict[str, list[tuple[float, Any]]], port: str = "output") -> list[Any]:
    """What left one port, without the times."""
    return [token for _, token in sent[port]]


def seconds(*values: Any) -> list[tuple[float, Any]]:
    """One token a second, the first at 1 s."""
    return [(float(time), value) for time, value in enumerate(values, 1)]


def ticks(period: float, until: float) -> list[tuple[float, int]]:
    return [(round(k * period, 9), k) for k in range(round(until / period) + 1)]
