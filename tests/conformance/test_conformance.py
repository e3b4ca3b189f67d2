"""Ptolemy II's own regression models, run by Epicycle: every send as in the real program.

``models/`` holds each model as a user of Epicycle would write it, with Ptolemy's names made valid: ``TimeDelay`` is
``time_delay``.  ``sends/`` holds what Ptolemy II 11.0-devel sent.  Cleared sends ("null" there), which do nothing, are
left out on both sides; so are the actors that only check values (``Test``, ``NonStrictTest``), for the comparison takes
their place.
"""

from __future__ import annotations

import csv
import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from epicycle.runner.engine import Record, Simulation
from epicycle.runner.model import load_model

sys.path.insert(0, str(Path(__file__).parent))
from conformance_parts import TYPES

HERE = Path(__file__).parent
RESOLUTION = 1e-9  # s


def own_name(name: str) -> str:
    """``S+Samplers, DE.trueOutput`` as ``s_samplers_de.true_output``."""
    name = re.sub(r"[^A-Za-z0-9.]+", "_", name)
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def own_token(text: str) -> Any:
    """A token in Ptolemy's syntax; an array that was sent element by element is written with brackets."""
    return json.loads(text.strip("[]"))


def recorded(case: str) -> list[tuple[float, int, str, int, Any]]:
    with (HERE / "sends" / f"{case}.csv").open(newline="", encoding="utf-8") as file:
        return [
            (float(row["time"]), int(row["microstep"]), own_name(row["port"]), int(row["channel"]), row["token"])
            for row in csv.DictReader(file)
        ]


def sends(case: str) -> list[Record]:
    model = load_model(HERE / "models" / f"{case}.yaml", types=TYPES)
    results = Simulation(model, seed=0, keep_log=True).run()
    return [record for record in results.log.records if record.event == "send"]


CASES = sorted(path.stem for path in (HERE / "models").glob("*.yaml"))


@pytest.mark.parametrize("case", CASES)
def test_sends_as_ptolemy(case: str) -> None:
    found = sends(case)
    expected = recorded(case)
    shown = [(r.tag.microstep, f"{r.actor}.{r.port}", r.channel or 0) for r in found]
    assert shown == [(microstep, port, channel) for _, microstep, port, channel, _ in expected]
    for record, (time, _, port, _, token) in zip(found, expected, strict=True):
        assert abs(record.tag.seconds - time) <= RESOLUTION, (port, time)
        value = own_token(token)
        assert (record.value, type(record.value)) == (value, type(value)), (port, time)
