"""Crashes: what is lost and what is kept, who goes down together, and how often."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from epicycle.actors import Actor, InputPort, OutputPort, PortParameter
from epicycle.runner import ActorError, Simulation
from epicycle.runner.execution.engine import Results, Tracer
from tests.engine.engine_parts import Plan, Script, load, sends, simulate


class Adder(Actor):
    """Sends the sum of all that came, with a constant to it."""

    input = InputPort(float)
    output = OutputPort(float)
    more = PortParameter(float, 0.0)

    def initialize(self) -> None:
        self.sum = 0.0

    def fire(self) -> None:
        self.sum += sum(self.input.tokens)
        self.output.send(self.sum + self.more)


CHAIN = """
actors:
  t: {{type: Ticker}}
  ones: {{type: Ramp, step: 0, init: 1}}
  sum: {{type: Adder}}
connections: [t.output -> ones.trigger, ones.output -> sum.input]
aspects:
  crash: {{type: CrashRestart, {}}}
run: {{stop: 9 s}}
"""


def run(aspect: str, text: str = CHAIN, **options: Any) -> Results:
    return simulate(text.format(aspect), types=[Adder], **options)[1]


def sent(results: Results, actor: str = "sum") -> list[tuple[float, Any]]:
    return [(time, value) for time, _, _, value in sends(results, actor)]


def acts(results: Results) -> list[tuple[float, str, str, Any]]:
    return [(r.tag.seconds, r.event, r.actor, r.value) for r in results.log.records if r.event != "send"]


@pytest.mark.parametrize(
    ("aspect", "expected"),
    [
        # What came at 3 and 4 s is lost, and so is the sum.
        ("at: sum", [(0, 1), (1, 2), (2, 3), (5, 1), (6, 2), (7, 3), (8, 4), (9, 5)]),
        ("at: sum, state: kept", [(0, 1), (1, 2), (2, 3), (5, 4), (6, 5), (7, 6), (8, 7), (9, 8)]),
        ("at: sum, tokens: kept", [(0, 1), (1, 2), (2, 3), (4.2, 1), (4.2, 2), *((t, t - 2) for t in range(5, 10))]),
        (
            "at: sum, state: kept, tokens: kept",
            [(0, 1), (1, 2), (2, 3), (4.2, 4), (4.2, 5), *((t, t + 1) for t in range(5, 10))],
        ),
    ],
)
def test_what_is_lost(aspect: str, expected: list[tuple[float, float]]) -> None:
    results = run(f"times: [2.5 s], repair: 1.7 s, {aspect}")
    assert sent(results) == expected
    skipped = [(3, "skipped", "sum", None), (4, "skipped", "sum", None)] if "tokens" not in aspect else []
    assert acts(results) == [(2.5, "crashed", "sum", None), *skipped, (4.2, "restarted", "sum", 1.7)]
    assert results.aspects["crash"] == {
        "crashed": 1, "restarted": 1, "skipped": len(skipped), "availability": pytest.approx(1 - 1.7 / 9)
    }  # fmt: skip


def test_a_source_begins_anew() -> None:
    lost = run("times: [2.5 s], repair: 1.7 s, at: t")
    assert sent(lost, "t") == [(0, 0), (1, 1), (2, 2), *((round(4.2 + n, 9), n) for n in range(5))]
    kept = run("times: [2.5 s], repair: 1.7 s, at: t, state: kept")  # the wake-up of 3 s comes when it can
    assert sent(kept, "t") == [(0, 0), (1, 1), (2, 2), *((round(4.2 + n, 9), 3 + n) for n in range(5))]


def test_crashes_of_all_kinds() -> None:
    results = run("times: [0 s, 1.5 s, 2 s, 6 s, 8.5 s], repair: 1 s, at: sum, from: 1 s, until: 8 s")
    assert [act for act in acts(results) if act[1] != "skipped"] == [
        (1.5, "crashed", "sum", None),  # that of 0 s is before the aspect is active
        (2.5, "restarted", "sum", 1.0),  # at 2 s it is down already
        (6.0, "crashed", "sum", None),  # and the token of 6 s comes too late
        (7.0, "restarted", "sum", 1.0),  # that of 7 s in time
    ]
    assert [time for time, event, _, _ in acts(results) if event == "skipped"] == [2.0, 6.0]
    dead = run("times: [0 s], repair: 100 s, at: sum")
    assert sent(dead) == []
    assert dead.aspects["crash"]["availability"] == 0
    assert acts(dead)[0] == (0.0, "crashed", "sum", None)
    short = run("times: [2.5 s], at: sum")
    assert sent(short) == [(0, 1), (1, 2), (2, 3), *((t, t - 2) for t in range(3, 10))]
    assert acts(short) == [(2.5, "crashed", "sum", None), (2.5, "restarted", "sum", 0.0)]
    conditional = run("times: [2.5 s, 6.5 s], repair: 1 s, at: sum, when: t.output > 4")
    assert [act[0] for act in acts(conditional) if act[1] == "crashed"] == [6.5]


def test_failures_after_a_crash_at_the_start() -> None:
    text = """
actors: {{t: {{type: Ticker, period: 50 s}}, sum: {{type: Adder, count: 1000}}}}
connections: ["t.output -> sum[*].input"]
aspects: {{crash: {{type: CrashRestart, {}}}}}
run: {{stop: 200 s}}
"""
    results = run('times: [0 s], repair: 1 s, mtbf: 10 s, at: "sum[*]"', text)
    failures: dict[str, float] = {}
    for time, event, actor, _ in acts(results):
        if event == "crashed" and time > 0:
            failures.setdefault(actor, time - 1)
    assert stats.kstest(list(failures.values()), stats.expon(scale=10).cdf).pvalue > 0.001


def test_a_composite_goes_down_as_a_whole() -> None:
    text = """
composites:
  Pair:
    inputs: [go]
    outputs: [gone]
    actors: {{first: {{type: Adder}}, second: {{type: Adder}}}}
    connections: [go -> first.input, first.output -> second.input, second.output -> gone]
actors: {{t: {{type: Ticker}}, ones: {{type: Ramp, step: 0, init: 1}}, pair: {{type: Pair, count: 2}}}}
connections: [t.output -> ones.trigger, "ones.output -> pair[*].go"]
aspects: {{crash: {{type: CrashRestart, {}}}}}
run: {{stop: 400 s}}
"""
    results = run('mtbf: 20 s, repair: 5 s, at: "pair[*]"', text)
    crashes = [(time, actor) for time, event, actor, _ in acts(results) if event == "crashed"]
    assert {actor for _, actor in crashes} == {"pair[0]", "pair[1]"}
    assert 20 < len(crashes) < 45
    begins = [
        [value for _, value in sent(results, f"pair[{i}].{part}")].count(1)
        for i in (0, 1)
        for part in ("first", "second")
    ]
    assert begins[0] == begins[1] > 5  # whenever one begins anew, so does the other
    assert begins[2] == begins[3] > 5
    alone = run('mtbf: 20 s, repair: 5 s, at: ["pair[0]", "!pair[0].second"]', text)
    assert [act for act in acts(alone) if act[1] == "crashed"] == [
        (time, "crashed", actor, None) for time, actor in crashes if actor == "pair[0]"
    ]  # a unit has a stream of its own
    assert [value for _, value in sent(alone, "pair[0].second")].count(1) == 1


def test_availability_and_the_law_of_failures() -> None:
    """MTBF / (MTBF + MTTR), and exponential times between failures, over many units."""
    text = """
actors: {{t: {{type: SingleEvent, value: 1.0}}, a: {{type: Scale, count: 40}}}}
connections: ["t.output -> a[*].input"]
aspects: {{crash: {{type: CrashRestart, {}}}}}
run: {{stop: 3000 s}}
"""
    results = run(
        'mtbf: 30 s, repair: {{type: Exponential, mean: 10 s}}, at: "a[*]"'.replace("{{", "{").replace("}}", "}"), text
    )
    crashed: dict[str, list[float]] = {}
    restarted: dict[str, list[float]] = {}
    down: dict[str, float] = {}
    for time, event, actor, value in acts(results):
        (crashed if event == "crashed" else restarted).setdefault(actor, []).append(time)
        if event == "restarted":
            down[actor] = down.get(actor, 0.0) + value
    up = [b - a for actor in crashed for a, b in zip(restarted[actor], crashed[actor][1:], strict=False)]
    repairs = [b - a for actor in crashed for a, b in zip(crashed[actor], restarted[actor], strict=False)]
    assert len(up) > 2000
    assert stats.kstest(up, "expon", (0, 30)).pvalue > 0.001
    assert stats.kstest(repairs, "expon", (0, 10)).pvalue > 0.001
    # Of one unit over the time T, the variance of availability is 2 MTBF^2 MTTR^2 / (MTBF + MTTR)^3 / T.
    error = stats.norm.ppf(0.9995) * np.sqrt(2 * 30**2 * 10**2 / 40**3 / 3000 / 40)
    found = results.aspects["crash"]["availability"]
    assert found is not None
    assert abs(found - 0.75) < error < 0.02
    assert found == pytest.approx(1 - sum(down.values()) / (3000 * 40), abs=2e-3)


def test_what_has_begun_is_lost_or_finished() -> None:
    """Before and behind an execution time, and on a processor: what a crash ends does not keep others waiting."""
    for order in (["crash", "slow"], ["slow", "crash"]):
        for state, expected in [("lost", [1.6, 5.6, 7.2, 8.8]), ("kept", [1.6, 4.0, 5.6, 7.2, 8.8])]:
            aspects = {
                "crash": f"times: [2.5 s], repair: 1.5 s, state: {state}, tokens: kept, type: CrashRestart",
                "slow": "time: 1.6 s, type: ExecutionTime",
            }
            lines = "".join(f"  {name}: {{{aspects[name]}, at: a}}\n" for name in order)
            text = f"""
actors: {{t: {{type: Ticker, period: 1.8 s}}, a: {{type: Scale}}}}
connections: [t.output -> a.input]
aspects:
{lines}run: {{stop: 9 s}}
"""
            # That of 1.8 s, which would be over at 3.4 s, is killed at 2.5 s, or sends at the repair.
            times = [time for time, _ in sent(simulate(text)[1], "a")]
            assert times == pytest.approx(expected), (order, state)
    text = """
actors: {t: {type: Ticker, limit: 1}, a: {type: Scale}, b: {type: Scale}, c: {type: Scale}}
connections: [t.output -> a.input, t.output -> b.input, t.output -> c.input]
aspects:
  cpu: {type: Processor, time: 2 s, at: [a, b, c]}
  crash: {type: CrashRestart, times: [1 s], repair: 10 s, at: [a, b]}
run: {stop: 20 s}
"""
    _, results = simulate(text)
    assert sent(results, "c") == [(3.0, 0)]
    assert sent(results, "a") == sent(results, "b") == []
    assert results.aspects["cpu"]["utilisation"] == pytest.approx(3 / 11)


def test_a_process_begins_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    left: list[float] = []

    def behaviour(self: Script) -> Generator[Any, Any, None]:
        count = 0
        try:
            while True:
                yield self.read(self.input)
                yield self.environment.timeout(0.25)  # which no aspect can hold up
                count += 1
                self.output.send(count)
        finally:
            left.append(self.now)

    monkeypatch.setattr(Script, "behaviour", behaviour)
    text = """
actors: {t: {type: Ticker}, script: {type: Script}}
connections: [t.output -> script.input]
aspects: {crash: {type: CrashRestart, times: [2.1 s], repair: 1.7 s, at: script}}
run: {stop: 6 s}
"""
    _, results = simulate(text)
    assert sent(results, "script") == [(0.25, 1), (1.25, 2), (4.25, 1), (5.25, 2)]
    assert left[0] == 2.1


def test_wake_ups_of_a_dead_actor_do_not_come(monkeypatch: pytest.MonkeyPatch) -> None:
    fired: list[tuple[float, int]] = []

    def begin(self: Plan) -> None:
        self.number = sum(1 for time, _ in fired if time > 100) + len({number for _, number in fired})
        self.wake_in(1)
        self.wake_in(4)

    def act(self: Plan) -> None:
        fired.append((self.now, self.number))

    monkeypatch.setattr(Plan, "begin", begin)
    monkeypatch.setattr(Plan, "act", act)
    simulate(
        "actors: {plan: {type: Plan}}\n"
        "aspects: {crash: {type: CrashRestart, times: [3 s], repair: 2 s, at: plan}}\nrun: {stop: 20 s}"
    )
    assert fired == [(1.0, 0), (6.0, 1), (9.0, 1)]


def test_parameters_with_ports_and_sources_with_a_calendar(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text("time,value\n" + "".join(f"{t},{t}\n" for t in range(8)), encoding="utf-8")
    text = """
model: m
actors:
  data: {type: Replay, file: data.csv}
  once: {type: SingleEvent, time: 1 s, value: 10}
  late: {type: SingleEvent, time: 6 s, value: 20}
  merge: {type: Merge}
  sum: {type: Adder}
connections: [data.output -> sum.input, "once.output, late.output -> merge.input", merge.output -> sum.more]
aspects: {crash: {type: CrashRestart, times: [2.5 s], repair: 2 s, at: "**"}}
run: {stop: 9 s}
"""
    from epicycle.runner import load_model

    (tmp_path / "m.yaml").write_text(text, encoding="utf-8")
    results = Simulation(load_model(tmp_path / "m.yaml", types=[Adder]), keep_log=True).run()
    # After the repair at 4.5 s the table goes on from there, the parameter has its first value, and 1 s is over.
    assert sent(results) == [(0, 0), (1, 11), (2, 13), (5, 5), (6, 31), (7, 38)]


def test_two_crashes_at_one_actor_and_a_trace() -> None:
    text = CHAIN.replace("  crash:", "  other: {{type: CrashRestart, times: [3.5 s], repair: 3 s, at: '**'}}\n  crash:")
    aspect = "times: [2.5 s], repair: 1.7 s, at: sum, state: kept, tokens: kept"
    results = run(aspect, text)
    assert [time for time, _ in sent(results)] == [0, 1, 2, 6.5, 7.5, 8.5]
    model = load(text.format(aspect), types=[Adder])
    firings: list[Any] = []
    traced = Simulation(model, seed=0, tracer=Tracer(model.graph.actors, firings.append)).run()
    assert traced.digest == results.digest
    first = next(firing for firing in firings if firing.actor == "sum" and firing.tag.seconds > 6)
    assert [arrival.token for arrival in first.arrivals] == [1]


def test_an_actor_that_cannot_start_again() -> None:
    class Once(Plan):
        def initialize(self) -> None:
            if self.tag.time:
                raise OSError("the device is busy")

    with pytest.raises(ActorError) as caught:
        simulate(
            "actors: {once: {type: Once}}\n"
            "aspects: {crash: {type: CrashRestart, times: [1 s], at: once}}\nrun: {stop: 2 s}",
            types=[Once],
        )
    assert str(caught.value).partition("\n")[0] == ("once failed in restart() at (1 s, 2): OSError: the device is busy")
