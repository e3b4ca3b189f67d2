"""The programs of the benchmarks simulate what the models beside them do."""

from __future__ import annotations

from statistics import mean, variance

import pytest

from benchmarks.written import NAMES, by_hand, model, of_python
from epicycle.runner import Simulation

SEEDS = 12
MOST = 4.5  # standard errors; with 42 metrics and fixed seeds, chance needs about 3


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_program_by_hand_has_the_metrics_of_its_model(name: str) -> None:
    made, program = model(name), by_hand(name)
    runs = [Simulation(made, seed=seed).run().metrics for seed in range(SEEDS)]
    theirs = [program(seed) for seed in range(SEEDS)]
    for metric in theirs[0]:
        one, other = [float(run[metric]) for run in runs], [float(run[metric]) for run in theirs]
        error = ((variance(one) + variance(other)) / SEEDS) ** 0.5
        assert abs(mean(one) - mean(other)) <= MOST * error + 1e-9 * abs(mean(one)), metric


def test_a_lift_in_python_does_what_the_machine_does() -> None:
    one, other = (Simulation(made, seed=3).run(until=1800.0) for made in (model("lift_group"), of_python()))
    assert one.metrics == other.metrics
    for port in ("stay.output", "lift[0].load", "lift[1].height"):
        assert list(one.signals[port].values) == list(other.signals[port].values)
