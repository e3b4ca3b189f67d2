"""Actors that compute something, by what they send: against what the sources of Ptolemy II's actors say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.ptolemy.importing.moml_parts import PARAMETER, TEXT, entity, model, prop, recorded, wires

LIB = "ptolemy.actor.lib."


def computed(tmp_path: Path, java: str, parameters: dict[str, object], inputs: dict[str, str]) -> list[Any]:
    """What an actor sends that gets the values of arrays, one at 0 s, one at 1 s, ... at each of its inputs."""
    said = ""
    for name, value in parameters.items():
        is_text = ".string." in java and isinstance(value, str) and value not in ("true", "false")
        said += prop(name, value, TEXT if is_text else PARAMETER)
    clocks = [
        entity(f"C{name}", "DiscreteClock", values=values, period="1000.0", offsets=offsets)
        for name, text in inputs.items()
        for values, _, offsets in [text.partition(" at ")]
    ]
    nets = [f"C{name}.output A.{name}" for name in inputs]
    text = model(
        *clocks, entity("A", java, said), entity("Recorder", "Recorder"), wires(*nets, "A.output Recorder.input")
    )
    return [token for *_, token in recorded(tmp_path, text)]


COUNT = {"input": "{1, 2, 3, 4} at {0.0, 1.0, 2.0, 3.0}"}
SORTED = {"input": "{{3, 1, 3, 2}} at {0.0}"}


@pytest.mark.parametrize(
    ("java", "parameters", "inputs", "expected"),
    [
        ("Quantizer", {}, {"input": "{0.0, 0.5} at {0.0, 1.0}"}, [-1.0, 1.0]),
        ("Quantizer", {"levels": "{0, 1, 4}"}, {"input": "{0.5, 0.6, 2.5, 9.0} at {0.0, 1.0, 2.0, 3.0}"},
         [0.0, 1.0, 1.0, 4.0]),
        ("ArrayAverage", {}, {"input": "{{1.0, 2.0}} at {0.0}"}, [1.5]),
        ("ArraySort", {}, SORTED, [[1, 2, 3, 3]]),
        ("ArraySort", {"ascending": "false", "allowDuplicates": "false"}, SORTED, [[3, 2, 1]]),
        ("sdf.DotProduct", {}, {"input1": "{{1, 2}} at {0.0}", "input2": "{{3, 4}} at {0.0}"}, [11]),
        ("DB", {}, {"input": "{10.0, 0.0} at {0.0, 1.0}"}, [20.0, -100.0]),
        ("conversions.dB", {"inputIsPower": "true", "min": "-50.0"}, {"input": "{10.0, 1e-9} at {0.0, 1.0}"},
         [10.0, -50.0]),
        ("conversions.LongToDouble", {}, {"input": "{3} at {0.0}"}, [3.0]),
        ("conversions.StringToInt", {}, {"input": '{"12"} at {0.0}'}, [12]),
        ("conversions.StringToBoolean", {}, {"input": '{"true", "x"} at {0.0, 1.0}'}, [True, False]),
        ("ArrayElement", {}, {"input": "{{1, 2}, {3, 4}} at {0.0, 2.0}", "index": "{1} at {1.0}"}, [1, 4]),
        ("ArrayUpdate", {"index": 1, "value": 9}, {"input": "{{1, 2, 3}} at {0.0}"}, [[1, 9, 3]]),
        ("ArrayRemoveElement", {"element": 3}, {"array": "{{3, 1, 3, 2}} at {0.0}"}, [[1, 2]]),
        ("ArrayAppend", {}, SORTED, [[3, 1, 3, 2]]),
        ("ArrayExtract", {"sourcePosition": 1, "extractLength": 2, "outputArrayLength": 2}, SORTED, [[1, 3]]),
        ("ArrayExtract", {"destinationPosition": 1, "outputArrayLength": 3}, SORTED, [[0, 3, 0]]),
        ("string.StringSubstring", {"start": 1, "stop": -1}, {"input": '{"abc"} at {0.0}'}, ["bc"]),
        ("string.StringSubstring", {"stop": 2}, {"input": '{"abc", "def"} at {0.0, 2.0}', "start": "{1} at {1.0}"},
         ["ab", "e"]),
        ("string.StringCompare", {"secondString": "b", "ignoreCase": "true", "function": "endsWith"},
         {"firstString": '{"aB", "x"} at {0.0, 1.0}'}, [True, False]),
        ("string.StringFunction", {"function": "toUpperCase"}, {"input": '{"ab"} at {0.0}'}, ["AB"]),
        ("string.StringIndexOf", {"searchFor": "b"}, {"inText": '{"ab", "x"} at {0.0, 1.0}'}, [1, -1]),
        ("sdf.DownSample", {}, COUNT, [2, 4]),
        ("sdf.DownSample", {"factor": 3, "phase": 2}, COUNT, [1]),
        ("sdf.UpSample", {"factor": 3, "phase": 1}, {"input": "{1.5} at {0.0}"}, [0.0, 1.5, 0.0]),
        ("sdf.UpSample", {}, {"input": "{1} at {0.0}"}, [0, 1]),
        ("sdf.DelayLine", {"initialValues": "{7, 8, 9}"}, COUNT, [[1, 7, 8], [2, 1, 7], [3, 2, 1], [4, 3, 2]]),
    ],
)  # fmt: skip
def test_what_is_computed(
    tmp_path: Path, java: str, parameters: dict[str, object], inputs: dict[str, str], expected: list[Any]
) -> None:
    found = computed(tmp_path, f"{LIB}{java}", dict(parameters), inputs)
    assert found == expected
    assert [type(each) for each in found] == [type(each) for each in expected]
