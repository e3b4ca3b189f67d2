"""``extends``: what a class makes of its base; the same class written out in full is the yardstick."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.runner import ModelError, Simulation
from epicycle.runner.model.build.composite_class import load_composite
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.build.model import Model
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
    "another type keeps values and count": (
        "actors: {hold: {type: Anything}}",
        {"type: Hold": "type: Anything"},
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
        "hops": sorted((edge.source, edge.destination, edge.delay or 0) for edge in graph.edges),
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


MODEL = """
model: base
doc: A base.
parameters: {start: 2 m, p: 0.5, far: {value: 1, unit: m}}
actors:
  ramp: {type: Ramp, inherit: all}
  gain: {type: Gain, factor: 3, times: 2}
  other: {type: Ramp, start: "${far}"}
connections: [ramp.output -> gain.input]
aspects: {loss: {type: PacketLoss, probability: "${p}", at: gain.input}}
run: {stop: 2 s, seed: 3, record: gain.output}
metrics: {count: {of: gain.output, take: count}, last: {of: ramp.output, take: last}}
monitors: {low: always gain.output < 100}
"""
HEIR = """
model: heir
extends: base.yaml
parameters: {start: 3, factor: 4}
actors: {other: null, ramp: {type: Pair}, gain: {inherit: factor, times: 5}, end: {type: Sum}}
composites: {Pair: {parameters: {start: }, outputs: [output], actors: {r: {type: Ramp, inherit: all}},
  connections: [r.output -> output]}}
connections: [gain.output -> end.input]
run: {seed: 4}
metrics: {count: {of: ramp.output, take: count}}
"""
WRITTEN_OUT = """
model: heir
doc: A base.
parameters: {start: 3 m, p: 0.5, factor: 4}
composites: {Pair: {parameters: {start: }, outputs: [output], actors: {r: {type: Ramp, inherit: all}},
  connections: [r.output -> output]}}
actors:
  ramp: {type: Pair, inherit: all}
  gain: {type: Gain, inherit: factor, times: 5}
  end: {type: Sum}
connections: [ramp.output -> gain.input, gain.output -> end.input]
aspects: {loss: {type: PacketLoss, probability: "${p}", at: gain.input}}
run: {stop: 2 s, seed: 4, record: gain.output}
metrics: {count: {of: ramp.output, take: count}, last: {of: ramp.output, take: last}}
monitors: {low: always gain.output < 100}
"""


def test_a_model_that_extends_another_is_as_if_it_were_written_out(tmp_path: Path) -> None:
    for name, text in (("base", MODEL), ("heir", HEIR), ("long", WRITTEN_OUT)):
        (tmp_path / f"{name}.yaml").write_text(text)
    short, long = (load_model(tmp_path / f"{name}.yaml", types=TYPES) for name in ("heir", "long"))
    assert (short.name, short.doc, short.stop) == ("heir", "A base.", 2.0)
    assert {**long.parameters, "far": 1.0} == short.parameters
    one, other = (Simulation(each, seed=4).run() for each in (short, long))
    assert (one.digest, one.metrics) == (other.digest, other.metrics)
    assert [*one.metrics] == ["count", "last", "low", "low_robustness"]
    assert repr(short.graph.actors) == repr(long.graph.actors)
    assert sorted(short.graph.actors) == ["end", "gain", "ramp.r"]


def test_a_chain_of_models_that_include_the_same_file(tmp_path: Path) -> None:
    (tmp_path / "parts.yaml").write_text("composites: {Part: {actors: {r: {type: Ramp}}}}\n")
    start = "model: {}\ninclude: parts.yaml\n"
    (tmp_path / "a.yaml").write_text(start.format("a") + "actors: {p: {type: Part}}\nrun: {stop: 1 s}\n")
    (tmp_path / "b.yaml").write_text(start.format("b") + "extends: a.yaml\nactors: {p: {count: 2}}\n")
    (tmp_path / "c.yaml").write_text(start.format("c") + "extends: b.yaml\nactors: {q: {type: Part}}\n")
    assert sorted(load_model(tmp_path / "c.yaml", types=TYPES).graph.actors) == ["p[0].r", "p[1].r", "q.r"]


def test_a_packaged_model_may_be_extended(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("model: slow\nextends: mm1\nparameters: {load: 0.1}\n")
    assert load_model(tmp_path / "m.yaml").parameters["load"] == 0.1


def test_an_empty_list_of_a_run_replaces_that_of_the_base(tmp_path: Path) -> None:
    run = "run: {stop: 1 s, stop_when: clock.output, record: clock.output}"
    (tmp_path / "base.yaml").write_text(f"model: base\nactors: {{clock: {{type: Clock, period: 1}}}}\n{run}\n")
    (tmp_path / "m.yaml").write_text("model: m\nextends: base.yaml\nrun: {stop_when: , record: []}\n")
    output = load_model(tmp_path / "m.yaml").output
    assert (output.recorded, output.stop_ports, output.stop_time) == ([], [], 10**9)


def test_a_copy_of_a_class_that_the_base_has_too(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    part = "composites: {Part: {actors: {r: {type: Ramp}}}}\n"
    (tmp_path / "lib" / "a.yaml").write_text(f"model: a\n{part}actors: {{p: {{type: Part}}}}\nrun: {{stop: 1 s}}\n")
    (tmp_path / "m.yaml").write_text(f"model: m\nextends: lib/a.yaml\n{part}actors: {{q: {{type: Part}}}}\n")
    assert sorted(load_model(tmp_path / "m.yaml", types=TYPES).graph.actors) == ["p.r", "q.r"]
    (tmp_path / "m.yaml").write_text("model: m\nextends: lib/a.yaml\ncomposites: {Part: {actors: {s: {type: Ramp}}}}\n")
    with pytest.raises(ModelError, match="composite 'Part' is defined twice"):
        load_model(tmp_path / "m.yaml", types=TYPES)
