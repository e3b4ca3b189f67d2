"""Models with aspects that are models, and what these did."""

from __future__ import annotations

import dataclasses
from typing import Any

from epicycle.actors import Actor, InputPort, OutputPort
from epicycle.aspects import Request
from epicycle.runner import Simulation
from epicycle.runner.execution.engine import Results
from epicycle.runner.model.build.model import Model
from tests.engine import engine_parts


class Negate(Actor):
    """Turns the sign of what is requested."""

    input = InputPort(Request)
    output = OutputPort(Request)

    def fire(self) -> None:
        for request in self.input.tokens:
            self.output.send(dataclasses.replace(request, token=-request.token))


class Unwrap(Actor):
    """Sends tokens where requests are asked for."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        for request in self.input.tokens:
            self.output.send(request.token)


CLASSES = """
composites:
  Wire:
    inputs: [request]
    outputs: [response]
    connections: [request -> response]
  Line:
    inputs: [request]
    outputs: [response]
    actors: {negate: {type: Negate}}
    connections: [request -> negate.input, negate.output -> response]
  Desk:
    parameters: {time: 300 ms}
    inputs: [request]
    outputs: [response, load]
    actors: {server: {type: Server, service_time: "${time}"}}
    connections: [request -> server.input, server.output -> response, server.size -> load]
  Crossing:
    inputs: [east, west]
    outputs: [response]
    actors:
      slow: {type: TimeDelay, delay: 500 ms}
      join: {type: Merge}
    connections: [west -> slow.input, east -> join.input, slow.output -> join.input, join.output -> response]
"""


PAIR = (
    CLASSES
    + """
actors:
  t: {type: Ticker, limit: 3}
  a: {type: Scale, factor: 2}
  b: {type: Scale, factor: 3}
  j: {type: Join}
connections: [t.output -> a.input, t.output -> b.input, t.output -> j.input, a.output -> j.input, b.output -> j.input]
aspects: {ASPECTS}
run: {stop: 4 s}
"""
)


def load(text: str, **changes: Any) -> Model:
    return engine_parts.load(text, types=[Negate, Unwrap], **changes)


def pair(woven: str, **changes: Any) -> Model:
    return load(PAIR.replace("{ASPECTS}", "{" + woven + "}"), **changes)


def run(model: Model) -> Results:
    return Simulation(model, keep_log=True).run()


def acts(results: Results, *events: str) -> list[tuple[float, str, str, Any]]:
    """What aspects did: when, what, where and with which token."""
    return [
        (record.tag.seconds, record.event, f"{record.actor}.{record.port}", record.value)
        for record in results.log.records
        if record.event in events
    ]


def sends(results: Results, *ports: str) -> list[tuple[Any, ...]]:
    found = ((r.tag, f"{r.actor}.{r.port}", r.value) for r in results.log.records if r.event == "send")
    return [send for send in found if not ports or send[1] in ports]


TWINS = (
    CLASSES
    + """
  Twin:
    inputs: [go]
    outputs: [gone]
    actors: {scale: {type: Scale}}
    connections: [go -> scale.input, scale.output -> gone]
    aspects: {net: {type: Desk, time: "${0.1 * (index + 1)}", at: PLACE}}
actors: {t: {type: Ticker, limit: 2}, twin: {type: Twin, count: 3}}
connections: ["t.output -> twin[*].go"]
run: {stop: 2 s}
"""
)
