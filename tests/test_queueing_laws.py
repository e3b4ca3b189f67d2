"""Queues obey the laws of queueing theory, as metrics of one long run tell, within their own intervals."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.runner import Simulation, load_model
from epicycle.runner.execution.engine import Results

QUEUE = """
model: queue
parameters: {{load: 0.5, warm_up: 200 s}}
actors:
  customers: {{type: PoissonClock, mean_interval: "${{1 / load}}", fire_at_start: false}}
  server: {{type: Server, {service}}}
  stay: {{type: Expression, expression: time - came}}
  came: {{type: CurrentTime}}
  # How many are in the system when somebody comes, who is not counted.
  then: {{type: MostRecent}}
  found: {{type: Expression, expression: number - 1}}
connections:
  - customers.output -> came.trigger, then.trigger
  - came.output -> server.input
  - server.output -> stay.came
  - server.size -> then.input
  - then.output -> found.number
run: {{stop: 20000 s, seed: {seed}}}
metrics:
  naive: {{of: server.size, take: mean}}
  number: {{of: server.size, take: time_mean, initial: 0, after: "${{warm_up}}", interval: 0.99}}
  busy: {{of: server.size, take: share, when: value > 0, initial: 0, after: "${{warm_up}}", interval: 0.99}}
  stay: {{of: stay.output, take: mean, after: "${{warm_up}}", interval: 0.99}}
  coming: {{of: customers.output, take: rate, after: "${{warm_up}}", interval: 0.99}}
  seen: {{of: found.output, take: mean, after: "${{warm_up}}", interval: 0.99}}
"""
SERVICES = {  # with E[S^2], of which Pollaczek and Khinchine make the number in the system; E[S] is 1 s
    "M/D/1": ("service_time: 1 s", 1.0),
    "M/M/1": ("distribution: {type: Exponential, mean: 1 s}", 2.0),
    "M/G/1": ("distribution: {type: Gamma, mean: 1 s, shape: 4}", 1.25),
}


def queue(tmp_path: Path, service: str, until: float | None = None) -> Results:
    path = tmp_path / "queue.yaml"
    path.write_text(QUEUE.format(service=service, seed=5), encoding="utf-8")
    return Simulation(load_model(path)).run(until=until)


def assert_about(results: Results, metric: str, truth: float, sharpness: float) -> None:
    """The truth lies in the interval, which is narrow enough for that to mean something."""
    found = results.intervals[metric]
    assert found.low <= truth <= found.high
    assert found.half < sharpness * truth


@pytest.mark.parametrize("kind", SERVICES)
def test_number_is_what_pollaczek_and_khinchine_say(kind: str, tmp_path: Path) -> None:
    service, square = SERVICES[kind]
    results = queue(tmp_path, service)
    number = 0.5 + 0.25 * square / (2 * 0.5)
    assert_about(results, "number", number, 0.35)
    assert_about(results, "busy", 0.5, 0.12)
    assert_about(results, "coming", 0.5, 0.12)
    # Little's law: number = rate x stay.
    assert_about(results, "stay", number / 0.5, 0.35)
    assert results.metrics["number"] == pytest.approx(results.metrics["coming"] * results.metrics["stay"], rel=0.01)
    # Poisson arrivals see time averages.
    assert_about(results, "seen", number, 0.35)


def test_the_mean_over_tokens_is_another_one(tmp_path: Path) -> None:
    """M/D/1 at 0.5: 0.75 are in the system on average; the tokens' mean is of what stands after each change."""
    results = queue(tmp_path, "service_time: 1 s")
    number = results.intervals["number"]
    assert number.low <= 0.75 <= number.high
    assert number.half < 0.12
    assert results.metrics["naive"] == pytest.approx(1.25, abs=0.08)  # half of them after an arrival: 0.75 + 1 / 2


def test_littles_law_holds_exactly_over_busy_cycles(tmp_path: Path) -> None:
    """From an empty system to an empty system, number x time is the sum of all stays, to the nanosecond."""
    queue(tmp_path, "service_time: 1 s", until=0.0)
    model = load_model(tmp_path / "queue.yaml", set={"warm_up": "0 s"})
    model.record("server.size", "stay.output")
    sizes = Simulation(model).run(until=2000)["server.size"]
    last = max(tag.time for tag, size in zip(sizes.tags, sizes.tokens, strict=True) if size == 0)
    results = Simulation(model).run(until=last / 1e9)
    assert results.stopped == "stop time"
    stays = [round(stay * 1e9) for stay in results["stay.output"].tokens]
    assert round(results.metrics["number"] * last) == pytest.approx(sum(stays), abs=len(stays))
    assert results.metrics["coming"] == len(stays) / (last / 1e9)
