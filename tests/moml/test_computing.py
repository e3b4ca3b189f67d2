"""Actors that compute something, by what they send: against what the sources of Ptolemy II's actors say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.moml.moml_parts import entity, model, prop, recorded, wires

LIB = "ptolemy.actor.lib."


def computed(tmp_path: Path, java: str, parameters: dict[str, object], inputs: dict[str, str]) -> list[Any]:
    """What an actor sends that gets the values of arrays, one at 0 s, one at 1 s, ... at each of its inputs."""
    output = parameters.pop("_output", "output")
    said = "".join(prop(name, value) for name, value in parameters.items())
    clocks = [
        entity(f"C{name}", "DiscreteClock", values=values, period="1000.0", offsets=offsets)
        for name, text in inputs.items()
        for values, _, offsets in [text.partition(" at ")]
    ]
    nets = [f"C{name}.output A.{name}" for name in inputs]
    text = model(
        *clocks, entity("A", java, said), entity("Recorder", "Recorder"), wires(*nets, f"A.{output} Recorder.input")
    )
    return [token for *_, token in recorded(tmp_path, text)]


SORTED = {"input": "{{3, 1, 3, 2}} at {0.0}"}


@pytest.mark.parametrize(
    ("java", "parameters", "inputs", "expected"),
    [
        ("Quantizer", {}, {"input": "{0.0, 0.5} at {0.0, 1.0}"}, [-1.0, 1.0]),
        ("Quantizer", {"levels": "{0, 1, 4}"}, {"input": "{0.5, 0.6, 2.5, 9.0} at {0.0, 1.0, 2.0, 3.0}"},
         [0.0, 1.0, 1.0, 4.0]),
        ("ArraySort", {}, SORTED, [[1, 2, 3, 3]]),
        ("ArraySort", {"ascending": "false", "allowDuplicates": "false"}, SORTED, [[3, 2, 1]]),
        ("sdf.DotProduct", {}, {"input1": "{{1, 2}} at {0.0}", "input2": "{{3, 4}} at {0.0}"}, [11]),
        ("DB", {}, {"input": "{10.0, 0.0} at {0.0, 1.0}"}, [20.0, -100.0]),
        ("conversions.dB", {"inputIsPower": "true", "min": "-50.0"}, {"input": "{10.0, 1e-9} at {0.0, 1.0}"},
         [10.0, -50.0]),
        ("conversions.LongToDouble", {}, {"input": "{3} at {0.0}"}, [3.0]),
        ("conversions.StringToInt", {}, {"input": '{"12"} at {0.0}'}, [12]),
        ("conversions.StringToBoolean", {}, {"input": '{"true", "x"} at {0.0, 1.0}'}, [True, False]),
    ],
)  # fmt: skip
def test_what_is_computed(
    tmp_path: Path, java: str, parameters: dict[str, object], inputs: dict[str, str], expected: list[Any]
) -> None:
    found = computed(tmp_path, f"{LIB}{java}", dict(parameters), inputs)
    assert found == expected
    assert [type(each) for each in found] == [type(each) for each in expected]
