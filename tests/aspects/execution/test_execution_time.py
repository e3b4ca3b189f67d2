"""Firings that take time: constant, drawn, or measured once and taken from a file."""

from __future__ import annotations

import csv
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from scipy.stats import kstest

from epicycle.actors import Actor, EpicycleError, InputPort, OutputPort
from epicycle.aspects import ExecutionTime
from epicycle.runner import ActorError, Simulation, load_model
from epicycle.runner.execution.engine import Results
from tests.aspects.execution.execution_parts import CHAIN, acts, chain, sent
from tests.engine.engine_parts import TYPES, Script, seen, simulate


@pytest.mark.parametrize(
    ("aspect", "expected", "delays"),
    [
        ("time: 0.4 s", [(n + 0.4, n) for n in range(5)], [0.4] * 6),
        ("time: 0.2 s, scale: 2", [(n + 0.4, n) for n in range(5)], [0.4] * 6),
        (
            "time: 1.4 s",
            [(1.4, 0), (2.8, 1), (4.2, 2)],
            [1.4, 1.8, 2.2, 2.6, 3.0, 3.4],
        ),  # each waits for the one before
        ("time: 1.4 s, busy: skip", [(1.4, 0), (3.4, 2)], [1.4, "s", 1.4, "s", 1.4, "s"]),
        ("time: 1 s", [(n + 1.0, n) for n in range(5)], [1.0] * 6),  # over just when the next one comes
        ("time: 1 s, busy: skip", [(n + 1.0, n) for n in range(5)], [1.0] * 6),
        ("time: 0.4 s, from: 1 s, until: 3 s", [(0, 0), (1.4, 1), (2.4, 2), (3, 3), (4, 4), (5, 5)], [0.4] * 2),
        # What comes when the aspect is no longer active takes no time, and waits for its turn all the same.
        ("time: 1.8 s, until: 2 s", [(1.8, 0), (3.6, 1), (3.6, 2), (3.6, 3), (4, 4), (5, 5)], [1.8, 2.6, 1.6, 0.6]),
        ("time: 0.4 s, when: t.output > 2", [(0, 0), (1, 1), (2, 2), (3.4, 3), (4.4, 4)], [0.4] * 3),
    ],
)
def test_a_firing_takes_time(aspect: str, expected: list[tuple[float, int]], delays: list[Any]) -> None:
    model, results = chain(f"type: ExecutionTime, at: a, {aspect}")
    assert sent(results) == expected
    assert [entry[3] if entry[1] == "delayed" else "s" for entry in acts(results)] == pytest.approx(delays)
    assert results.aspects["it"] == {"delayed": sum(d != "s" for d in delays), "skipped": delays.count("s")}
    # What it sends is received within the tag, and that is the first one of its instant.
    assert {(time, microstep) for time, microstep, _ in seen(model)} == {(time, 1) for time, _ in expected}


def test_lindley() -> None:
    """Random times on a server without a queue's limit: d[n] = max(a[n], d[n-1]) + s[n], in whole nanoseconds."""
    text = CHAIN.format("type: ExecutionTime, time: {type: Exponential, mean: 6 ms}, at: a")
    _, results = simulate(text.replace("1 s", "10 ms").replace("5 s", "30 s"), seed=3)
    done = [tag.time for tag in (r.tag for r in results.log.records if r.event == "send" and r.actor == "a")]
    came = [10_000_000 * n for n in range(len(done))]
    service = [
        done[0] - came[0],
        *(d - max(a, before) for a, (before, d) in zip(came[1:], pairwise(done), strict=True)),
    ]
    assert kstest([s / 1e9 for s in service], "expon", (0, 0.006)).pvalue > 0.001
    waits = [d - a for a, d in zip(came, done, strict=True)]
    told = [value for _, _, _, value in acts(results)]
    assert told[: len(waits)] == pytest.approx([wait / 1e9 for wait in waits], abs=1e-12)


def test_a_source_is_late_by_its_own_time() -> None:
    """It asks for its next wake-up when it fires."""
    _, results = chain("type: ExecutionTime, time: 0.4 s, at: t")
    assert sent(results, "t") == sent(results) == [(0.4, 0), (1.8, 1), (3.2, 2), (4.6, 3)]


def test_time_of_a_composite_with_a_clock() -> None:
    text = """
composites:
  Fast: {inputs: [go], outputs: [gone], director: {drift: 2}, actors: {a: {type: Scale}},
         connections: [go -> a.input, a.output -> gone]}
actors: {t: {type: Ticker, period: 1 s}, fast: {type: Fast}, probe: {type: Probe}}
connections: [t.output -> fast.go, fast.gone -> probe.input]
aspects: {slow: {type: ExecutionTime, time: 0.4 s, at: fast}}
run: {stop: 3 s}
"""
    simulation, results = simulate(text)
    assert [(time, tokens) for time, _, tokens in seen(simulation)] == [(n + 0.2, (n,)) for n in range(3)]
    assert {act[3] for act in acts(results)} == {0.4}


def test_order_of_aspects() -> None:
    skip = "skip: {{type: SkipFiring, probability: 0.5, at: a}}"
    slow = "slow: {{type: ExecutionTime, time: 1.5 s, at: a}}"

    def run(first: str, second: str) -> Results:
        text = CHAIN.replace("  it: {{{}}}\n", f"  {first}\n  {second}\n").replace("5 s", "40 s")
        return simulate(text.format(), seed=2)[1]

    before, after = run(skip, slow), run(slow, skip)
    assert before.aspects["slow"]["delayed"] == 41 - before.aspects["skip"]["skipped"]  # what is skipped takes no time
    assert after.aspects["slow"]["delayed"] == 41
    assert len(sent(after)) < len(sent(before))


class Busy(Actor):
    """Computes for some time."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        sum(range(5_000 * (self.input.value % 3)))
        self.output.send(self.input.value)


def test_measured_once_and_replayed(tmp_path: Path) -> None:
    text = CHAIN.replace("Scale", "Busy").replace("1 s", "1 ms").replace("5 s", "40 ms")
    bare = simulate(text.format("type: ExecutionTime, at: a"), types=[Busy])[1]
    results = simulate(text.format("type: ExecutionTime, measure: true, at: a"), types=[Busy])[1]
    assert results.digest == bare.digest
    times = results["it@a"].tokens
    assert len(times) == 41
    assert sorted(times[2::3])[6] > sorted(times[0::3])[6] > 0  # medians: it was measured, and not made up

    from epicycle.runner.show.outcome import write_folder

    write_folder(tmp_path, results, [])
    model = text.format("type: ExecutionTime, times: signals.parquet, at: a")
    (tmp_path / "m.yaml").write_text(f"model: m\n{model}", encoding="utf-8")
    runs = [
        Simulation(load_model(tmp_path / "m.yaml", types=[Script, Busy, *TYPES]), keep_log=True).run() for _ in "ab"
    ]
    assert runs[0].digest == runs[1].digest != bare.digest
    free, expected = 0, []
    for tick, time in enumerate(times):
        free = max(free, tick * 1_000_000) + round(time * 1e9)
        expected += [free / 1e9] if free <= 40_000_000 else []  # on a busy machine, not all is over in time
    assert expected
    assert [time for time, _ in sent(runs[0])] == pytest.approx(expected, abs=1e-12)


def test_times_for_all_actors_over_and_over(tmp_path: Path) -> None:
    with (tmp_path / "times.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["value"], [0.1], [0.3]])
    model = CHAIN.format("type: ExecutionTime, times: times.csv, scale: 2, at: [a, probe]")
    (tmp_path / "m.yaml").write_text(f"model: m\n{model}", encoding="utf-8")
    model_ = load_model(tmp_path / "m.yaml", types=TYPES)
    simulation = Simulation(model_, keep_log=True)
    results = simulation.run()
    assert [time for time, _ in sent(results)] == pytest.approx([0.2, 1.6, 2.2, 3.6, 4.2])
    assert [row[0] for row in seen(simulation)] == pytest.approx([0.4, 2.2, 2.4, 4.2, 4.4])


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        (["signal,value", "slow@b,1"], "it has no times of a; it has times of b"),
        (["signal,value", "robot.state,1"], "it has no times of a; it has times of no actor"),
        (["signal,values", "slow@a,1"], "it has no column 'value'; columns: signal, values"),
        (["signal,value", "slow@a,-1"], "row 1: -1 is not a time in s >= 0"),
        (["value"], "it has no rows"),
        ([], "No such file or directory"),
    ],
)
def test_files_that_tell_no_times(rows: list[str], reason: str, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (tmp_path / "m.yaml").write_text("model: m\n" + CHAIN.format("type: ExecutionTime, times: t.csv, at: a"))
    model = load_model(tmp_path / "m.yaml", types=TYPES)
    if not rows:  # it has gone since
        (tmp_path / "t.csv").unlink()
    with pytest.raises(ActorError) as caught:
        Simulation(model).run()
    assert str(caught.value).partition("\n")[0] == (
        f"aspect it failed in schedule() at a at (0 s, 1): the execution times in {tmp_path}/t.csv cannot be used: "
        f"{reason}"
    )


def test_parameters_that_do_not_fit() -> None:
    with pytest.raises(EpicycleError) as caught:
        ExecutionTime(measure=True, time=1)
    assert str(caught.value) == ("it cannot measure execution times that are given; leave out 'measure', or the times")
    with pytest.raises(EpicycleError) as caught:
        ExecutionTime(times="times.txt")
    assert str(caught.value) == "times: 'times.txt' must end in .csv or .parquet"
