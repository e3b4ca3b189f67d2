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

from epicycle.runner.engine import Simulation
from epicycle.runner.model import Model, ModelError, load_model
from epicycle.runner.model.catalogue import built_in
from epicycle.runner.model.schedule import dependencies, depths

sys.path.insert(0, str(Path(__file__).parent))
from conformance_parts import TYPES, TestActorPortDepth

HERE = Path(__file__).parent
RESOLUTION = 1e-9  # s


def own_name(name: str) -> str:
    """``S+Samplers, DE.trueOutput`` as ``s_samplers_de.true_output``."""
    name = re.sub(r"[^A-Za-z0-9.]+", "_", name)
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def own_token(text: str) -> Any:
    """A token in Ptolemy's syntax; an array that was sent element by element is written with brackets."""
    if "DepthTest4." in text:
        return depths_in(json.loads(text))
    return json.loads(text.strip("[]"))


def depths_in(text: str) -> dict[str, int]:
    """Ptolemy's list of depths: a line for each actor, and indented below it one for each port."""
    found, actor = {}, ""
    for line in text.splitlines():
        name, depth = line.split(":")
        if not name.startswith(" "):
            actor = own_name(name.rpartition(".")[2])
        found[f"{actor}.{own_name(name.strip())}" if name.startswith(" ") else actor] = int(depth)
    return found


def recorded(case: str) -> list[tuple[float, int, str, int, Any]]:
    """What Ptolemy sent."""
    with (HERE / "sends" / f"{case}.csv").open(newline="", encoding="utf-8") as file:
        return [
            (float(row["time"]), int(row["microstep"]), own_name(row["port"]), int(row["channel"]), row["token"])
            for row in csv.DictReader(file)
        ]


def load(case: str) -> Model:
    return load_model(HERE / "models" / f"{case}.yaml", types=TYPES)


def sends(model: Model) -> list[tuple[float, int, str, int, Any]]:
    """What Epicycle sends, in the local time of the sender."""
    results = Simulation(model, seed=0, keep_log=True).run()
    return [
        (model.local_tag(r.actor, r.tag).seconds, r.tag.microstep, f"{r.actor}.{r.port}", r.channel or 0, r.value)
        for r in results.log.records
        if r.event == "send"
    ]


LATER = {
    "CompositeQM": "a communication aspect that is itself a model",
    "RefiringActorInDE": "execution and communication aspects that are models",
    "ScheduleEmbeddedActors": "an execution aspect: a fixed-priority scheduler",
}
"""The cases of Ptolemy's aspects, which wait for ours of that kind."""
REFUSED = "DEFixedPointLimitation"
CASES = [
    "BusConfigureParamsDE", "CancelFireAt", "DEScheduleTest", "DEinDEwithStartTimes", "DepthTest4", "DiscreteClock10",
    "Feedback", "Iteration", "MergeWithoutDiscard", "Priority1", "QuantityManager2Busses", "QueueAndServer",
    "ResettableTimer3", "ServerWithVariableDelay3", "SynchronizerDE", "TimeDelayMicrosteps2", "TimeDelayZeroDelay",
    "TransferInputs", "VariableDelay2", "transferInputsandOutputs",
]  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_sends_as_ptolemy(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = load(case)
    monkeypatch.setattr(TestActorPortDepth, "depths", depths(model.graph, "", dependencies(model.graph)[""]))
    found, expected = sends(model), recorded(case)
    assert [send[1:4] for send in found] == [send[1:4] for send in expected]
    for (time, _, port, _, value), (recorded_time, _, _, _, text) in zip(found, expected, strict=True):
        assert abs(time - recorded_time) <= RESOLUTION, (port, recorded_time)
        token = own_token(text)
        if isinstance(token, dict):  # depths: Scale has ports here that it does not have there
            value = {name: value.get(name) for name in token}
        assert (value, type(value)) == (token, type(token)), (port, recorded_time)


def test_a_loop_that_ptolemy_refuses() -> None:
    """Ptolemy: ``Found a zero delay loop containing .DEFixedPointLimitation.C1``."""
    assert recorded(REFUSED) == []
    with pytest.raises(ModelError) as caught:
        load(REFUSED)
    assert [problem.message for problem in caught.value.problems] == ["a loop without delay: c1 -> c1"]


def test_every_case_is_here() -> None:
    assert {path.stem for path in (HERE / "models").glob("*.yaml")} == {*CASES, REFUSED}
    assert {path.stem for path in (HERE / "sends").glob("*.csv")} == {*CASES, REFUSED}
    assert len({*CASES, REFUSED, *LATER}) == 24


def test_the_document_tells_the_same() -> None:
    text = (HERE.parents[1] / "docs" / "ptolemy.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in text.splitlines() if line[:2] == "| "]
    results = {case: row[2] for row in rows if len(row) == 3 for case in row[0].split(", ")}
    assert all("match" in results[case] for case in CASES)
    assert "refused" in results[REFUSED]
    assert all("waits" in results[case] for case in LATER)
    actors = [line.strip("| ").split(" | ") for line in text[text.index("## Actors") :].splitlines() if "` | " in line]
    named = {name for row in actors for name in re.findall(r"`([A-Z]\w+)`", row[0 if row[1] == "the same" else 1])}
    assert len(named) > 40
    assert named - {"PortParameter"} <= set(built_in().actors)
