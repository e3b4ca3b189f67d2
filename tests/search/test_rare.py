"""Probabilities that are known, estimated by importance splitting."""

from __future__ import annotations

import json
import math
import statistics
from pathlib import Path
from typing import Any

import pytest

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner.interface.cli import main
from epicycle.runner.model.build.model import Model
from epicycle.runner.search.splitting import RareEvent, rare
from tests.engine.engine_parts import load

# What is in a queue after each arrival or departure, from its first customer until it is empty.
CHAIN = """
actors:
  tick: {{type: Clock, period: 1 s, offset: 1 s}}
  step: {{type: Random, distribution: {{type: Choice, values: [-1, 1], weights: [{ratio}, 1]}}}}
  size: {{type: Accumulator, initial: 1}}
  empty: {{type: Expression, expression: size == 0}}
connections: [tick.output -> step.trigger, step.output -> size.input, size.output -> empty.size]
run: {{stop_when: empty.output}}
monitors:
  full: {{property: "always size.output < {most}"}}
  is: {{property: "always not ('none' == ('none' if size.output == {most} else 'some'))"}}
  never: {{property: always size.output < 100}}
  late: {{property: "eventually size.output >= {most}"}}
"""
WALK = """
actors:
  tick: {{type: Clock, period: 1 s}}
  step: {{type: Random, distribution: {{type: Choice, values: [-1, 1]}}}}
  walk: {{type: Accumulator}}
connections: [tick.output -> step.trigger, step.output -> walk.input]
run: {{stop: {stop} s}}
monitors:
  low: {{property: "always walk.output < {most}"}}
"""
QUEUE = """
actors:
  people: {type: PoissonClock, mean_interval: 2 s}
  desk: {type: Station, service_time: {type: Exponential, mean: 1 s}}
  size: {type: Counter}
  empty: {type: Expression, expression: size == 0}
connections:
  - people.output -> desk.input, size.increment
  - desk.output -> size.decrement
  - size.output -> empty.size
run: {stop_when: empty.output}
monitors:
  full: {property: always size.output < 4}
"""


def chain(ratio: int, most: int) -> tuple[Model, float]:
    """A model, and the probability that ``most`` are there before none is (the gambler's ruin)."""
    return load(CHAIN.format(ratio=ratio, most=most)), (ratio - 1) / (ratio**most - 1)


def reached(steps: int, most: int) -> float:
    """The probability that a walk gets so far in so many steps (the reflection principle)."""
    ends = {2 * up - steps: math.comb(steps, up) for up in range(steps + 1)}
    there = sum(ways for end, ways in ends.items() if end >= most)
    beyond = sum(ways for end, ways in ends.items() if end > most)
    return (there + beyond) / 2**steps


def assert_mean(found: RareEvent, probability: float) -> None:
    """The mean of all estimates is the probability, to within three standard errors."""
    assert abs(found.probability / probability - 1.0) < 3.0 * found.error


@pytest.mark.slow
def test_a_queue_overflows_before_it_is_empty() -> None:
    model, probability = chain(5, 6)  # 0.00026
    found = rare(model, "full", runs=50, repetitions=6, seed=1)
    assert found.interval is not None
    assert found.interval[0] < probability < found.interval[1]
    assert found.levels == sorted(found.levels, reverse=True)
    assert len(found.levels) >= 2
    assert found.plain_runs > 10 * found.runs_made
    few = [rare(model, "full", runs=20, repetitions=2, seed=seed) for seed in (1, 1, 2)]
    assert few[0] == few[1]
    assert few[0].shares != few[2].shares


@pytest.mark.slow
def test_the_mean_is_right_whatever_is_known_of_the_state() -> None:
    """A walk of so many steps: those that reach a level early differ from those that reach it late."""
    model = load(WALK.format(stop=19, most=12))
    assert_mean(rare(model, "low", runs=20, repetitions=20, seed=3), reached(20, 12))


def test_the_mean_is_right_with_processes() -> None:
    """Whose forks go by way of the beginning; when a customer comes next is known before a level is reached."""
    found = rare(load(QUEUE), "full", runs=20, repetitions=12, seed=4)
    assert len(found.levels) >= 1
    assert_mean(found, 1 / 15)


def test_without_levels_it_is_plain_sampling() -> None:
    model, probability = chain(2, 3)
    late = rare(model, "late", runs=50, repetitions=4, seed=1)  # of which nothing is certain before the end
    assert late.levels == []
    assert all(len(each) == 1 for each in late.shares)
    assert late.probability == pytest.approx(1.0 - probability, abs=0.15)
    assert late.sentence.endswith(" There was no level on the way, so this is plain sampling.")
    assert late.runs_made == 5 * 50


@pytest.mark.slow
def test_another_monitor_can_say_how_far_a_run_is() -> None:
    model, probability = chain(3, 4)
    found = rare(model, "is", guide="never", runs=40, repetitions=10, seed=2)
    assert_mean(found, probability)
    assert found.levels[0] > 90.0
    assert rare(model, "is", runs=40, repetitions=2, seed=2).levels == []


def test_what_nothing_breaks() -> None:
    model, _ = chain(3, 7)
    found = rare(model, "never", runs=10, repetitions=3, seed=1)
    assert (found.probability, found.interval) == (0.0, None)
    assert found.sentence.startswith("No run broke never (always size.output < 100): 3 repetitions with 10 runs ")
    assert found.sentence.endswith(" runs in all. That does not bound the probability.")
    assert json.loads(json.dumps(found.facts()))["error"] is None


def test_what_every_run_breaks() -> None:
    model, _ = chain(3, 7)
    model.monitor("none", "always size.output > 5")
    found = rare(model, "none", runs=10, repetitions=3, seed=1)
    assert (found.probability, found.interval, found.error) == (1.0, (1.0, 1.0), 0.0)


@pytest.mark.slow
def test_an_estimate_that_was_killed_goes_on(tmp_path: Path) -> None:
    model, _ = chain(3, 5)
    options: dict[str, Any] = {"runs": 20, "repetitions": 6, "seed": 1}
    expected = rare(model, "full", **options)

    def die(runs: int, done: int) -> None:
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rare(model, "full", **options, folder=tmp_path, tell=die)
    told: list[int] = []
    assert rare(model, "full", **options, folder=tmp_path, tell=lambda runs, done: told.append(runs)) == expected
    (file,) = tmp_path.glob("tried-*.jsonl")
    assert len(file.read_text().splitlines()) == 1 + 1 + 6
    assert told == sorted(told)
    assert rare(model, "full", **{**options, "seed": 2}, folder=tmp_path) != expected  # another file
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    ("monitor", "options", "message"),
    [
        (
            "ful",
            {},
            "m has no monitor 'ful', did you mean 'full'?\n   help: its monitors: full, is, never, late",
        ),
        (
            "full",
            {"guide": "lat"},
            "m has no monitor 'lat', did you mean 'late'?\n   help: its monitors: full, is, never, late",
        ),
        ("full", {"runs": 1}, "an interval takes 2 runs and 2 repetitions or more, not 1 and 10"),
        ("full", {"repetitions": 1}, "an interval takes 2 runs and 2 repetitions or more, not 200 and 1"),
    ],
)
def test_mistakes(monitor: str, options: Any, message: str) -> None:
    with pytest.raises(EpicycleError) as caught:
        rare(chain(3, 7)[0], monitor, **options)
    assert str(caught.value) == message


def test_a_run_that_cannot_be_judged() -> None:
    model, _ = chain(3, 7)
    model.monitor("wrong", "always 1 / (size.output - 2) > -5")
    with pytest.raises(EpicycleError) as caught:
        rare(model, "wrong", seed=1)
    assert str(caught.value).startswith(
        "monitor wrong cannot be judged in a run of m, because '1 / (size.output - 2) > -5': "
        "1 / (size.output - 2) divides by zero, with size.output = 2, at "
    )


def test_from_python_and_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "chain.yaml"
    file.write_text("model: chain" + CHAIN.format(ratio=3, most=5))
    found = epicycle.rare(file, "always size.output < 4", runs=20, repetitions=4, seed=1, guide="full")
    assert (found.monitor, found.source, found.guide) == ("property", "always size.output < 4", "full")
    command = ["rare", str(file), "--monitor", "always size.output < 4", "--guide", "full", "--seed", "1"]
    command += ["--runs", "20", "--repetitions", "4", "--out", str(tmp_path / "out")]
    assert main([*command, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == found.facts() == json.loads((tmp_path / "out/rare.json").read_text())
    assert main(command) == 0
    assert capsys.readouterr().out == f"{found}\nwrote {tmp_path / 'out/rare.json'}\n"
    assert str(found).startswith("A run of chain breaks property (always size.output < 4) with a probability of 0.0")


# -- one in a million -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_one_in_a_million_is_within_the_interval() -> None:
    model, probability = chain(10, 7)
    assert probability == pytest.approx(9e-7)
    found = [rare(model, "full", runs=100, repetitions=10, seed=seed) for seed in range(20)]
    within = sum(each.interval is not None and each.interval[0] < probability < each.interval[1] for each in found)
    assert within >= 17  # of 20: 95 % intervals
    estimates = [estimate / probability for each in found for estimate in each.estimates]
    assert abs(statistics.fmean(estimates) - 1.0) < 3.0 * statistics.stdev(estimates) / math.sqrt(len(estimates))
    # Plain sampling needs so many more runs for the standard error that these estimates have in fact.
    error = statistics.stdev(each.probability / probability for each in found)
    plain = (1.0 - probability) / probability / (error * error)
    assert plain > 1_000 * max(each.runs_made for each in found)
