"""Who is wired to whom: pairs, all to all, ranges and computed indices."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epicycle.actors import Actor, FaultError, InputPort, OutputPort
from epicycle.runner.model.build.connect import indices_of as resolve
from epicycle.runner.model.build.load import load_model
from tests.model.model_parts import TYPES


def edges(text: str, tmp_path: Path, *settings: str) -> list[str]:
    """The connections of a model, in their order, as 'source -> destination'."""
    path = tmp_path / "m.yaml"
    path.write_text("model: m\n" + text, encoding="utf-8")
    graph = load_model(path, types=[*TYPES, Cell], set=settings).graph
    return [str(edge).replace(".output", "").replace(".input", "") for edge in graph.edges]


class Cell(Actor):
    """Takes any number of connections, and may stand in a loop."""

    input = InputPort(float, multi=True, required=False)
    output = OutputPort(float, depends_on=())


CELLS = "parameters: {n: 3, k: 1}\nactors: {c: {type: Cell, count: '${n}'}, s: {type: Cell, count: '${n + k - 1}'}}\n"
CASES = [
    ("c[*].output -> s[*].input", "c0-s0 c1-s1 c2-s2"),
    ("c[1].output -> s[*].input", "c1-s0 c1-s1 c1-s2"),
    ("c[*].output -> s[-1].input", "c0-s2 c1-s2 c2-s2"),
    ("c[*].output => s[*].input", "c0-s0 c0-s1 c0-s2 c1-s0 c1-s1 c1-s2 c2-s0 c2-s1 c2-s2"),
    ("c[*].output => c[*].input", "c0-c1 c0-c2 c1-c0 c1-c2 c2-c0 c2-c1"),  # not to themselves
    ("c[0].output => c[*].input", "c0-c1 c0-c2"),
    ("c[..-2].output -> c[1..].input", "c0-c1 c1-c2"),
    ("c[*].output -> c[1.., 0].input", "c0-c1 c1-c2 c2-c0"),
    ("c[*].output -> s[${[n - 1 - i for i in range(n)]}].input", "c0-s2 c1-s1 c2-s0"),
    ("c[0..${n - 2}].output -> s[${k}..${n - 1}].input", "c0-s1 c1-s2"),
    ("c[2, 0].output, c[1].output -> s[0, 1].input, s[2].input", "c2-s0 c0-s1 c2-s2 c0-s2 c1-s0 c1-s1 c1-s2"),
    ("'[c[0].output, c[1].output] -> [s[0].input]'", "c0-s0 c1-s0"),
    (
        '{from: "c[2, 0].output, c[1].output", to: "s[0, 1].input, s[2].input"}',
        "c2-s0 c0-s1 c2-s2 c0-s2 c1-s0 c1-s1 c1-s2",
    ),
]


@pytest.mark.parametrize(("connection", "expected"), CASES)
def test_three_of_each(connection: str, expected: str, tmp_path: Path) -> None:
    found = edges(f"{CELLS}connections:\n  - {connection}\n", tmp_path)
    assert " ".join(edge.replace("[", "").replace("]", "").replace(" -> ", "-") for edge in found) == expected


def test_all_to_all_in_a_mapping(tmp_path: Path) -> None:
    form = '{from: "c[*].output", to: ["c[*].input", "s[0].input"], all: true, delay: "${n * 10} ms"}'
    assert edges(f"{CELLS}connections: [{form}]\n", tmp_path) == [
        "c[0] -> c[1]", "c[0] -> c[2]", "c[1] -> c[0]", "c[1] -> c[2]", "c[2] -> c[0]", "c[2] -> c[1]",
        "c[0] -> s[0]", "c[1] -> s[0]", "c[2] -> s[0]",
    ]  # fmt: skip


@pytest.mark.parametrize("n", [0, 1, 2, 5])
def test_every_form_stands_at_every_count(n: int, tmp_path: Path) -> None:
    lines = [
        "c[*].output -> c[1.., 0].input",
        "c[*].output => c[*].input",
        "c[..-2].output -> c[1..].input",
        "c[0..${n - 2}].output -> c[1..${n - 1}].input",
        "c[0].output -> s[*].input",
        "c[-1].output, c[*].output -> s[0].input",
    ]
    text = CELLS + "connections:\n" + "".join(f"  - {line}\n" for line in lines)
    expected = n + n * (n - 1) + 2 * max(n - 1, 0) + n + (1 + n if n else 0)
    assert len(edges(text, tmp_path, f"n={n}")) == expected


def test_own_ports_and_the_order_of_channels(tmp_path: Path) -> None:
    text = """
composites:
  Box: {inputs: [in], outputs: [out], connections: [in => out]}
actors:
  r: {type: Ramp, count: 3}
  box: {type: Box}
  s: {type: Sum}
connections:
  - r[2, 0].output -> s.input
  - r[1].output -> box.in
  - box.out -> s.input
  - r[0].output -> s.input
"""
    path = tmp_path / "m.yaml"
    path.write_text("model: m" + text)
    graph = load_model(path, types=TYPES).graph
    wires = graph.wires_to(graph.actors["s"].inputs["input"])
    assert [wire.source.path for wire in wires] == [f"r[{i}].output" for i in (2, 0, 1, 0)]


@given(st.integers(0, 8), st.one_of(st.none(), st.integers(-9, 9)), st.one_of(st.none(), st.integers(-9, 9)))
def test_ranges_are_slices_with_both_ends(count: int, start: int | None, end: int | None) -> None:
    text = f"{'' if start is None else start}..{'' if end is None else end}"
    # Python's slices leave out their end, and cut whatever lies outside.
    stop = None if end is None or end == -1 else end + 1
    expected = list(range(count))[slice(start, stop)]
    bounds = [each for each in (start, end) if each is not None]
    closed = len(bounds) == 2 and min(bounds) >= 0
    beyond = any(each >= count for each in bounds) and (closed or start is None or expected)
    if count and (beyond or (closed and bounds[1] < bounds[0])):
        with pytest.raises(FaultError):
            resolve(text, "a", count, lambda _: None)
    else:
        assert resolve(text, "a", count, lambda _: None) == (expected, True)


@pytest.mark.parametrize(("ends", "expected"), [("1..${0}", []), ("${2}..1", []), ("${1}..${2}", [1, 2])])
def test_a_range_that_is_computed_may_be_empty(ends: str, expected: list[int]) -> None:
    assert resolve(ends, "a", 3, lambda text: int(text[2:-1])) == (expected, True)
    with pytest.raises(FaultError, match=r"^a\[\$\{2\}..0\]: the range 2..0 runs backwards$"):
        resolve("${2}..0", "a", 3, lambda text: int(text[2:-1]))
