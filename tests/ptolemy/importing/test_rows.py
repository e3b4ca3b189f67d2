"""What actors of Ptolemy II send for given tokens, by their Java sources, and what is imported of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.ptolemy.importing.moml_parts import DE, LIB, entity, model, notes, port, sent, wires

Fed = dict[str, dict[float, str]]  # what comes at the ports, by its time; several channels are "input 0", "input 1"


def fed(java: str, inputs: Fed, outputs: tuple[str, ...], *ports: str, **parameters: object) -> str:
    """A model in which an actor A gets tokens at certain times."""
    parts, nets = [entity("A", java, *ports, **parameters)], []
    for number, (place, tokens) in enumerate(inputs.items()):
        said = (", ".join(map(str, each)) for each in (tokens, tokens.values()))
        offsets, values = (f"{{{each}}}" for each in said)
        parts.append(entity(f"Clock{number}", "DiscreteClock", period=100, offsets=offsets, values=values))
        nets.append(f"Clock{number}.output A.{place.split()[0]}")
    for number, name in enumerate(outputs):
        parts.append(entity(f"Recorder{number}", "Recorder"))
        nets.append(f"A.{name} Recorder{number}.input")
    return model(*parts, wires(*nets), stop=50)


def answered(tmp_path: Path, text: str) -> list[tuple[float, Any]]:
    """What A sends by its output."""
    return [(time, value) for time, _, place, _, value in sent(tmp_path, text) if place == "A.output"]


THREE = {0.0: "3", 1.0: "5", 2.0: "9"}
CASES: dict[str, tuple[str, Fed, dict[str, object], list[tuple[float, Any]]]] = {
    "the first difference is the token itself": ("Differential", {"input": THREE}, {}, [(0, 3), (1, 2), (2, 4)]),
    "an average of whole numbers is one, and true resets it": (
        "Average",
        {"input": {0: "1", 1: "2", 2: "4", 3: "9"}, "reset": {1: "false", 2: "true"}},
        {},
        [(0, 1), (1, 1), (2, 4), (3, 6)],
    ),
    "an average of others is not": ("Average", {"input": {0: "1.0", 1: "2.0"}}, {}, [(0, 1.0), (1, 1.5)]),
    "a remainder is that of IEEE 754": (
        "Remainder",
        {"input": {0: "0.75", 1: "2.5", 2: "-1.25"}},
        {"divisor": "1.0"},
        [(0, -0.25), (1, 0.5), (2, -0.25)],
    ),
    "a limiter goes from 0 to 1": (
        "Limiter", {"input": {0: "-2.0", 1: "0.5", 2: "2.5"}}, {}, [(0, 0), (1, 0.5), (2, 1)],
    ),
    "a table has 0 and 1": ("LookupTable", {"input": {0: "0", 1: "1", 2: "2"}}, {}, [(0, 0), (1, 1)]),
    "a sum has bounds": (
        "Accumulator",
        {"input": {0: "1", 1: "5", 2: "-9", 3: "2"}},
        {"lowerBound": "-1", "upperBound": "4"},
        [(0, 1), (1, 4), (2, -1), (3, 1)],
    ),
    "any channel that is true resets a sum": (
        "Accumulator",
        {"input": {0: "1", 1: "5", 2: "-9"}, "reset 0": {1: "false"}, "reset 1": {1: "true", 2: "false"}},
        {},
        [(0, 1), (1, 5), (2, -4)],
    ),
    "a tolerance is added to the other side": (
        f"{LIB}logic.Comparator",
        {"left": {0: "1.1"}, "right": {0: "1.0"}},
        {"comparison": "==", "tolerance": "0.1"},
        [(0, True)],
    ),
    "a gate may be in capitals": (
        f"{LIB}logic.LogicGate",
        {"input 0": {0: "true", 1: "false"}, "input 1": {1: "true"}},
        {"logic": "AND"},
        [(0, True), (1, False)],
    ),
    "a multiplexor chooses nothing before it is told": (
        "Multiplexor",
        {"input 0": {0: "1", 1: "2", 2: "3"}, "input 1": {0: "4", 1: "5", 2: "6"}, "select": {1: "1"}},
        {},
        [(1, 5), (2, 6)],
    ),
    "a boolean one keeps what it was told": (
        "BooleanMultiplexor",
        {"trueInput": {0: "1", 1: "2", 2: "3", 3: "7"}, "falseInput": {0: "4", 1: "5", 3: "6"},
         "select": {1: "true", 3: "false"}},
        {},
        [(1, 2), (2, 3), (3, 6)],
    ),
    "an alternate token is read by a second firing": (
        "Default",
        {"preferred": {0: "1", 1: "2"}, "alternate": {1: "5", 2: "6"}},
        {},
        [(0, 1), (1, 2), (1, 5), (2, 6)],
    ),
    "one of several triggers is enough": (
        "Sampler",
        {"input": {0: "1", 1: "2", 2: "3"}, "trigger 0": {1: "1"}, "trigger 1": {2: "1"}},
        {},
        [(1, 2), (2, 3)],
    ),
    "a sequence that repeats holds nothing": (
        "Sequence",
        {"enable": {0: "true", 1: "false", 2: "true", 3: "true"}},
        {"values": "{1, 2}", "repeat": "true", "holdLastOutput": "true"},
        [(0, 1), (2, 2), (3, 1)],
    ),
    "truth values become 1 and 0": (
        f"{LIB}conversions.BooleanToAnything", {"input": {0: "true", 1: "false"}}, {}, [(0, 1), (1, 0)],
    ),
    "a text goes to its end if that is before the start": (
        f"{LIB}string.StringSubstring", {"input": {0: '"abcab"'}}, {"start": "1"}, [(0, "bcab")],
    ),
    "texts are compared at their ends": (
        f"{LIB}string.StringCompare",
        {"firstString": {0: '"abcab"', 1: '"xyz"', 2: '"b"'}},
        {"function": "endsWith", "secondString": "ab"},
        [(0, True), (1, False), (2, False)],
    ),
    "what is extracted stands between zeros": (
        "ArrayExtract",
        {"input": {0: "{1, 2, 3, 4}"}},
        {"sourcePosition": 1, "extractLength": 2, "destinationPosition": 1, "outputArrayLength": 4},
        [(0, [0, 2, 3, 0])],
    ),
    "a gain of 0 is none, and a reset comes late": (
        f"{DE}PID",
        {"input": {0: "1.0", 1: "2.0", 2: "4.0"}, "reset": {1: "1"}},
        {"Kp": "0.0", "Ki": "1.0", "Kd": "1.0"},
        [(0, 0.0), (1, 2.5), (2, 0.0)],
    ),
    "what takes time to compute takes none in the model": (
        "ExecutionTime", {"trigger": {0: "1", 1: "1"}}, {}, [(0, 0), (1, 0)],
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_what_is_sent(tmp_path: Path, case: str) -> None:
    java, inputs, parameters, expected = CASES[case]
    assert answered(tmp_path, fed(java, inputs, ("output",), **parameters)) == expected


@pytest.mark.parametrize("java", ["Sleep", f"{DE}EventFilter", f"{LIB}logic.TrueGate"])
def test_channels_go_on_side_by_side(tmp_path: Path, java: str) -> None:
    inputs: Fed = {"input 0": {0: "true"}, "input 1": {0: "true", 1: "true"}}
    text = fed(java, inputs, ("output", "output"))
    found = [(time, channel) for time, _, place, channel, _ in sent(tmp_path, text) if place == "A.output"]
    assert found == [(0, 0), (0, 1), (1, 1)]


def test_fields_that_nothing_is_wired_to_do_not_count(tmp_path: Path) -> None:
    made = fed("RecordAssembler", {"b": {0: "1"}}, ("output",), port("b", "input"), port("c", "input"))
    assert answered(tmp_path, made) == [(0, {"b": 1})]
    taken = fed("RecordDisassembler", {"input": {0: "{b = 1}"}}, ("b",), port("b", "output"), port("c", "output"))
    assert [value for *_, place, _, value in sent(tmp_path, taken) if place == "A.b"] == [1]


def test_what_cannot_be_measured_is_told(tmp_path: Path) -> None:
    text = fed("ExecutionTime", {"trigger": {0: "1"}}, ("output",))
    assert notes(tmp_path, text) == ["A: in Ptolemy, it sends the real time of a computation, in ms; here, 0"]
