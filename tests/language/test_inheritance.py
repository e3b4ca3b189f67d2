"""``extends``: what a class makes of its base; the same class written out in full is the yardstick."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.runner.build import Model, load_composite, load_model
from tests.model.model_parts import TYPES

BASE = """
  Base:
    parameters: {gain: {value: 2, min: 0, max: 9}, level: {value: 1, unit: m}, p: 0.5}
    inputs: [in]
    outputs: [out]
    actors:
      ramp: {type: Ramp, start: "${level}"}
      gain: {type: Gain, factor: "${gain}", times: 3}
      sum: {type: Sum}
      hold: {type: Hold, count: 2}
    connections:
      - in, ramp.output -> sum.input
      - sum.output -> gain.input, hold[0].input, hold[1].input
      - gain.output, hold[0].output -> out
      - {from: ramp.output, to: sum.input, delay: 5 ms}
    aspects:
      loss: {type: PacketLoss, probability: "${p}", at: [gain.input, "hold[*].input"]}
      other: {type: PacketLoss, probability: 0, at: gain.input}
"""
# What the derived class says, and what is written otherwise in the base to the same effect.
CASES: dict[str, tuple[str, dict[str, str]]] = {
    "nothing": ("", {}),
    "defaults": (
        "parameters: {gain: 4, level: 2 mm, p: {value: 0.6, max: 0.7}}",
        {"value: 2, min": "value: 4, min", "value: 1, unit": "value: 0.002, unit", "p: 0.5": "p: 0.6"},
    ),
    "values": (
        "actors: {gain: {times: 5}, hold: {count: 3}, ramp: {type: Ramp, start: 4 m}}",
        {"times: 3": "times: 5", "count: 2": "count: 3", '"${level}"': "4 m", "level: {value: 1, unit: m}, ": ""},
    ),
    "another type keeps the count": (
        "actors: {gain: {type: Anything}, hold: {type: Anything}}",
        {
            'type: Gain, factor: "${gain}", times: 3': "type: Anything",
            "type: Hold": "type: Anything",
            "gain: {value: 2, min: 0, max: 9}, ": "",
        },
    ),
    "without an actor": (
        "actors: {hold: null}",
        {
            "      hold: {type: Hold, count: 2}\n": "",
            ", hold[0].input, hold[1].input": "",
            ", hold[0].output": "",
            '[gain.input, "hold[*].input"]': "gain.input",
        },
    ),
    "without connections": (
        (
            "connections: [{remove: 'sum.output -> hold[0].input'}, {remove: 'in, ramp.output -> sum.input'}, "
            "in -> sum.input, {remove: {from: 'hold[0].output', to: out}}]"
        ),
        {
            "      - in, ramp.output -> sum.input\n": "",
            "hold[0].input, ": "",
            ", hold[0].output": "",
            "{from: ramp.output, to: sum.input, delay: 5 ms}": "in -> sum.input",
        },
    ),
    "aspects": (
        (
            "aspects: {loss: {probability: 0.25, spare_first: true}, other: null, "
            "new: {type: PacketLoss, probability: 1, at: gain.input}}"
        ),
        {
            '"${p}"': "0.25, spare_first: true",
            ", p: 0.5": "",
            "other: {type: PacketLoss, probability: 0": "new: {type: PacketLoss, probability: 1",
        },
    ),
    "more ports and actors": (
        (
            "inputs: [also], outputs: [label], actors: {more: {type: Ramp}}, "
            "connections: [also -> sum.input, more.label -> label]"
        ),
        {
            "[in]": "[in, also]",
            "[out]": "[out, label]",
            "      sum: {": "      more: {type: Ramp}\n      sum: {",
            "5 ms}\n": "5 ms}\n      - also -> sum.input\n      - more.label -> label\n",
        },
    ),
}


def load(composites: str, type_name: str, tmp_path: Path) -> Model:
    path = tmp_path / "m.yaml"
    path.write_text(
        f"model: m\ncomposites:{composites}\nactors: {{r: {{type: Ramp}}, x: {{type: {type_name}, count: 2}}}}\n"
        'connections: ["r.output -> x[*].in"]\nrun: {record: "x[*].out"}\n'
    )
    return load_model(path, types=TYPES)


def content(model: Model) -> dict[str, object]:
    """All that makes a model, but for positions and the order in which actors are declared."""
    graph = model.graph
    return {
        "actors": sorted(f"{path} {actor!r}" for path, actor in graph.actors.items()),
        "ports": sorted(graph.ports),
        "hops": sorted((hop.source, hop.destination, hop.delay or 0) for hop in graph.hops),
        "aspects": [(woven.name, repr(woven.aspect), sorted(woven.ports)) for woven in model.aspects],
        "channels": [
            [wire.source.path for wire in graph.wires_to(graph.actors[f"x[{i}].sum"].inputs["input"])] for i in (0, 1)
        ],
    }


@pytest.mark.parametrize("case", CASES)
def test_as_if_it_were_written_out(case: str, tmp_path: Path) -> None:
    change, edits = CASES[case]
    written = BASE
    for old, new in edits.items():
        assert old in written
        written = written.replace(old, new)
    expected = content(load(written, "Base", tmp_path))
    derived = f"{BASE}\n  Derived: {{extends: Base{', ' if change else ''}{change}}}"
    assert content(load(derived, "Derived", tmp_path)) == expected


def test_a_chain_in_any_order_and_the_base_unchanged(tmp_path: Path) -> None:
    text = (
        "\n  Third: {extends: Second, actors: {gain: {times: 9}}}"
        f"\n  Second: {{extends: Base, parameters: {{gain: 7}}, actors: {{hold: null}}}}{BASE}"
    )
    third = load(text, "Third", tmp_path).graph.actors["x[0].gain"]
    assert (vars(third)["factor"], vars(third)["times"]) == (7.0, 9)
    base = load(text, "Base", tmp_path).graph.actors
    assert (vars(base["x[0].gain"])["factor"], vars(base["x[0].gain"])["times"]) == (2.0, 3)
    assert "x[0].hold[1]" in base


def test_a_long_chain_ends(tmp_path: Path) -> None:
    chain = "".join(f"\n  C{i}: {{extends: C{i + 1}}}" for i in range(2000))
    with pytest.raises(Exception, match="C0 has a chain of more than 50 bases"):
        load(f"{chain}\n  C2000: {{}}", "C0", tmp_path)


def test_a_derived_class_in_python(tmp_path: Path) -> None:
    path = tmp_path / "library.yaml"
    path.write_text(
        "composites:\n"
        "  Twice: {outputs: [out], actors: {r: {type: Ramp, start: 2}}, connections: [r.output -> out]}\n"
        "  Thrice: {extends: Twice, actors: {r: {start: 3}}}\n"
    )
    model = Model("m")
    model.add(load_composite(path, "Thrice", types=TYPES)("t"))
    assert vars(model.graph.actors["t.r"])["start"] == 3.0
