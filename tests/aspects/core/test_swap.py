"""Swapping one aspect for another: what it changes, and what it must leave as it is."""

from __future__ import annotations

from itertools import groupby
from typing import Any

import numpy as np
import pytest

from epicycle.actors import Tag
from epicycle.runner import Simulation, load_model
from epicycle.runner.execution.results.log import Record

LOSS, BURST = 0.25, 4.0
BERNOULLI = f"packet_loss=PacketLoss,probability={LOSS}"
BURSTS = f"packet_loss=GilbertElliott,p={LOSS / (1 - LOSS) / BURST},r={1 / BURST}"
# It stands behind the loss, so that the log has each message either as dropped or as seen.
HEARD = "heard=Probe,at=[*.peer_plan, *.peer_measurement]"
SEEDS = range(3)

Sends = dict[tuple[Tag, str], Any]


def run(loss: str, seed: int) -> list[Record]:
    model = load_model("collision_avoidance", set={"observers": 3}, aspects=[loss, HEARD])
    return Simulation(model, seed=seed, keep_log=True).run().log.records


def sends(records: list[Record], port: str) -> Sends:
    """What all ports of a name sent: by tag and robot."""
    own = (record for record in records if not record.aspect and f"{record.actor}.{record.port}".endswith(port))
    return {(record.tag, record.actor.rpartition(".")[0]): record.value for record in own}


def losses(records: list[Record]) -> list[list[bool]]:
    """For each port, which of its messages were lost."""
    ports: dict[tuple[str, str], list[bool]] = {}
    for record in records:
        if record.aspect:
            ports.setdefault((record.actor, record.port), []).append(record.event == "dropped")
    return list(ports.values())


def draws(records: list[Record]) -> dict[tuple[Tag, str], np.ndarray]:
    """The standard normal values that each sensor drew for each measurement."""
    targets = {tag: state.position for (tag, _), state in sends(records, "obstacle.state").items()}
    found = {}
    for (tag, robot), seen in sends(records, "sensor.measurement").items():
        offset = targets[tag] - seen.observer
        along = offset / np.hypot(*offset)
        error = seen.value - offset
        across = np.array([-along[1], along[0]])
        found[tag, robot] = np.array([error @ along / seen.along, error @ across / seen.across])
    return found


@pytest.mark.slow
def test_losses_come_in_bursts_and_no_sensor_draws_another_value() -> None:
    rows: dict[str, list[list[bool]]] = {BERNOULLI: [], BURSTS: []}
    for seed in SEEDS:
        one, other = (run(loss, seed) for loss in rows)
        rows[BERNOULLI] += losses(one)
        rows[BURSTS] += losses(other)

        # While all robots are where they were, measurements are the same to the last bit.
        states, measurements = [
            [sends(log, port) for log in (one, other)] for port in (".vehicle.state", ".measurement")
        ]
        parted = min(key[0] for key, state in states[0].items() if repr(state) != repr(states[1].get(key)))
        before = [key for key in measurements[0] if key[0] < parted]
        assert len(before) >= 8
        assert all(repr(measurements[0][key]) == repr(measurements[1][key]) for key in before)

        # Then they stand elsewhere and see another ellipse, but what is drawn for it is the same.
        drawn = [draws(log) for log in (one, other)]
        shared = drawn[0].keys() & drawn[1].keys()
        assert len(shared) > 4 * 40
        for key in shared:
            np.testing.assert_allclose(drawn[0][key], drawn[1][key], rtol=0, atol=1e-9)

    assert [len(series) for series in rows.values()] == [8 * len(SEEDS)] * 2
    lost = {loss: [each for row in series for each in row] for loss, series in rows.items()}
    lengths = {
        loss: [len(list(group)) for row in series for is_lost, group in groupby(row) if is_lost]
        for loss, series in rows.items()
    }
    # 99.9 % intervals: of a mean of independent losses; of losses whose correlation falls by 1 - p - r = 2/3 from
    # message to message, which widens the interval by sqrt(5); and of means of geometric lengths.
    count = len(lost[BERNOULLI])
    spread = 3.29 * np.sqrt(LOSS * (1 - LOSS) / count)
    assert abs(np.mean(lost[BERNOULLI]) - LOSS) < spread
    assert abs(np.mean(lost[BURSTS]) - LOSS) < np.sqrt(5) * spread
    for loss, mean in {BERNOULLI: 1 / (1 - LOSS), BURSTS: BURST}.items():
        assert abs(np.mean(lengths[loss]) - mean) < 3.29 * np.sqrt(mean * (mean - 1) / len(lengths[loss]))
