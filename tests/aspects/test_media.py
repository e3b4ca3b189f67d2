"""Media: what declarations share, the time that they go by, what they report, and errors in what is decided later."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, ClassVar

import pytest

from epicycle.aspects import JoinPoint, Medium
from epicycle.runner import ActorError, Results, Simulation
from epicycle.runner.model import load_model
from epicycle.runner.show.summary import summary_object

sys.path.insert(0, str(Path(__file__).parent.parent / "engine"))
from engine_parts import TYPES


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
