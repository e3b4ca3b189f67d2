"""Ptolemy II's own regression models, run by Epicycle: every send as in the real program.

``models/`` holds each model as a user of Epicycle would write it, with Ptolemy's names made valid: ``TimeDelay`` is
``time_delay``.  ``sends/`` holds what Ptolemy II 11.0-devel sent.  Cleared sends ("null" there), which do nothing, are
left out on both sides; so are the actors that only check values (``Test``, ``NonStrictTest``), for the comparison takes
their place.

``tests/ptolemy/conformance`` runs the same cases with ``director: {like: ptolemy}``.
"""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import SetVariable, Variable
from epicycle.aspects import FiringRequest, Request
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.catalogue.types import built_in
from epicycle.runner.model.graph.ranks import dependencies, depths
from epicycle.runner.model.text.problems import ModelError
from tests.conformance.conformance_parts import TYPES, TestActorPortDepth

HERE = Path(__file__).parent
RESOLUTION = 1e-9  # s
REQUEST = re.compile(r"\{receiver = object\(\S+ \{\.\w+\.(?P<port>\S+)\.receiver \}\), token = (?P<token>.*)\}\Z")
FIRING = re.compile(r"\{actor = object\(\S+ \{\.\w+\.(?P<actor>\S+)\}\), executionTime = (?P<time>\S+)\}\Z")
Sends = list[tuple[float, int, str, int, Any]]


def own_name(name: str) -> str:
    """``S+Samplers, DE.trueOutput`` as ``s_samplers_de.true_output``."""
    name = re.sub(r"[^A-Za-z0-9.]+", "_", name)
    name = re.sub(r"Composite(Communication|Execution)Aspect\.(Communication|Execution)?", r"\1.", name)
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def own_token(text: str) -> Any:
    """A token in Ptolemy's syntax; an array that was sent element by element is written with brackets.

    Of a request to an aspect that is a model: the port where it goes and its token, or an actor and its execution time.
    """
    if firing := FIRING.match(text):
        return own_name(firing["actor"]), json.loads(firing["time"])
    if request := REQUEST.match(text):
        return own_name(request["port"]), json.loads(request["token"])
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


def recorded(case: str) -> Sends:
    """What Ptolemy sent."""
    with (HERE / "sends" / f"{case}.csv").open(newline="", encoding="utf-8") as file:
        return [
            (float(row["time"]), int(row["microstep"]), own_name(row["port"]), int(row["channel"]), row["token"])
            for row in csv.DictReader(file)
        ]


def load(case: str) -> Model:
    return load_model(HERE / "models" / f"{case}.yaml", types=TYPES)


def sends(model: Model) -> Sends:
    """What Epicycle sends, in the local time of the sender; variables are no actors in Ptolemy."""
    results = Simulation(model, seed=0, keep_log=True).run()
    hidden = {path for path, actor in model.graph.actors.items() if isinstance(actor, Variable)}
    hidden |= {f"{path}.variable" for path, actor in model.graph.actors.items() if isinstance(actor, SetVariable)}
    return [
        (model.local_tag(r.actor, r.tag).seconds, r.tag.microstep, f"{r.actor}.{r.port}", r.channel or 0, r.value)
        for r in results.log.records
        if r.event == "send" and hidden.isdisjoint((r.actor, f"{r.actor}.{r.port}"))
    ]


def requests(model: Model) -> Sends:
    """What comes in by the request ports of aspects that are models: in Ptolemy these are actors that send it."""
    asked = {woven.name: woven.model for woven in model.aspects}
    results = Simulation(model, seed=0, keep_log=True).run()
    found = []
    for r in results.log.records:
        place = f"{r.actor}.{r.port}" if r.port else r.actor  # a port, or an actor whose firing is asked for
        if r.event == "requested":
            port = f"{asked[r.aspect].requests[place]}.output"
            found.append((r.tag.seconds, r.tag.microstep, port, 0, (place, r.value)))
    return found


def came_in(model: Model, recorded_sends: Sends) -> tuple[Sends, Sends]:
    """What Ptolemy sent, apart from what came in by the request ports of aspects; and this."""
    ports = {port for woven in model.aspects if woven.model for port in woven.model.requests.values()}
    told = [(*send[:4], own_token(send[4])) for send in recorded_sends]
    inside = [send for send in told if send[2].removesuffix(".output") in ports]
    return [send for send in told if send not in inside], inside


def requested(token: Any) -> Any:
    """A request as Ptolemy's is told here."""
    if isinstance(token, FiringRequest):
        return token.port, token.execution_time
    return (token.port, token.token) if isinstance(token, Request) else token


QUANTITY_MANAGER = "CompositeQM"
REFIRING = "RefiringActorInDE"
OTHER_MICROSTEPS = ("ScheduleEmbeddedActors",)
"""The cases in which times and order are Ptolemy's, and microsteps are not; docs/ptolemy.md tells why."""
REFUSED = "DEFixedPointLimitation"
CASES = [
    "BusConfigureParamsDE", "CancelFireAt", "DEScheduleTest", "DEinDEwithStartTimes", "DepthTest4", "DiscreteClock10",
    "Feedback", "Iteration", "MergeWithoutDiscard", "Priority1", "QuantityManager2Busses", "QueueAndServer",
    "ResettableTimer3", "ScheduleEmbeddedActors", "ServerWithVariableDelay3", "SynchronizerDE", "TimeDelayMicrosteps2",
    "TimeDelayZeroDelay", "TransferInputs", "VariableDelay2", "transferInputsandOutputs",
]  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_sends_as_ptolemy(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compare(load(case), case, monkeypatch, 2 if case in OTHER_MICROSTEPS else 1)


def compare(
    model: Model,
    case: str,
    monkeypatch: pytest.MonkeyPatch,
    first: int,
    send_resumed: tuple[float, int, str] | None = None,
) -> None:
    """See that a model sends what Ptolemy sent, from which field of each send on beside the time and the value."""
    monkeypatch.setattr(TestActorPortDepth, "depths", depths(model.graph, "", dependencies(model.graph)[""]))
    found, expected = sends(model), recorded(case)
    same = slice(first, 4)
    if send_resumed is not None:
        expected = [(*send[:1], 1, *send[2:]) if send[:3] == send_resumed else send for send in expected]
    assert [send[same] for send in found] == [send[same] for send in expected]
    for (time, _, port, _, value), (recorded_time, _, _, _, text) in zip(found, expected, strict=True):
        assert abs(time - recorded_time) <= RESOLUTION, (port, recorded_time)
        if first == 2 and port == "current_microstep.output":
            continue
        token = own_token(text)
        if isinstance(token, dict):  # depths: Scale has ports here that it does not have there
            value = {name: value.get(name) for name in token}
        assert type(value) is type(token), (port, recorded_time)
        if isinstance(token, float):  # which Ptolemy writes with 13 decimals
            token = pytest.approx(token, rel=0, abs=1e-12)
        assert value == token, (port, recorded_time)


def test_an_aspect_that_is_a_model() -> None:
    """In Ptolemy, what comes to such an aspect waits for its next firing, at the first tag for the next microstep.

    In Epicycle it comes in at once.  So what passes the aspect at the first tag is a microstep earlier here, also when
    its delay of 1 s is over, and all that follows comes at the same tag.
    """
    model = load(QUANTITY_MANAGER)
    expected, inside = came_in(model, recorded(QUANTITY_MANAGER))
    found = [(*send[:4], requested(send[4])) for send in sends(model)]
    assert [send for send in found if send[0] >= 2] == [send for send in expected if send[0] >= 2]

    def ptolemys(send: tuple[float, int, str, int, Any]) -> tuple[float, int, str, int, Any]:
        time, microstep, port, channel, value = send
        behind = {"c.time_delay", "b.scale", "current_time2", "y.scale", "current_time3"}
        late = (time == 0 and port.startswith("c.")) or (time == 1 and port.rpartition(".")[0] in behind)
        return time, microstep + late, port, channel, value

    assert sorted(map(ptolemys, found), key=repr) == sorted(expected, key=repr)
    assert sorted(map(ptolemys, requests(model))) == sorted(inside)


def test_aspects_that_are_models_of_communication_and_of_execution() -> None:
    """The same difference: in Ptolemy, a request that comes after an aspect's turn waits for the next microstep.

    So does what comes at the first tag, and each firing that is asked for when the aspect has let another one happen.
    """
    model = load(REFIRING)
    expected, inside = came_in(model, recorded(REFIRING))
    found = [(*send[:4], requested(send[4])) for send in sends(model)]
    asked = requests(model)
    for ours, theirs in ((found, expected), (asked, inside)):
        assert len(ours) == len(theirs) > 70
        for port in {send[2] for send in theirs}:
            (mine, other) = ([send for send in each if send[2] == port] for each in (ours, theirs))
            assert [(send[0], *send[3:]) for send in mine] == [(send[0], *send[3:]) for send in other]
            for (time, microstep, _, _, value), send in zip(mine, other, strict=True):
                first = time == 0 and port.startswith("communication.")
                follows = time > 1 and port.startswith("execution.") and value != 0 and "server.output" not in port
                after_ramp = time > 1 and port == "communication.request_port2.output"
                assert send[1] - microstep == (first or follows or after_ramp), (port, time)


def test_a_loop_that_ptolemy_refuses() -> None:
    """Ptolemy: ``Found a zero delay loop containing .DEFixedPointLimitation.C1``."""
    assert recorded(REFUSED) == []
    with pytest.raises(ModelError) as caught:
        load(REFUSED)
    assert [problem.message for problem in caught.value.problems] == ["a loop without delay: c1 -> c1"]


def test_every_case_is_here() -> None:
    assert {path.stem for path in (HERE / "models").glob("*.yaml")} == {*CASES, QUANTITY_MANAGER, REFIRING, REFUSED}
    assert {path.stem for path in (HERE / "sends").glob("*.csv")} == {*CASES, QUANTITY_MANAGER, REFIRING, REFUSED}
    assert len({*CASES, QUANTITY_MANAGER, REFIRING, REFUSED}) == 24


def test_the_document_tells_the_same() -> None:
    text = (HERE.parents[1] / "docs" / "ptolemy.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in text.splitlines() if line[:2] == "| "]
    results = {case: row[2] for row in rows if len(row) == 3 for case in row[0].split(", ")}
    assert all("match" in results[case] for case in CASES)
    assert "from 2 s on" in results[QUANTITY_MANAGER]
    assert "matches" in results[REFIRING]
    assert "refused" in results[REFUSED]
    actors = [line.strip("| ").split(" | ") for line in text[text.index("## Actors") :].splitlines() if "` | " in line]
    named = {name for row in actors for name in re.findall(r"`([A-Z]\w+)`", row[0 if row[1] == "the same" else 1])}
    assert len(named) > 40
    assert named - {"PortParameter"} <= set(built_in().actors)
