"""The drawing of model graphs: what every drawing must have, and what is drawn of a model."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from itertools import combinations, pairwise
from pathlib import Path

import networkx as nx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from epicycle.runner import load_model
from epicycle.runner.build import Model
from epicycle.runner.catalogue import packaged_models
from epicycle.runner.commands.options import BAD_INPUT
from epicycle.runner.show.graph import mermaid, outline, write_graph
from epicycle.runner.show.graph.layers import Cell, Net, Pin, Run
from epicycle.runner.show.graph.layout import Drawing, Line, PlacedBox, draw
from epicycle.runner.show.graph.outlines import Box, Link, Outline, Port
from epicycle.runner.show.graph.places import tracks

Rectangle = tuple[float, float, float, float]  # left, top, right, bottom


# -- what must hold for every drawing -----------------------------------------------------------------------------


def meet(one: Rectangle, other: Rectangle, by: float = 0.01) -> bool:
    """Whether two rectangles have more than an edge in common."""
    return (
        one[0] + by < other[2] and other[0] + by < one[2] and one[1] + by < other[3] and other[1] + by < one[3]
    )  # fmt: skip


def outside(inner: Rectangle, outer: Rectangle) -> bool:
    """Whether a rectangle reaches out of another one."""
    return inner[0] < outer[0] or inner[1] < outer[1] or inner[2] > outer[2] or inner[3] > outer[3]


def area(box: PlacedBox) -> Rectangle:
    return box.x, box.y, box.x + box.width, box.y + box.height


def strokes(lines: tuple[Line, ...]) -> Iterator[Rectangle]:
    """The straight pieces of lines, as rectangles without width."""
    for line in lines:
        for (x, y), (u, v) in pairwise(line):
            yield min(x, u), min(y, v), max(x, u), max(y, v)


def words_of(drawing: Drawing) -> list[tuple[str, Rectangle]]:
    """The places of all texts, badges included."""
    found = []
    for each in drawing.words:
        left = each.x - {"left": 0.0, "center": 0.5, "right": 1.0}[each.align] * each.width
        found.append((each.text, (left, each.y - 0.75 * each.size, left + each.width, each.y + 0.2 * each.size)))
    return found + [(each.text, (each.x, each.y - 6.0, each.x + each.width, each.y + 6.0)) for each in drawing.pills]


def check(drawing: Drawing) -> None:
    """Assert everything that makes a drawing right."""
    boxes = {placed.box.path: placed for placed in drawing.boxes}
    sheet = (0.0, 0.0, drawing.width, drawing.height)
    ports = {port.port.path: port for placed in drawing.boxes for port in placed.ports}
    assert set(boxes) == {box.path for box in drawing.outline.root.walk()}

    for placed in drawing.boxes:
        around = boxes.get(placed.box.path.rpartition(".")[0])
        left, top, right, bottom = area(around) if around else sheet
        assert not outside(area(placed), (left + 4, top + 4, right - 4, bottom - 4))
        for port in placed.ports:  # inputs on the left edge, outputs on the right one
            assert port.x == (placed.x if port.port in placed.box.inputs else placed.x + placed.width)
            assert placed.y < port.y < placed.y + placed.height
        for one, other in combinations([boxes[child.path] for child in placed.box.children], 2):
            assert not meet(area(one), area(other)), (one.box.path, other.box.path)
    for one, other in combinations([boxes[child.path] for child in drawing.outline.root.children], 2):
        assert not meet(area(one), area(other)), (one.box.path, other.box.path)

    # Each connection is drawn, from its port to its port, and nothing is drawn that is no connection.
    scopes = [drawing.outline.root, *(box for box in drawing.outline.root.walk() if box.is_open)]
    links = {(link.source, link.target) for scope in scopes for link in scope.links}
    assert {(wire.source, target) for wire in drawing.wires for target in wire.targets} == links
    for wire in drawing.wires:
        graph: nx.Graph[tuple[float, float]] = nx.Graph()
        for line in wire.lines:
            for (x, y), (u, v) in pairwise(line):
                assert x == u or y == v, "a line that is neither horizontal nor vertical"
                graph.add_edge((x, y), (u, v))
        start = (ports[wire.source].x, ports[wire.source].y)
        ends = {(ports[target].x, ports[target].y) for target in wire.targets}
        assert nx.is_connected(graph)
        assert nx.is_tree(graph)
        assert {point for point, degree in graph.degree if degree == 1} == {start, *ends}
        assert set(wire.heads) == ends

    # Lines keep out of boxes that they do not belong to, and do not lie on each other without a common port.
    for wire in drawing.wires:
        for stroke in strokes(wire.lines):
            for placed in drawing.boxes:
                if placed.level >= wire.level:
                    left, top, right, bottom = area(placed)
                    assert not meet(stroke, (left + 1, top + 1, right - 1, bottom - 1), 0.0), (wire, placed.box.path)
    for one_wire, other_wire in combinations(drawing.wires, 2):
        if {one_wire.source, *one_wire.targets} & {other_wire.source, *other_wire.targets}:
            continue
        for a in strokes(one_wire.lines):
            for b in strokes(other_wire.lines):
                if a[0] == a[2] == b[0] == b[2]:
                    assert min(a[3], b[3]) <= max(a[1], b[1]), (one_wire, other_wire)
                if a[1] == a[3] == b[1] == b[3]:
                    assert min(a[2], b[2]) <= max(a[0], b[0]), (one_wire, other_wire)

    # Text can be read: it lies on no other text, on no edge of a box, and on no line but that of its own badge.
    texts = words_of(drawing)
    for (one_text, one_area), (other_text, other_area) in combinations(texts, 2):
        assert not meet(one_area, other_area), (one_text, other_text)
    for text, place in texts:
        for left, top, right, bottom in map(area, drawing.boxes):
            for edge in ((left, top, left, bottom), (right, top, right, bottom), (left, top, right, top)):
                assert not meet(place, edge, 0.0), text
    for text, place in texts[: len(drawing.words)]:
        for wire in drawing.wires:
            assert not any(meet(place, stroke, 0.0) for stroke in strokes(wire.lines)), (text, wire)
    for pill, (_, place) in zip(drawing.pills, texts[len(drawing.words) :], strict=True):
        for wire in drawing.wires:
            for stroke in strokes(wire.lines):
                assert not meet(place, stroke, 0.0) or stroke[1] == stroke[3] == pill.y, (pill, wire)


@st.composite
def boxes(draw_from: st.DrawFn, path: str = "", level: int = 0) -> Box:
    """Any box with what is in it."""
    number = st.integers(0, 3)

    def some_ports(side: str) -> list[Port]:
        count = draw_from(number) if path else 0
        aspects = st.lists(st.sampled_from(["loss", "a_long_name"]), max_size=2, unique=True).map(tuple)
        return [Port(f"{path}.{side}{n}", f"{side}{n}", n == 1, draw_from(aspects)) for n in range(count)]

    name = path.rpartition(".")[2]
    box = Box(path, name, "Composite" if level < 2 else "T", some_ports("in"), some_ports("out"))
    box.is_composite = not path or (level < 3 and draw_from(st.booleans()))
    if not box.is_composite:
        return box
    if path and draw_from(st.sampled_from([False, False, True])):
        box.is_closed, box.aspects = True, draw_from(st.sampled_from([(), ("inner",), ("inner", "loss")]))
        return box
    box.children = [
        draw_from(boxes(f"{path}.b{n}" if path else f"b{n}", level + 1)) for n in range(draw_from(st.integers(0, 5)))
    ]
    sources = [port.path for port in (*box.inputs, *(p for child in box.children for p in child.outputs))]
    targets = [port.path for port in (*box.outputs, *(p for child in box.children for p in child.inputs))]
    if sources and targets:
        delays = st.sampled_from([None, None, None, 0, 100_000_000])
        link = st.builds(Link, st.sampled_from(sources), st.sampled_from(targets), delays)
        box.links = draw_from(st.lists(link, max_size=12, unique_by=lambda each: (each.source, each.target)))
    return box


@given(boxes())
@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
def test_every_drawing_is_right(root: Box) -> None:
    anything = Outline(Model("any"), root, 9, 9)
    drawing = draw(anything)
    check(drawing)
    assert draw(anything) == drawing


@given(st.lists(st.tuples(st.sets(st.integers(0, 5), min_size=1), st.sets(st.integers(0, 5), min_size=1)), max_size=5))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_lines_between_layers_keep_apart(sides: list[tuple[set[int], set[int]]]) -> None:
    used: tuple[set[int], set[int]] = (set(), set())
    runs = []
    for left, right in sides:  # every height has one pin on each side
        left, right = left - used[0], right - used[1]
        if left and right:
            used[0].update(left)
            used[1].update(right)
            pins = [[Pin(Cell("box", y=12.0 * height)) for height in sorted(side)] for side in (left, right)]
            runs.append(Run(Net(pins[0][0], pins[1]), *pins))
    trunks, count = tracks(runs)
    for trunk in trunks:
        assert 0 <= trunk.track < count
    for one, other in combinations(trunks, 2):
        if one.track == other.track:
            assert one.high < other.low or other.high < one.low
        if one.runs == other.runs:
            continue
        first, last = sorted((one, other), key=lambda trunk: trunk.track)
        if first.track < last.track:  # lines from the left to the last trunk, from the first one to the right
            assert not set(first.right) & set(last.left)
    for run in runs:  # whatever the number of its trunks, they join what the run joins
        mine = [trunk for trunk in trunks if run in trunk.runs]
        if mine:
            assert set(mine[0].left) == {pin.cell.y for pin in run.left}
            assert set(mine[-1].right) == {pin.cell.y for pin in run.right}
            assert all(before.right == after.left for before, after in pairwise(mine))
        else:
            assert len({pin.cell.y for pin in (*run.left, *run.right)}) == 1


def test_two_nets_that_change_places_take_a_detour() -> None:
    """a goes from 0 to 1 and b from 1 to 0: whichever trunk is on the left, one of them must have a second track."""
    (a, b), (c, d) = [[Pin(Cell("box", y=24.0 * height)) for height in (0, 1)] for _ in range(2)]
    trunks, count = tracks([Run(Net(a, [d]), [a], [d]), Run(Net(b, [c]), [b], [c])])
    assert (len(trunks), count) == (3, 3)


@pytest.mark.parametrize("name", sorted(packaged_models()))
@pytest.mark.parametrize(("depth", "expand"), [(None, False), (0, False), (None, True)])
def test_packaged_models_are_drawn_right(name: str, depth: int | None, expand: bool) -> None:
    check(draw(outline(load_model(name), depth, expand)))


@pytest.mark.parametrize("observers", [0, 1, 8])
@pytest.mark.parametrize("expand", [False, True])
def test_scenario_is_drawn_right_for_any_number_of_observers(observers: int, expand: bool) -> None:
    check(draw(outline(load_model("collision_avoidance", set=[f"observers={observers}"]), 1, expand)))


# -- what is drawn ------------------------------------------------------------------------------------------------

SMALL = """\
model: small
composites:
  Cell:
    inputs: [start]
    outputs: [end]
    actors:
      wait: {type: Merge}
    connections:
      - start -> wait.input
      - wait.output -> end
    aspects:
      fault: {type: MeasurementFailure, probability: 0.1, at: wait.output}
actors:
  clock: {type: Clock, period: 1 s}
  cell: {type: Cell, count: 3}
  all: {type: BroadcastChannel}
  last: {type: MostRecent}
connections:
  - clock.output -> cell[*].start, last.trigger
  - {from: "cell[*].end", to: all.input, delay: 10 ms}
  - all.output -> last.input
aspects:
  loss: {type: PacketLoss, probability: 0.1, at: last.input}
"""


def small(tmp_path: Path, *changes: tuple[str, str]) -> Model:
    """The small model with some text changed."""
    text = SMALL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "small.yaml"
    path.write_text(text, encoding="utf-8")
    return load_model(path)


def names(drawn: Outline) -> list[str]:
    return [f"{box.name}: {box.kind}" for box in drawn.root.walk()]


CELL_0_2, WAIT = "cell[0..2]: Cell", "wait: Merge"
ONE, EACH = [CELL_0_2, WAIT], ["cell[0]: Cell", WAIT, "cell[1]: Cell", WAIT, "cell[2]: Cell", WAIT]
INNER = [("start -> wait", "start -> wait[*]"), ("- wait.", "- wait[*]."), ("wait.output}", '"wait[*].output"}')]


def too(connection: str) -> tuple[str, str]:
    """One connection more."""
    return "  - all.output", f"  - {connection}\n  - all.output"


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ([], ONE),
        ([too("all.output -> cell[*].start")], ONE),
        ([too("{from: 'cell[*].end', to: 'cell[*].start', delay: 1 s}")], ONE),
        ([("probability: 0.1, at: wait", 'probability: "${index / 4}", at: wait')], ONE),  # values may differ
        ([too("all.output -> cell[1].start")], EACH),
        ([too("{from: 'cell[0].end', to: 'cell[1].start', delay: 1 s}")], EACH),
        ([("at: last.input", 'at: "cell[2].start"')], EACH),
        ([("at: last.input", 'at: "cell[2].wait.input"')], EACH),
        ([("wait: {", "wait: {count: 2, "), *INNER], [CELL_0_2, "wait[0..1]: Merge"]),
        (
            [("wait: {", 'wait: {count: "${index + 1}", '), *INNER],
            ["cell[0]: Cell", "wait[0]: Merge", "cell[1]: Cell", "wait[0..1]: Merge", "cell[2]: Cell",
             "wait[0..2]: Merge"],
        ),
    ],
)  # fmt: skip
def test_instances_are_one_box_if_they_are_alike(
    tmp_path: Path, changes: list[tuple[str, str]], expected: list[str]
) -> None:
    model = small(tmp_path, *changes)
    drawn = outline(model)
    assert names(drawn) == ["clock: Clock", *expected, "all: BroadcastChannel", "last: MostRecent"]
    assert drawn.note == ""
    check(draw(drawn))
    assert not any(".." in name for name in names(outline(model, expand=True)))


def test_number_of_connections_is_written_if_boxes_do_not_say_it(tmp_path: Path) -> None:
    cells = ["cell[0].end", "cell[1].end", "cell[2].end"]
    wirings = {
        "{from: 'cell[*].end', to: 'cell[*].start', delay: 1 s}": "1 s",
        f"{{from: {cells}, to: 'cell[*].start', delay: 1 s}}": "1 s, each to all",
        f"{{from: {cells * 2}, to: 'cell[*].start', delay: 1 s}}": "1 s, ×18",
    }
    for wiring, written in wirings.items():
        drawn = outline(small(tmp_path, too(wiring)))
        assert names(drawn) == ["clock: Clock", *ONE, "all: BroadcastChannel", "last: MostRecent"]
        assert sorted(pill.text for pill in draw(drawn).pills if not pill.aspect) == sorted(["10 ms", written])


def test_aspects_and_delays_are_written_where_they_are(tmp_path: Path) -> None:
    opened, closed = draw(outline(small(tmp_path))), draw(outline(small(tmp_path), depth=0))
    assert sorted(pill.text for pill in opened.pills) == ["10 ms", "fault", "loss"]
    assert sorted(pill.text for pill in closed.pills) == ["10 ms", "fault", "loss"]
    boxes = {placed.box.name: placed for placed in closed.boxes}
    cell, last = boxes["cell[0..2]"], boxes["last"]
    pills = {pill.text: pill for pill in closed.pills}
    assert cell.x < pills["fault"].x < cell.x + cell.width  # inside of the closed box
    (entry,) = (port for port in last.ports if port.port.name == "input")
    assert pills["loss"].y == entry.y
    assert 0 < entry.x - (pills["loss"].x + pills["loss"].width) < 15


MANY = [
    ("  last:", "".join(f"  more{n}: {{type: Cell}}\n" for n in range(40)) + "  last:"),
    too("clock.output -> " + ", ".join(f"more{n}.start" for n in range(40))),
]


def test_large_models_are_folded_and_say_so(tmp_path: Path) -> None:
    model = small(tmp_path, *MANY)
    drawn = outline(model)
    assert drawn.depth == 0
    assert drawn.note == "41 composites are drawn closed; --depth 1 opens everything"
    assert outline(model, depth=1).note == ""
    check(draw(drawn))


def test_mermaid_text(tmp_path: Path) -> None:
    assert (
        mermaid(outline(small(tmp_path)))
        == """\
---
title: "small"
---
flowchart LR
    clock["clock<br/>Clock"]
    subgraph cell_0["cell[0..2]: Cell"]
        cell_0_start(["start"])
        cell_0_end(["end"])
        cell_0_wait["wait<br/>Merge"]
        cell_0_start --> cell_0_wait
        cell_0_wait -->|"«fault»"| cell_0_end
    end
    all["all<br/>BroadcastChannel"]
    last["last<br/>MostRecent"]
    clock --> cell_0_start
    clock -->|"trigger"| last
    cell_0_end -.->|"10 ms"| all
    all -->|"input «loss»"| last
    classDef aspect stroke:#D55E00,stroke-width:3px
    class cell_0_wait,last aspect
"""
    )
    closed = mermaid(outline(small(tmp_path, ("  Cell:\n", "  Cell:\n    director: {start: 2 s}\n")), depth=0))
    assert 'cell_0[["cell[0..2]<br/>Cell, clock from 2 s (own director)<br/>«fault»"]]' in closed


# -- the command --------------------------------------------------------------------------------------------------


def epicycle(*arguments: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "epicycle.runner.cli", "graph", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, **environment},
        timeout=300,
        check=False,
    )


def test_same_model_same_bytes(tmp_path: Path) -> None:
    model = small(tmp_path)
    done = epicycle("small.yaml", "-o", "there.svg", cwd=tmp_path, PYTHONHASHSEED="7")
    assert (done.returncode, done.stdout, done.stderr) == (0, "wrote there.svg\n", "")
    starts = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF", "mmd": b"---", "md": b"```mermaid\n---"}
    for ending, start in starts.items():
        for name in ("here", "there") if ending != "svg" else ("here",):
            write_graph(outline(model), tmp_path / f"{name}.{ending}")
        written = (tmp_path / f"here.{ending}").read_bytes()
        assert written == (tmp_path / f"there.{ending}").read_bytes()
        assert written.startswith(start)
        assert b"matplotlib" not in written.lower()


@pytest.mark.parametrize("name", sorted(packaged_models()))
def test_packaged_models_are_written_in_every_format(name: str, tmp_path: Path) -> None:
    drawn = outline(load_model(name))
    for ending in (".svg", ".png", ".pdf", ".mmd", ".md"):
        write_graph(drawn, tmp_path / f"graph{ending}")
        assert (tmp_path / f"graph{ending}").stat().st_size > 100


def test_without_a_file_mermaid_is_printed_and_what_is_left_out_is_said(tmp_path: Path) -> None:
    model = small(tmp_path, *MANY)
    done = epicycle("small.yaml", "--without", "loss", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stdout == mermaid(outline(load_model(tmp_path / "small.yaml", without_aspects=["loss"])))
    assert done.stderr.endswith("note: 41 composites are drawn closed; --depth 1 opens everything\n")
    assert len(model.aspects) == 44


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("-o", "graph.txt"),
            "error: graph.txt is no picture: its name must end in .svg, .png, .pdf, .mmd, .md\n",
        ),
        (("-o", "none/graph.svg"), "error: none/graph.svg cannot be written: there is no folder none\n"),
        (("-o", "folder.svg"), "error: folder.svg cannot be written: it is a folder\n"),
        (("-o", "full.svg"), "error: full.svg cannot be written: No space left on device\n"),
        (
            ("--set", "cel=1"),
            "command line:1:7: error: 'cel' sets no parameter\n    1 | --set cel=1\n      |       ^^^^^\n",
        ),
    ],
)
def test_bad_command_lines(arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    small(tmp_path)
    (tmp_path / "folder.svg").mkdir()
    (tmp_path / "full.svg").symlink_to("/dev/full")
    done = epicycle("small.yaml", *arguments, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (BAD_INPUT, "", message)


@pytest.mark.parametrize("depth", ["-1", "two", "1.5"])
def test_depth_is_a_whole_number(depth: str, tmp_path: Path) -> None:
    done = epicycle("small.yaml", "--depth", depth, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (BAD_INPUT, "")
    assert done.stderr.splitlines()[-1] == (
        f"epicycle graph: error: argument --depth: {depth!r} is not a whole number from 0 on"
    )
