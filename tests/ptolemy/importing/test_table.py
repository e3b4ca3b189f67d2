"""Every row of the table: with something at each port, and all parameters given, it is imported and runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.ptolemy.importing.table import Row, row_of, table
from tests.ptolemy.importing.moml_parts import DE, LIB, TEXT, entity, model, notes, port, prop, run, wires

ROWS = [name for name, said in table("rows").items() if isinstance(said, dict)]
NEEDED = {
    **dict.fromkeys(("RecordAssembler", "Expression", "RecordUpdater", "UnionMerge"), port("x", "input")),
    **dict.fromkeys(("RecordDisassembler", "UnionDisassembler"), port("x", "output")),
}  # what somebody adds to it
VALUES = {
    "end": "9.0", "flag": "true", "limit": "3", "list": "{1}", "number": "1.0", "once": "1.0", "pattern": '"a"',
    "text": '"a"', "time": "1.0", "times": "{0.0}", "value": "1", "whole": "1",
}  # fmt: skip
GIVEN: dict[str, dict[str, object]] = {
    "Expression": {"expression": "2 * x"},
    "Pulse": {"indexes": "{0}"},
    "NonStrictTest": {"correctValues": "{1}"},
    "PublisherTest": {"correctValues": "{1}"},
    "Test": {"correctValues": "{1}"},
    "SetVariable": {"variableName": "P"},
    "Sequence": {"repeat": "false"},
    "IIR": {"numerator": "{1.0}", "denominator": "{1.0}"},
}
# What cannot change in a run, and what does not go with something else.
NOT_WIRED = {
    "mean",
    "standardDeviation",
    "lowerBound",
    "upperBound",
    "trueProbability",
    "min",
    "max",
    "mode",
    "n",
    "p",
    "freedom",
    "lambda",
    "alpha",
    "gamma",
    "cut",
    "pattern",
    "newServiceTime",
    "defaultDelay",
}
FED = {
    "ArrayToElements": "{1, 2}", "ArrayToSequence": "{1, 2}", "ArrayAppend": "{1, 2}", "DotProduct": "{1, 2}",
    "RecordDisassembler": "{x = 1}", "RecordUpdater": "{y = 1}", "UnionDisassembler": "{x = 1}",
    "StringLength": '"a"', "StringSubstring": '"a"', "StringToInt": '"1"', "StringToDouble": '"1"',
    "StringToBoolean": '"true"',
}  # fmt: skip
PORTS_FED = {
    "control": "true", "enable": "true", "selector": "true", "select": "true", "array": "{1, 2}",
    "readKeyArray": "{1, 2}",
    "standardDeviation": "1.0", "upperBound": "2.0", "max": "2.0", "mode": "1.5", "p": "0.5", "trueProbability": "0.5",
}  # fmt: skip
SAID = {
    "ExecutionTime": ["A: in Ptolemy, it sends the real time of a computation, in ms; here, 0"],
    "SequentialClock": ["A: in Ptolemy, cycles count from the first offset; here, from 0"],
    "TopLevelCurrentTime": ["A: in Ptolemy, it sends the time of the model; here, that of its composite"],
    "SequenceToArray": ["A.arrayLength has no counterpart; its wires are left out"],
    "TestActorPortDepth": ["A: in Ptolemy, it sends the depths of all actors and ports; here, an empty text"],
    "SingleEvent": ["A.trigger has no counterpart; its wires are left out"],
}


def token(name: str, row: Row, port_name: str) -> str:
    """What is fed to a port."""
    if row.type == "TextFunction":
        return '"a"'
    if name.startswith("Logic") or name in ("EventFilter", "TrueGate", "BooleanToAnything"):
        return "true"
    if name.startswith("Array") and port_name == "input" and name != "ArrayAppend":
        return "{1, 2}"
    if port_name in ("control", "select") and row.type in ("Switch", "Select"):
        return "0"
    return PORTS_FED.get(port_name) or (FED.get(name) if port_name.startswith("input") else None) or "1"


@pytest.mark.parametrize("name", ROWS)
def test_a_row(tmp_path: Path, name: str) -> None:
    java = next(each for each in (f"{LIB}{name}", f"{DE}{name}") if row_of(each) is not None)
    row = row_of(java)
    assert row is not None
    known = {key: each for key, each in row.parameters.items() if key not in NOT_WIRED or key == "pattern"}
    said = {key: VALUES[each.kind] for key, each in known.items() if each.kind in VALUES}
    said |= {key: str(value) for key, value in GIVEN.get(name, {}).items()}
    texts = "".join(prop(key, "a", TEXT) for key, each in row.parameters.items() if each.kind in ("text", "pattern"))
    made = entity("A", java, NEEDED.get(name, ""), texts, **{k: v for k, v in said.items() if v != VALUES["text"]})
    ports = {each: port_said.direction for each, port_said in row.ports.items()}
    if name in NEEDED:
        ports["x"] = "output" if "Disassembler" in name else "input"
    clocks, sinks, nets = [], [], []
    left_out = NOT_WIRED | ({"p"} if name == "ColtNegativeBinomial" else set())
    for each, direction in ports.items():
        if direction == "input" and each not in left_out:
            values = f"{{{token(name, row, each)}}}"
            clocks.append(entity(f"c_{each}", "DiscreteClock", values=values))
            nets.append(f"c_{each}.output A.{each}")
        elif direction == "output":
            sinks.append(entity(f"r_{each}", "Recorder"))
            nets.append(f"A.{each} r_{each}.input")
    text = model(*clocks, made, *sinks, wires(*nets), stop=2)
    assert notes(tmp_path, text) == SAID.get(name, [])
    assert "A" in run(tmp_path, text).model.graph.actors


@pytest.mark.parametrize("name", ROWS)
def test_a_row_to_which_nothing_is_connected(tmp_path: Path, name: str) -> None:
    """It is left out, unless it begins something by itself."""
    java = next(each for each in (f"{LIB}{name}", f"{DE}{name}") if row_of(each) is not None)
    made = entity("A", java, NEEDED.get(name, ""), **GIVEN.get(name, {}))
    others = entity("Clock", "DiscreteClock") + entity("Recorder", "Recorder")
    run(tmp_path, model(made, others, wires("Clock.output Recorder.input"), stop=1))
