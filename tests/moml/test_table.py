"""Every row of the table: its actor can be imported, with something at each of its ports."""

from __future__ import annotations

from pathlib import Path

import pytest

from runner.moml.table import _NAMED as ROWS
from runner.moml.table import counterpart_of
from tests.moml.moml_parts import DE, LIB, entity, imported, model, port, wires

NEEDED = {
    **dict.fromkeys(("RecordAssembler", "Expression", "RecordUpdater", "UnionMerge"), port("x", "input")),
    **dict.fromkeys(("RecordDisassembler", "UnionDisassembler"), port("x", "output")),
}  # what somebody adds to it
PARAMETERS: dict[str, dict[str, object]] = {
    "Expression": {"expression": "2 * x"},
    "LookupTable": {"table": "{1, 2}"},
    "SetVariable": {"variableName": "P"},
    "SequenceToArray": {"arrayLength": 2},
}
NOT_WIRED = {"lambda", "alpha", "gamma", "cut", "secondOperand", "pattern"}  # they cannot change, or are one of two
_TRUTHS = ("control", "select", "selector", "enable")


@pytest.mark.parametrize("name", ROWS)
def test_a_row(tmp_path: Path, name: str) -> None:
    java = next(each for each in (f"{LIB}{name}", f"{DE}{name}") if counterpart_of(each) is not None)
    row = counterpart_of(java)
    assert row is not None
    made = entity("A", java, NEEDED.get(name, ""), **PARAMETERS.get(name, {}))
    ports = {**{each: said.face.direction for each, said in row.ports.items()}}
    if name in NEEDED:
        ports["x"] = "output" if "Disassembler" in name else "input"
    clocks, sinks, nets = [], [], []
    for each, direction in ports.items():
        if direction == "input" and each not in NOT_WIRED | ({"n", "p", "mean"} if row.type == "Random" else set()):
            values = "{true}" if each in _TRUTHS or name.startswith("Logic") else "{1}"
            values = '{"a"}' if row.type == "TextFunction" else values
            clocks.append(entity(f"c_{each}", "DiscreteClock", values=values))
            nets.append(f"c_{each}.output A.{each}")
        elif direction == "output":
            sinks.append(entity(f"r_{each}", "Recorder"))
            nets.append(f"A.{each} r_{each}.input")
    text = imported(tmp_path, model(*clocks, made, *sinks, wires(*nets))).text
    assert "  A:" in text
