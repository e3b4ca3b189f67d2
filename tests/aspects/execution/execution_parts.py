"""Models with aspects at actors, and what these did."""

from __future__ import annotations

from typing import Any

from epicycle.runner import Model
from epicycle.runner.execution.engine import Results
from tests.engine.engine_parts import sends, simulate

CHAIN = """
actors:
  t: {{type: Ticker, period: 1 s}}
  a: {{type: Scale}}
  probe: {{type: Probe}}
connections: [t.output -> a.input, a.output -> probe.input]
aspects:
  it: {{{}}}
run: {{stop: 5 s}}
"""


def chain(aspect: str, **options: Any) -> tuple[Model, Results]:
    return simulate(CHAIN.format(aspect), **options)


def sent(results: Results, actor: str = "a") -> list[tuple[float, Any]]:
    return [(time, value) for time, _, _, value in sends(results, actor)]


def acts(results: Results) -> list[tuple[float, str, str, Any]]:
    return [(r.tag.seconds, r.event, r.actor, r.value) for r in results.log.records if r.event != "send"]


PARTS = """
composites:
  Pair:
    inputs: [go]
    outputs: [gone]
    actors: {{one: {{type: Scale}}, two: {{type: Scale, tags: [slow]}}}}
    connections: [go -> one.input, one.output -> two.input, two.output -> gone]
actors:
  t: {{type: Ticker, period: 1 ms}}
  a: {{type: Scale, tags: slow}}
  pair: {{type: Pair, count: 2}}
  none: {{type: Pair, count: 0}}
connections: [t.output -> a.input, "t.output -> pair[*].go"]
aspects:
  it: {{{}}}
run: {{stop: 9 ms}}
"""
