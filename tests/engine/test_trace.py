"""A traced run reports causes, and is otherwise the same."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

from epicycle.actors import Tag
from epicycle.aspects import JoinPoint, PortAspect
from epicycle.runner.execution.engine import Firing, Simulation, Tracer
from epicycle.runner.model.build.load import load_model
from tests.engine.engine_parts import Script, load

SECOND = 10**9


class Hold(PortAspect):
    """Keeps tokens for a quarter of a second."""

    events = ("held",)

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.act("held", token)
        point.forward(token, 0.25)


class Worker(Script):
    """Sends what it reads, twice: at once and when SimPy resumes it."""

    def run(self) -> Generator[Any, Any, None]:
        while True:
            token = yield self.read(self.input)
            self.output.send(token)
            yield self.environment.timeout(0.5)
            self.output.send(-token)
            yield self.wait(0.25)


def trace(text: str, until: float, *paths: str, **options: Any) -> list[Firing]:
    """The firings of some actors, in a run that sends what an untraced one does."""
    model = load(text, **options)
    found: list[Firing] = []
    tracer = Tracer({path: model.graph.actors[path] for path in paths or model.graph.actors}, found.append)
    digest = Simulation(model, tracer=tracer).run(until=until).digest
    assert digest == Simulation(model).run(until=until).digest
    return found


def why(firing: Firing) -> tuple[Any, ...]:
    """A firing in short."""
    arrivals = [(f"{a.port}[{a.channel}]", a.token, a.source, a.sent) for a in firing.arrivals]
    records = [(r.event, r.port, r.channel, r.value) for r in firing.records]
    return firing.tag, firing.actor, firing.outside, firing.wakes, arrivals, records


def test_tokens_come_from_where_they_were_sent() -> None:
    found = trace(
        """
actors: {a: {type: Ticker, limit: 2}, b: {type: Ticker, period: 0.5, limit: 2}, join: {type: Join}}
connections:
  - {from: a.output, to: join.input, delay: 0.5 s}
  - b.output -> join.input
""",
        9,
        "join",
    )
    half = Tag(SECOND // 2, 1)
    assert [why(firing) for firing in found] == [
        (tag, "join", "", [], arrivals, [("send", "output", None, sent)])
        for tag, arrivals, sent in [
            (Tag(0, 1), [("input[1]", 0, "b.output", Tag(0, 1))], [[], [0]]),
            (half, [("input[0]", 0, "a.output", Tag(0, 1)), ("input[1]", 1, "b.output", half)], [[0], [1]]),
            (Tag(3 * SECOND // 2, 1), [("input[0]", 1, "a.output", Tag(SECOND, 1))], [[1], []]),
        ]
    ]


def test_wake_ups_say_when_they_were_asked_for() -> None:
    found = trace("actors: {t: {type: Ticker, limit: 3}}", 9)
    assert [(firing.tag, firing.wakes) for firing in found] == [
        (Tag(0, 1), [None]),
        (Tag(SECOND, 1), [Tag(0, 1)]),
        (Tag(2 * SECOND, 1), [Tag(SECOND, 1)]),
    ]


def test_borders_and_aspects_on_the_way() -> None:
    """A token kept by a border or an aspect still comes from its sender, and an aspect's own act is reported."""
    text = """
composites:
  C:
    inputs: [in]
    director: {start: 5}
    actors: {probe: {type: Probe}}
    connections: [in -> probe.input]
actors: {t: {type: Ticker, limit: 1}, join: {type: Join}, c: {type: C}, d: {type: Scale}}
connections: [t.output -> join.input, join.output -> c.in, t.output -> c.in, t.output -> d.input]
aspects: {hold: {type: Hold, at: d.output}, slow: {type: Hold, at: join.input}}
"""
    found = trace(text, 9, "c.probe", "d", types=[Hold])
    late = Tag(SECOND // 4, 1)
    assert [why(firing) for firing in found] == [
        (Tag(0, 1), "d", "", [], [("input[0]", 0, "t.output", Tag(0, 1))], [("held", "output", None, 0.0)]),
        (Tag(0, 1), "c.probe", "", [], [("input[1]", 0, "t.output", Tag(0, 1))], []),
        (late, "d", "released", [], [], [("send", "output", None, 0.0)]),
        (late, "c.probe", "", [], [("input[0]", [[0]], "join.output", late)], []),
    ]


def test_processes_are_fired_or_resumed() -> None:
    text = "actors: {t: {type: Ticker, limit: 2}, w: {type: Worker}}\nconnections: [t.output -> w.input]"
    found = trace(text, 9, "w", types=[Worker])
    quarter = SECOND // 4
    assert [why(firing) for firing in found] == [
        (Tag(0, 1), "w", "", [None], [("input[0]", 0, "t.output", Tag(0, 1))], [("send", "output", None, 0)]),
        (Tag(2 * quarter, 1), "w", "resumed", [], [], [("send", "output", None, 0)]),
        (Tag(3 * quarter, 1), "w", "", [Tag(2 * quarter, 1)], [], []),
        (Tag(SECOND, 1), "w", "", [], [("input[0]", 1, "t.output", Tag(SECOND, 1))], [("send", "output", None, 1)]),
        (Tag(6 * quarter, 1), "w", "resumed", [], [], [("send", "output", None, -1)]),
        (Tag(7 * quarter, 1), "w", "", [Tag(6 * quarter, 1)], [], []),
    ]


def test_a_process_that_is_resumed_after_a_release_is_not_released() -> None:
    text = (
        "actors: {t: {type: Ticker, limit: 1}, d: {type: Scale}, w: {type: Worker}}\n"
        "connections: ['t.output -> d.input, w.input']\naspects: {hold: {type: Hold, at: d.output}}"
    )
    found = trace(text, 0.5, "d", "w", types=[Hold, Worker])
    assert [(firing.tag.time * 4 / SECOND, firing.actor, firing.outside) for firing in found] == [
        (0.0, "d", ""), (0.0, "w", ""), (1.0, "d", "released"), (2.0, "w", "resumed"),
    ]  # fmt: skip


def test_every_send_of_a_large_model_is_told_once() -> None:
    model = load_model("collision_avoidance", set=["observers=1", "disturbance=0.5"])
    found: list[Firing] = []
    simulation = Simulation(model, keep_log=True, tracer=Tracer(model.graph.actors, found.append))
    results = simulation.run(until=0.3)
    # What aspects do at inputs is not the doing of the actor behind.
    outputs = {port.path for actor in model.graph.actors.values() for port in actor.outputs.values()}
    told = [record for record in simulation.log.records if f"{record.actor}.{record.port}" in outputs]
    assert [id(record.value) for firing in found for record in firing.records] == [id(record.value) for record in told]
    assert len(told) < results.events
    assert sum(not firing.outside for firing in found) == results.firings
    assert results.digest == Simulation(model).run(until=0.3).digest
    sent = {(record.tag, f"{record.actor}.{record.port}") for record in told if record.event == "send"}
    for firing in found:
        assert {(arrival.sent, arrival.source) for arrival in firing.arrivals} <= sent
        assert firing.arrivals or firing.wakes
