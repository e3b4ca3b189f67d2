"""Metrics follow their definitions, over tokens and over time; where there is no value, the reason is given."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epicycle.runner.model.catalogue.metrics import TAKES, MetricSpec
from epicycle.runner.show.outcome import summary_object
from tests.engine.engine_parts import SECOND, measured, simulate

NUMBERS = st.floats(-1e6, 1e6) | st.integers(-1000, 1000)
GAPS = st.integers(0, 5 * SECOND)  # ns between tokens; 0: two at one time
SEQUENCES = st.lists(st.tuples(GAPS, NUMBERS), min_size=1, max_size=40)


def timed(sequence: list[tuple[int, Any]]) -> list[tuple[str, int, Any]]:
    """Tokens at their times, from the gaps between them."""
    time, found = 0, []
    for gap, value in sequence:
        time += gap
        found.append(("a.out", time, value))
    return found


def spells(tokens: list[tuple[str, int, Any]], start: int, end: int) -> list[tuple[Any, int]]:
    """Each value with its duration in ns between start and end."""
    edges = [time for _, time, _ in tokens[1:]] + [end]
    return [
        (value, min(edge, end) - max(time, start))
        for (_, time, value), edge in zip(tokens, edges, strict=True)
        if min(edge, end) > max(time, start)
    ]


@given(SEQUENCES, st.integers(0, 5 * SECOND), st.sampled_from([0.0, 2.5]))
def test_what_counts_time_is_weighted_by_it(sequence: list[tuple[int, Any]], rest: int, after: float) -> None:
    tokens = timed(sequence)
    end = tokens[-1][1] + rest
    stands = spells(tokens, round(after * SECOND), end)
    total = sum(length for _, length in stands)
    if total == 0:
        assert measured(tokens, end, take="time_mean", after=after).value is None
        return
    mean = sum(Fraction(value) * length for value, length in stands) / total
    variance = sum((Fraction(value) - mean) ** 2 * length for value, length in stands) / total
    scale = max(abs(value) for value, _ in stands) or 1.0
    assert measured(tokens, end, take="time_mean", after=after).value == pytest.approx(float(mean), abs=1e-14 * scale)
    found = measured(tokens, end, take="time_std", after=after).value
    assert found == pytest.approx(math.sqrt(variance), rel=1e-9, abs=1e-7 * scale)
    positive = sum(length for value, length in stands if value > 0)
    assert measured(tokens, end, take="share", when="value > 0", after=after).value == positive / total
    for p in (0.0, 0.3, 0.5, 1.0):
        quantile = measured(tokens, end, take="time_quantile", p=p, after=after).value
        assert sum(length for value, length in stands if value <= quantile) >= Fraction(p) * total
        assert sum(length for value, length in stands if value < quantile) < max(Fraction(p) * total, 1)
    if end > round(after * SECOND):
        late = sum(time >= round(after * SECOND) for _, time, _ in tokens)
        rate = measured(tokens, end, take="rate", after=after).value
        assert rate == pytest.approx(late * SECOND / (end - round(after * SECOND)))


@given(SEQUENCES, st.sampled_from([0.0, 2.5]))
def test_what_counts_tokens_is_numpys(sequence: list[tuple[int, Any]], after: float) -> None:
    tokens = timed(sequence)
    end = max(tokens[-1][1], 3 * SECOND)
    values = [float(value) for _, time, value in tokens if time >= after * SECOND]
    found = {
        take: measured(tokens, end, take=take, after=after).value
        for take in ("count", "sum", "min", "max", "mean", "std")
    }
    assert found["count"] == len(values)
    assert found["sum"] == math.fsum(values)
    if not values:
        assert (found["mean"], found["std"], found["min"]) == (None, None, None)
        return
    assert (found["min"], found["max"]) == (min(values), max(values))
    assert found["mean"] == math.fsum(values) / len(values)
    if len(values) > 1:
        assert found["std"] == pytest.approx(np.std(values, ddof=1), rel=1e-9, abs=1e-6)
    for p in (0.0, 0.1, 0.5, 0.9, 1.0):
        quantile = measured(tokens, end, take="quantile", p=p, after=after).value
        assert quantile == pytest.approx(np.quantile(values, p), rel=1e-12, abs=1e-9)


def test_the_mean_of_a_queues_size_is_one_over_time() -> None:
    """Two come at once, both are gone a second later, and then nothing happens for nine seconds."""
    tokens = [("q.size", 0, 1), ("q.size", 0, 2), ("q.size", SECOND, 1), ("q.size", SECOND, 0)]
    assert measured(tokens, 10 * SECOND, ("q.size",), take="mean").value == 1.0
    assert measured(tokens, 10 * SECOND, ("q.size",), take="time_mean").value == 0.2
    assert measured(tokens, 10 * SECOND, ("q.size",), take="share", when="value == 2").value == 0.1


def test_what_holds_before_the_first_token_is_given_or_does_not_count() -> None:
    tokens = [("a.out", 6 * SECOND, 4)]
    assert measured(tokens, 10 * SECOND, take="time_mean").value == 4.0
    assert measured(tokens, 10 * SECOND, take="time_mean", initial=0).value == 1.6
    assert measured([], 10 * SECOND, take="time_mean", initial=3).value == 3.0
    assert measured(tokens, 10 * SECOND, take="share", when="value == 'up'", initial="up").value == 0.6


def test_a_quantile_over_time_counts_each_nanosecond() -> None:
    tokens = [("a.out", value, value) for value in range(4)]  # 0, 1 and 2 for 1 ns each, then 3
    found = [measured(tokens, end, take="time_quantile", p=0.5).value for end in (4, 5, 6, 7)]
    assert found == [1.0, 2.0, 2.0, 3.0]


def test_an_integral_is_of_values_times_seconds() -> None:
    tokens = [("a.out", 2 * SECOND, 3), ("a.out", 6 * SECOND, -0.5)]
    assert measured(tokens, 10 * SECOND, take="integral").value == 10.0  # 4 * 3 - 4 * 0.5
    assert measured(tokens, 10 * SECOND, take="integral", initial=1, after=1.0).value == 11.0
    assert measured(tokens, 10 * SECOND, take="integral", unit="W", to="mW*h").value == pytest.approx(10 / 3.6)
    states = [("a.out", 2 * SECOND, "up"), ("a.out", 6 * SECOND, "down"), ("a.out", 9 * SECOND, "up")]
    assert measured(states, 10 * SECOND, take="duration", when="value == 'up'").value == 5.0
    assert measured(states, 10 * SECOND, take="duration", when="value == 'up'", initial="up", to="ms").value == 7000.0
    assert [MetricSpec(**each).own_unit for each in ({"take": "integral"}, {"take": "integral", "unit": "m/s"})] == [
        "",
        "m/s*s",
    ]


@given(SEQUENCES, st.integers(0, 20 * SECOND), st.sampled_from(sorted(TAKES)), st.sampled_from([None, 7]))
def test_until_is_as_if_the_run_had_stopped_then(
    sequence: list[tuple[int, Any]], until: int, take: str, initial: int | None
) -> None:
    tokens, kind = timed(sequence), TAKES[take]
    options: dict[str, Any] = {"p": {"p": 0.5}, "when": {"when": "value > 0"}}.get(kind.needs, {})
    options |= {"initial": initial} if "initial" in kind.options else {}
    options |= {"interval": 0.9} if "interval" in kind.options else {}
    end = max(tokens[-1][1], until) + SECOND
    early = [each for each in tokens if each[1] <= until]
    assert measured(tokens, end, take=take, until=until / SECOND, **options) == measured(
        early, until, take=take, **options
    )


def test_the_value_at_a_time_is_the_last_until_then() -> None:
    tokens = [("a.out", 2 * SECOND, "on"), ("a.out", 5 * SECOND, "off")]
    at = {until: measured(tokens, 9 * SECOND, initial="new", until=until).value for until in (1.0, 2.0, 4.9, 5.0)}
    assert at == {1.0: "new", 2.0: "on", 4.9: "on", 5.0: "off"}


def test_of_several_ports_each_counts_for_its_own_time() -> None:
    tokens = [("a", 0, 1), ("b", 5 * SECOND, 4)]
    ports = ("a", "b")
    assert measured(tokens, 10 * SECOND, ports, take="time_mean").value == 2.0  # (10 * 1 + 5 * 4) / 15
    assert measured(tokens, 10 * SECOND, ports, take="time_mean", initial=0).value == 1.5
    assert measured(tokens, 10 * SECOND, ports, take="rate").value == 0.2


@pytest.mark.parametrize(
    ("said", "tokens", "missing"),
    [
        ({"take": "mean"}, [], "no token came"),
        ({"take": "time_mean"}, [], "no token came"),
        ({"take": "quantile", "p": 0.5, "after": 1.0}, [(0, 1.0)], "no token came after 1 s"),
        ({"take": "std"}, [(0, 1.0)], "one token has no spread"),
        ({"take": "time_mean"}, [(2, 1.0)], "no time passed after the first token"),
        ({"take": "mean", "after": 9.0}, [(0, 1.0)], "the run ended at 2 s, before its warm-up of 9 s was over"),
        ({"take": "rate", "after": 9.0}, [(0, 1.0)], "the run ended at 2 s, before its warm-up of 9 s was over"),
        ({"take": "rate", "after": 2.0}, [], "no time passed"),
        ({"take": "last", "until": 3.0}, [(0, 1.0)], "the run ended at 2 s, before 3 s"),
        ({"take": "integral", "until": 1.0}, [(2, 1.0)], "no token came"),
        ({"take": "mean"}, [(1, math.nan)], "a.out sent nan at 1 s"),
        ({"take": "max"}, [(1, math.nan)], "a.out sent nan at 1 s"),
        ({"take": "time_std"}, [(0, 1.0), (1, -math.inf)], "a.out sent -inf at 1 s"),
        ({"take": "sum"}, [(1, "many")], "a.out sent many, which is not a number, at 1 s"),
        ({"take": "mean"}, [(1, np.zeros(2))], "a.out sent [0, 0], which is not a number, at 1 s"),
        ({"take": "mean"}, [(0, 1e308), (1, 1e308)], "it is too large for a number"),
        ({"take": "sum"}, [(0, 10**400)], "a.out sent " + repr(10**400)[:97] + "..., which is not a number, at 0 s"),
        ({"take": "std"}, [(0, 1e300), (1, -1e300)], "it is too large for a number"),
        ({"take": "mean", "after": "mser5"}, [(0, 1.0)], "MSER-5 needs 50 tokens, but 1 came"),
        ({"take": "mean", "after": "mser5"}, [(1, math.nan)], "a.out sent nan at 1 s"),
        ({"take": "time_mean", "after": "mser5"}, [(1, 1.0)] * 60, "MSER-5 needs time between tokens"),
        (
            {"take": "mean", "after": "mser5"},
            [(1, float(each)) for each in range(100)],
            "by MSER-5, it does not settle in the first half of the run: make the run longer",
        ),
        (
            {"take": "share", "when": "value > 0"},
            [(0, "up")],
            (
                "a.out sent up, for which 'value > 0' cannot be evaluated ('value > 0': value > 0: > cannot compare a "
                "text with a number, with value = 'up'), at 0 s"
            ),
        ),
    ],
)  # fmt: skip
def test_why_there_is_no_value(said: dict[str, Any], tokens: list[tuple[int, Any]], missing: str) -> None:
    end = SECOND if "time between" in missing else 2 * SECOND
    found = measured([("a.out", time * SECOND, token) for time, token in tokens], end, **said)
    assert found.missing == missing
    assert (found.value, found.interval) == (None, None)
    assert found.remarks == [f"no value, because {missing}"]


def test_what_came_before_the_warm_up_was_over_spoils_nothing() -> None:
    tokens = [("a.out", 0, math.nan), ("a.out", SECOND, 1.0), ("a.out", 2 * SECOND, 3.0)]
    assert measured(tokens, 3 * SECOND, take="mean", after=1.0).value == 2.0
    assert measured(tokens, 3 * SECOND, take="time_mean", after=1.0).value == 2.0
    assert measured(tokens, 3 * SECOND, take="time_mean", after=0.5).missing == "a.out sent nan at 0 s"


def test_a_run_is_not_lost_for_a_metric_of_something_odd() -> None:
    _, results = simulate(
        "actors: {t: {type: Ticker, limit: 3}, odd: {type: Spread}, probe: {type: Probe}}\n"
        "connections: [t.output -> odd.input, odd.output -> probe.input]\n"
        "metrics: {up: {of: odd.output, take: share, when: value > 0}, last: {of: odd.output, take: count}}",
        until=2.5,
    )
    assert results.metrics["up"] is None
    assert results.outcomes["up"].missing.startswith("odd.output sent 0/0, for which 'value > 0' cannot be evaluated")
    assert results.metrics["last"] == 3


def test_time_runs_until_the_stop_time_only_if_that_ended_the_run() -> None:
    text = (
        "actors: {{t: {{type: Ticker, limit: {limit}}}}}\n"
        "metrics: {{mean: {{of: t.output, take: time_mean}}, rate: {{of: t.output, take: rate}}}}"
    )
    _, results = simulate(text.format(limit=100), until=2.5)
    assert results.stopped == "stop time"
    assert results.metrics == {"mean": 0.8, "rate": 1.2}  # (0 + 1 + 2 / 2) / 2.5, 3 / 2.5
    _, results = simulate(text.format(limit=3), until=2.5)
    assert results.stopped == "no events left"
    assert results.metrics == {"mean": 0.5, "rate": 1.5}  # at 2 s all is over


# -- how it is kept ---------------------------------------------------------------------------------------------------


# -- warm-up ----------------------------------------------------------------------------------------------------------


# -- intervals --------------------------------------------------------------------------------------------------------


def test_every_take_is_measured_somehow() -> None:
    tokens = [("a.out", place * SECOND, place % 3) for place in range(60)]
    needs: dict[str, dict[str, Any]] = {"p": {"p": 0.5}, "when": {"when": "value > 0"}}
    for take, kind in TAKES.items():
        options = needs.get(kind.needs, {})
        found = measured(tokens, 60 * SECOND, take=take, **options)
        assert found.value is not None, take
        assert list(MetricSpec(take=take, **options).misfits()) == []
        if kind.settles:
            assert measured(tokens, 60 * SECOND, take=take, after="mser5", **options).value is not None, take


def test_what_there_is_to_say_is_in_results_and_json() -> None:
    _, results = simulate(
        "actors: {t: {type: Ticker, period: 0.5}, s: {type: Scale, factor: -1}}\n"
        "connections: [t.output -> s.input]\n"
        "metrics:\n"
        "  rate: {of: t.output, take: rate, interval: 0.9, to: 1/min}\n"
        "  late: {of: s.output, take: mean, after: 1 h}\n"
        "  last: {of: s.output}\n",
        until=100.25,
    )
    rate, late = results.outcomes["rate"], results.outcomes["late"]
    assert results.metrics == {"rate": pytest.approx(201 / 100.25 * 60), "late": None, "last": -200.0}
    assert results.units == {"rate": "1/min", "late": "", "last": ""}
    assert list(results.intervals) == ["rate"]
    assert rate.interval is not None
    assert rate.interval.low < 120 < rate.interval.high
    reason = "the run ended at 100.25 s, before its warm-up of 3600 s was over"
    assert late.missing == reason
    told = summary_object(results)
    assert told["metrics"]["late"] is None
    assert told["outcomes"] == {
        "rate": {
            "level": 0.9,
            "low": rate.interval.low,
            "high": rate.interval.high,
            "batches": 20,
            "autocorrelation": rate.interval.autocorrelation,
        },
        "late": {"missing": reason},
    }
    assert f"no value, because {reason}" in str(results)
