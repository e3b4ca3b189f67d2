"""What is drawn of a model, and the command that draws it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import networkx as nx
import pytest

from epicycle.runner import load_model
from epicycle.runner.interface.cli import main
from epicycle.runner.interface.commands.options import BAD_INPUT
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.show.graph import layers, mermaid, outline, write_graph
from epicycle.runner.show.graph.layout import draw
from epicycle.runner.show.graph.outlines import Outline
from epicycle.runner.show.graph.picture import aspects_seen, legend_of, tied, ties
from tests.show.graph.drawings import check

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
        "{from: 'cell[*].end', to: 'cell[*].start', delay: 1 s}": "1 s, each to itself",
        "\n  - ".join(f"{{from: 'cell[{n}].end', to: 'cell[{(n + 1) % 3}].start', delay: 1 s}}" for n in range(3)): (
            "1 s, each to another"
        ),
        f"{{from: {cells}, to: 'cell[*].start', delay: 1 s}}": "1 s, each to all",
        f"{{from: {cells * 2}, to: 'cell[*].start', delay: 1 s}}": "1 s, ×18",
    }
    for wiring, written in wirings.items():
        drawn = outline(small(tmp_path, too(wiring)))
        assert names(drawn) == ["clock: Clock", *ONE, "all: BroadcastChannel", "last: MostRecent"]
        assert sorted(badge.text for badge in draw(drawn).badges if not badge.aspect) == sorted(["10 ms", written])


BUS = """\
model: bus
actors:
  clock: {type: Clock, period: 0.1 s, count: 3}
  node: {type: Accumulator, count: 3}
  other: {type: Accumulator, count: 3}
connections:
  - clock[*].output -> node[*].input
  - {from: ["clock[0].output", "clock[1].output", "clock[2].output"], to: "other[*].input"}
aspects:
  can: {type: Bus, factor: 0.001, at: "node[*].input"}
  low: {type: Bus, factor: 0.001, medium: second, at: "other[0].input"}
  high: {type: Bus, factor: 0.001, medium: second, at: ["other[1].input", "other[2].input"]}
  cpu: {type: Processor, time: 0.001, at: ["node[0]", "node[1]"]}
  loss: {type: PacketLoss, probability: 0.1, at: "node[*].input"}
"""


def test_places_that_share_a_medium_are_joined(tmp_path: Path) -> None:
    (tmp_path / "bus.yaml").write_text(BUS, encoding="utf-8")
    drawing = draw(outline(load_model(tmp_path / "bus.yaml"), expand=True))
    groups = [[(badge.aspect, badge.place) for badge in group] for group in tied(drawing)]
    assert groups == [
        [("can", f"node[{n}].input") for n in range(3)],
        [("low", "other[0].input"), ("high", "other[1].input"), ("high", "other[2].input")],
        [("cpu", "node[0]"), ("cpu", "node[1]")],
    ]
    for group in tied(drawing):  # each badge is reached by a line from another one
        lines = list(ties(group))
        middles = [(badge.x + badge.width / 2, badge.y) for badge in group]
        assert len(lines) == len(group) - 1
        graph = nx.Graph((line[0], line[-1]) for line in lines)
        assert nx.is_connected(graph)
        assert {*graph} == {*middles}
    folded = draw(outline(load_model(tmp_path / "bus.yaml", without_aspects=["low", "high", "cpu"])))
    assert tied(folded) == []
    assert sorted(badge.text for badge in folded.badges) == ["can", "each to all", "in pairs", "loss"]
    texts = [row.explanation for row in legend_of(folded, aspects_seen(folded))]
    assert texts[:2] == ["aspect Bus, at 3 ports, which share one medium", "aspect PacketLoss, at 3 ports"]


def test_aspects_and_delays_are_written_where_they_are(tmp_path: Path) -> None:
    opened, closed = draw(outline(small(tmp_path))), draw(outline(small(tmp_path), depth=0))
    assert sorted(badge.text for badge in opened.badges) == ["10 ms", "fault", "loss"]
    assert sorted(badge.text for badge in closed.badges) == ["10 ms", "fault", "loss"]
    boxes = {placed.box.name: placed for placed in closed.boxes}
    cell, last = boxes["cell[0..2]"], boxes["last"]
    badges = {badge.text: badge for badge in closed.badges}
    assert cell.x < badges["fault"].x < cell.x + cell.width  # inside of the closed box
    (entry,) = (port for port in last.ports if port.port.name == "input")
    assert badges["loss"].y == entry.y
    assert 0 < entry.x - (badges["loss"].x + badges["loss"].width) < 15


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


def test_wires_that_could_not_be_followed_are_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nets would take too many places in the layers between, the longest of them are cut first."""
    chain = "".join(f"  a{n}: {{type: Merge}}\n" for n in range(6))
    text = (
        f"model: long\nactors:\n  clock: {{type: Clock, period: 1 s}}\n{chain}  last: {{type: Merge}}\nconnections:\n"
    )
    text += "  - clock.output -> a0.input\n" + "".join(f"  - a{n}.output -> a{n + 1}.input\n" for n in range(5))
    text += "  - a5.output -> last.input\n  - a4.output -> last.input\n"
    text += "  - {from: a1.output, to: [last.input, a4.input], delay: 10 ms}\n"
    (tmp_path / "long.yaml").write_text(text, encoding="utf-8")
    drawn = outline(load_model(tmp_path / "long.yaml"))
    whole = draw(drawn)
    assert (whole.cut, [badge.text for badge in whole.badges]) == (0, ["10 ms"])
    check(whole)
    monkeypatch.setattr(layers, "MOST_PASSES", 2)
    thin = draw(drawn)
    assert thin.cut == 1
    assert sorted(each.text for each in thin.badges) == [
        "10 ms \u2192 2 inputs",
        "a1.output \u2192",
        "a1.output \u2192",
    ]
    (wire,) = (wire for wire in thin.wires if wire.source == "a1.output" and len(wire.targets) == 2)
    ports = {port.port.path: port for placed in thin.boxes for port in placed.ports}
    assert wire.lines == tuple(
        ((ports[path].x + start, ports[path].y), (ports[path].x + end, ports[path].y))
        for path, start, end in (("a1.output", 0.0, 4.0), ("last.input", -9.0, 0.0), ("a4.input", -9.0, 0.0))
    )
    legend = legend_of(thin, aspects_seen(thin))
    assert [(row.words, row.explanation) for row in legend][:1] == [
        ("a.output \u2192", "the other end of a connection with a long way")
    ]
    write_graph(drawn, tmp_path / "long.svg")


def test_what_is_of_one_type_is_one_box_if_there_is_no_room(tmp_path: Path) -> None:
    count = 700
    lines = ["model: flat", "actors:"]
    for n in range(count):
        lines += [f"  clock{n}: {{type: Clock, period: 1 s}}", f"  gain{n}: {{type: Scale, factor: {n}}}"]
        lines += [f"  heard{'abc'[n % 3]}: {{type: Recorder}}"] if n < 3 else []
    lines += ["connections:", *(f"  - clock{n}.output -> gain{n}.input" for n in range(count))]
    lines += [f"  - gain{n}.output -> heard{'abc'[n % 3]}.input" for n in range(count)]
    lines += ["aspects: {loss: {type: PacketLoss, probability: 0.1, at: gain7.input}}", "run: {stop: 1 s}"]
    (tmp_path / "flat.yaml").write_text("\n".join(lines), encoding="utf-8")
    model = load_model(tmp_path / "flat.yaml")

    def boxes(limit: int) -> list[tuple[str, int, int]]:
        return [(each.name, each.count, len(each.members)) for each in outline(model, limit=limit).root.children]

    assert len(boxes(2 * count + 3)) == 2 * count + 3
    clocks, gains = ("clock0 and 699 more", count, count), ("gain0 and 699 more", count, count)
    assert boxes(1_000) == [clocks, gains, ("hearda", 1, 0), ("heardb", 1, 0), ("heardc", 1, 0)]
    assert boxes(4) == [clocks, gains, ("hearda and 2 more", 3, 3)]
    root = outline(model, limit=4).root
    assert [(each.source, each.target, each.words) for each in root.links] == [
        ("clock0.output", "gain0.input", "in pairs"),
        ("gain0.output", "hearda.input", "×700"),
    ]
    assert root.children[1].inputs[0].aspects == ("loss",)  # of one of them
    check(draw(outline(model, limit=4)))


def test_what_nobody_could_read_is_not_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    small(tmp_path)
    monkeypatch.setattr("epicycle.runner.show.graph.MOST_BOXES", 5)
    words = ["graph", str(tmp_path / "small.yaml"), "--depth", "1", "-o", str(tmp_path / "small")]
    words[-1] += ".svg"
    assert main([*words, "--expand"]) == BAD_INPUT
    assert capsys.readouterr().err == (
        "error: 9 boxes are too many for a picture (at most 5)\n"
        "   help: --depth 0 draws the outermost level only, without --expand what is alike is one box, and Mermaid "
        "text (.mmd) has no limit\n"
    )
    assert main(words) == 0
    words[-1] = str(tmp_path / "small.mmd")
    assert main([*words, "--expand"]) == 0


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
        [sys.executable, "-m", "epicycle.runner.interface.cli", "graph", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, **environment},
        timeout=300,
        check=False,
    )


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(packaged_models()))
@pytest.mark.parametrize(
    "endings", [(".svg", ".mmd", ".md"), pytest.param((".png", ".pdf"), marks=pytest.mark.slow)], ids=("text", "other")
)
def test_packaged_models_are_written_in_every_format(name: str, endings: tuple[str, ...], tmp_path: Path) -> None:
    drawn = outline(load_model(name))
    for ending in endings:
        write_graph(drawn, tmp_path / f"graph{ending}")
        assert (tmp_path / f"graph{ending}").stat().st_size > 100


def test_mermaid_shows_what_places_share() -> None:
    lines = mermaid(outline(load_model("collision_avoidance", disturb="shared_radio"), depth=0)).splitlines()
    hexagon = next(number for number, line in enumerate(lines) if "{{" in line)
    assert lines[hexagon : hexagon + 2] == [
        '    shared_radio{{"«radio»<br/>RadioMedium"}}',
        "    shared_radio -.- main & observer_0",
    ]
    assert "{{" not in mermaid(outline(load_model("collision_avoidance", disturb="wifi_burst"), depth=0))


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
            "error: graph.txt is not a picture: its name must end in one of .svg, .png, .pdf, .mmd, .md\n",
        ),
        (("-o", "none/graph.svg"), "error: none/graph.svg cannot be written: there is no folder none\n"),
        (("-o", "folder.svg"), "error: folder.svg cannot be written: it is a folder\n"),
        (("-o", "full.svg"), "error: full.svg cannot be written: No space left on device\n"),
        (
            ("--set", "cel=1"),
            "command line:1:7: error: 'cel' matches no parameter\n    1 | --set cel=1\n      |       ^^^^^\n",
        ),
    ],
)
def test_bad_command_lines(
    arguments: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    small(tmp_path)
    (tmp_path / "folder.svg").mkdir()
    (tmp_path / "full.svg").symlink_to("/dev/full")
    assert main(["graph", "small.yaml", *arguments]) == BAD_INPUT
    assert capsys.readouterr() == ("", message)


@pytest.mark.parametrize("depth", ["-1", "two", "1.5"])
def test_depth_is_a_whole_number(depth: str, tmp_path: Path) -> None:
    done = epicycle("small.yaml", "--depth", depth, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (BAD_INPUT, "")
    assert done.stderr.splitlines()[-1] == (
        f"epicycle graph: error: argument --depth: {depth!r} is not a whole number of at least 0"
    )
