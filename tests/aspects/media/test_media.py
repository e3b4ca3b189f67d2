"""Media: what declarations share, the time that they go by, what they report, and errors in what is decided later."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import pytest

from epicycle.aspects import JoinPoint, Medium
from epicycle.runner import ActorError, Results, Simulation
from epicycle.runner.execution.engine import Firing, Tracer
from epicycle.runner.model.build.load import load_model
from epicycle.runner.show.outcome import summary_object
from tests.engine.engine_parts import TYPES, load, seen, simulate


class Relay(Medium):
    """Notes who sends and when, and delivers a second later; a test's own medium."""

    events: ClassVar[tuple[str, ...]] = ("relayed",)
    reports: ClassVar[dict[str, str]] = {"last": "s", "sources": "1"}

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.shared.setdefault("passed", []).append((point.now, point.source))
        point.later(1.0, lambda what: self._deliver(what, point), token)

    def _deliver(self, token: Any, point: JoinPoint) -> None:
        point.act("relayed", token, self.length_of(token))
        point.forward(token)

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        passed = shared.get("passed")
        return {"last": passed[-1][0] if passed else None, "sources": len({source for _, source in passed or ()})}


TEXT = """
model: media
composites:
  Slow:
    inputs: [go]
    outputs: [gone]
    director: {start: 100 s, drift: 2}
    actors: {inner: {type: Scale}}
    connections: [go -> inner.input, inner.output -> gone]
actors:
  t: {type: Ticker, period: 4 s}
  a: {type: Scale}
  b: {type: Scale}
  join: {type: Join}
  slow: {type: Slow}
connections: [t.output -> a.input, t.output -> b.input, "[a.output, b.output] -> join.input", t.output -> slow.go]
aspects:
  %s
run: {stop: 9 s, record: "**.output"}
"""


def run(tmp_path: Path, aspects: str) -> Results:
    path = tmp_path / "media.yaml"
    path.write_text(TEXT % aspects, encoding="utf-8")
    return Simulation(load_model(path, types=[*TYPES, Relay]), keep_log=True).run()


def test_declarations_share_a_medium_by_its_name(tmp_path: Path) -> None:
    results = run(
        tmp_path,
        """
  one: {type: Relay, medium: air, at: a.input, message_length: 2}
  two: {type: Relay, medium: air, at: slow.inner.input, message_length: 3}
  other: {type: Relay, at: join.input}
  idle: {type: Relay, at: b.input, from: 100 s}
""",
    )
    assert results.aspects == {
        "one": {"relayed": 3, "last": 8.0, "sources": 2},
        "two": {"relayed": 3, "last": 8.0, "sources": 2},
        "other": {"relayed": 5, "last": 9.0, "sources": 2},
        "idle": {"relayed": 0, "last": None, "sources": 0},
    }
    assert summary_object(results)["aspects"] == results.aspects
    assert ("idle", "last", "-") in [row for table in results._tables() for row in table.rows]
    # Model time, though the composite's own goes twice as fast.
    assert [tag.seconds for tag in results["slow.inner.output"].tags] == [1.0, 5.0, 9.0]
    details = [(r.aspect, r.value[1]) for r in results.log.records if r.event == "relayed" and r.aspect != "other"]
    assert details == [("one", 2.0), ("two", 3.0)] * 3


def test_an_error_in_what_is_decided_later_names_the_aspect(tmp_path: Path) -> None:
    with pytest.raises(ActorError) as caught:
        run(tmp_path, "one: {type: Relay, at: a.input, length_field: bits}")
    assert str(caught.value).splitlines()[0] == (
        "aspect one failed in later() at a.input at (1 s, 1): a token of type int has no fields"
    )


TEAM = """
parameters: {{robots: 3}}
composites:
  Robot:
    inputs: [tick, heard]
    outputs: [plan]
    actors: {{planner: {{type: Scale}}, ear: {{type: Probe}}}}
    connections: [tick -> planner.input, planner.output -> plan, heard -> ear.input]
actors:
  t: {{type: Ticker, period: 1 s}}
  robot: {{type: Robot, count: "${{robots}}"}}
  air: {{type: BroadcastChannel}}
connections:
  - t.output -> robot[*].tick
  - robot[*].plan -> air.input
  - air.output -> robot[*].heard
aspects:
  radio: {{type: RadioMedium, message_length: 10 kbit, rate: 1 Mbit/s, window: 1024, at: "{}"}}
run: {{stop: 99.9 s}}
"""


@pytest.mark.parametrize("at", ["robot[*].plan", "air.input", "robot[*].planner.output"])
@pytest.mark.parametrize("robots", [2, 8])
def test_a_broadcast_occupies_the_medium_once(at: str, robots: int) -> None:
    _, results = simulate(TEAM.format(at), set=[f"robots={robots}"])
    figures = results.aspects["radio"]
    # Within a second all come through; what collides costs an airtime once for two or more of them.
    assert figures["delayed"] == 100 * robots
    assert figures["dropped"] == 0
    sent = 100 * robots * 0.01
    assert figures["throughput"] == pytest.approx(sent / results.until)
    assert figures["utilisation"] <= (sent + 0.01 * figures["collided"] / 2) / results.until + 1e-12
    assert figures["utilisation"] >= figures["throughput"]
    stations = {record.value[0] for record in results.log.records if record.event == "delayed"}
    assert len(stations) == 100


def test_at_its_receivers_a_message_is_a_transmission_to_each() -> None:
    once, each = (simulate(TEAM.format(f"robot[*].{port}"))[1].aspects["radio"] for port in ("plan", "heard"))
    assert (once["delayed"], each["delayed"]) == (300, 600)
    assert each["throughput"] > 1.95 * once["throughput"]
    assert each["collided"] == 0  # all come from the channel, which is one station here


LINE = """
actors:
  t: {{type: Ticker, period: {period}}}
  a: {{type: Probe}}
connections: [t.output -> a.input]
aspects:
  {first}
  {second}
run: {{stop: 4 s}}
"""
DROP = "drop: {{type: PacketLoss, probability: {}, at: a.input}}"
BUS = "bus: {type: Bus, factor: 250 ms, at: a.input}"


@pytest.mark.parametrize("seed", [1, 2])
def test_order_shows(seed: int) -> None:
    def arrivals(first: str, second: str, period: str) -> tuple[list[tuple[float, int, Any]], float | None]:
        simulation, results = simulate(LINE.format(first=first, second=second, period=period), seed=seed)
        tokens = [(time, microstep, token) for time, microstep, tokens in seen(simulation, "a") for token in tokens]
        return tokens, results.aspects["bus"]["utilisation"]

    # What is dropped before the bus does not occupy it; what is dropped behind it does.  The same ones are dropped.
    before, busy_before = arrivals(DROP.format(0.5), BUS, "200 ms")
    behind, busy_behind = arrivals(BUS, DROP.format(0.5), "200 ms")
    assert busy_behind == pytest.approx(1.0)
    assert busy_before is not None
    assert busy_before < 0.8
    assert {token for _, _, token in behind} < {token for _, _, token in before}
    times = {token: time for time, _, token in behind}
    assert all(time == pytest.approx(0.25 * (token + 1)) for token, time in times.items())
    assert any(time < times[token] for time, _, token in before if token in times)
    # What drops nothing is not felt, wherever it stands: both arrive at (0.25, 1).
    for order in ((DROP.format(0), BUS), (BUS, DROP.format(0))):
        assert arrivals(*order, "10 s")[0] == [(0.25, 1, 0)]


def test_a_trace_tells_who_sent_what_has_waited() -> None:
    text = """
actors:
  t: {type: Ticker, period: 1 s, limit: 1}
  a: {type: Scale}
  b: {type: Scale}
  join: {type: Join}
connections: [t.output -> a.input, t.output -> b.input, "[a.output, b.output] -> join.input"]
aspects: {bus: {type: Bus, factor: 250 ms, at: join.input}}
run: {stop: 4 s}
"""
    model = load(text)
    firings: list[Firing] = []
    Simulation(model, tracer=Tracer(dict(model.graph.actors), firings.append)).run()
    found = [(arrival.source, f.tag.seconds) for f in firings if f.actor == "join" for arrival in f.arrivals]
    assert found == [("a.output", 0.25), ("b.output", 0.5)]
