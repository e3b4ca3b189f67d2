"""Observation: what probes, counters and assertions tell of a run, and that they leave all else as it is."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.actors.expression import ExpressionError, PortFormula
from epicycle.runner import ActorError, ModelError, load_model
from epicycle.runner.execution.engine import Results
from tests.engine.engine_parts import simulate

PARTS = """
actors:
  t: {{type: Ticker, period: 1 ms}}
  a: {{type: Scale, factor: 10}}
connections: [t.output -> a.input]
aspects: {{{}}}
run: {{stop: 5 ms}}
"""


def run(aspects: str) -> Results:
    results: Results = simulate(PARTS.format(aspects))[1]
    return results


def acts(results: Results) -> list[tuple[str, str, float, Any]]:
    return [
        (each.event, f"{each.actor}.{each.port}", each.tag.time / 1e6, each.value)
        for each in results.log.records
        if each.aspect
    ]


def sends(results: Results) -> list[Any]:
    return [each for each in results.log.records if not each.aspect]


def test_probe() -> None:
    plain = run("")
    for at, tokens in (("a.input", range(6)), ("t.output", range(6)), ("a.output", range(0, 60, 10))):
        results = run(f"watch: {{type: Probe, at: {at}, from: 2 ms}}")
        seen = [(tick, tokens[tick]) for tick in range(2, 6)]
        assert acts(results) == [("seen", at, float(tick), token) for tick, token in seen]
        assert sends(results) == sends(plain)
        assert results.aspects == {"watch": {"seen": 4}}
        signal = results[f"watch@{at}"]
        assert list(zip(signal.times, signal.tokens, strict=True)) == [(tick * 1e-3, token) for tick, token in seen]


def test_count() -> None:
    plain = run("")
    results = run("n: {type: Count, at: [a.input, a.output], by: token >= 3}, all: {type: Count, at: t.output}")
    assert results.aspects == {"n": {"counted": 12, "counted true": 8, "counted false": 4}, "all": {"counted": 6}}
    assert results.digest == plain.digest
    both = run("n: {type: Count, at: a.output, by: t.output + token}").aspects["n"]
    assert both == {"counted": 6} | {f"counted {11.0 * tick}": 1 for tick in range(6)}


def test_count_tells_a_hundred_values_apart() -> None:
    text = PARTS.format("n: {type: Count, at: [t.output, a.input], by: token}").replace("stop: 5 ms", "stop: 149 ms")
    counts = simulate(text)[1].aspects["n"]
    assert counts.pop("counted") == 300
    assert counts.pop("counted others") == 100
    assert counts == {f"counted {tick}": 2 for tick in range(100)}


def test_assert() -> None:
    plain = run("")
    results = run(
        "small: {type: Assert, at: a.input, that: token < 4}, sure: {type: Assert, at: a.input, that: token < 9}"
    )
    assert acts(results) == [("violated", "a.input", 4.0, 4), ("violated", "a.input", 5.0, 5)]
    assert sends(results) == sends(plain)
    assert results.aspects == {"small": {"violated": 2}, "sure": {"violated": 0}}
    assert results.stopped == "stop time"


def test_assert_over_ports() -> None:
    # Of what has sent nothing there is nothing to say.
    assert [act[2] for act in acts(run("low: {type: Assert, at: a.input, that: a.output < 30}"))] == [4.0, 5.0]
    assert acts(run("same: {type: Assert, at: a.output, that: token == 10 * t.output}")) == []


def test_assert_that_stops_the_run() -> None:
    results = run("small: {type: Assert, at: t.output, that: token < 3, on_violation: stop}")
    assert results.stopped == "aspect small"
    assert results.end == 0.003
    assert results.aspects == {"small": {"violated": 1}}
    assert sends(results) == [each for each in sends(run("")) if each.tag.time <= 3e6]  # the tag is handled to its end


def test_assert_that_fails() -> None:
    with pytest.raises(ActorError) as caught:
        run("small: {type: Assert, at: a.input, that: token < 3, on_violation: fail}")
    assert str(caught.value).splitlines()[0] == (
        "aspect small failed in pass_token() at a.input at (0.003 s, 1): "
        "the invariant 'token < 3' does not hold for the token 3"
    )


@pytest.mark.parametrize(
    ("aspect", "message"),
    [
        (
            "{type: Assert, at: a.input}",
            "aspect x: Assert needs a value for 'that'",
        ),
        (
            "{type: Assert, at: a.input, that: tken < 3}",
            (
                "aspect x.that: 'tken < 3' is not an expression over ports: unknown name 'tken': "
                "a port is written 'actor.port', and 'token' is known"
            ),
        ),
        (
            "{type: Assert, at: a.input, that: 1 < 3}",
            (
                "aspect x.that: '1 < 3' is not an expression over ports: it names nothing: "
                "write 'token' or a port as 'actor.port'"
            ),
        ),
        (
            "{type: Assert, at: a.input, that: a.outptu < 3}",
            "aspect x: that: 'a.outptu' names no output port, did you mean 'a.output'?",
        ),
        (
            "{type: Assert, at: a.input, that: a.input < 3}",
            "aspect x: that: a.input is an input port, but an output port is needed",
        ),
        (
            "{type: Assert, at: a.input, that: token < 3, on_violation: halt}",
            "aspect x.on_violation: 'halt' is not one of note, stop, fail",
        ),
    ],
)
def test_wrong_observers(aspect: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        run(f"x: {aspect}")
    assert message in str(caught.value)


def test_fields_of_tokens_are_known_before_the_run() -> None:
    with pytest.raises(ModelError) as caught:
        load_model(
            "collision_avoidance", aspects=["safe=Assert,at=*.state,that=token.sped < 3 and token.position[0] < 9"]
        )
    assert str(caught.value).splitlines()[0::3] == [
        "command line:1:38: error: aspect safe: that: token.sped at obstacle.state: BodyState has no field 'sped'",
        "   help: its fields: position, velocity, time",
    ]


def test_formula_over_a_token_and_ports() -> None:
    formula = PortFormula("token.x[0] + a.b.c * token['y'] < token.x[1]", ["token"])
    assert formula.references == ("a.b.c",)
    assert formula.given_fields == (("token.x", ("x",)),)
    assert formula([2.0], token={"x": [1, 8], "y": 3}) is True
    assert formula([2.0], token={"x": [1, 7], "y": 3}) is False
    assert PortFormula("tokens.x + token", ["token"]).references == ("tokens.x",)
    with pytest.raises(ExpressionError, match="unknown name 'tag'"):
        PortFormula("token > tag", ["token"])
