"""Relations: fan-out, channels in the order of their links, several that are one, widths."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.ptolemy.importing import MomlError
from tests.ptolemy.importing.moml_parts import (
    composite,
    entity,
    imported,
    model,
    port,
    prop,
    recorded,
    wires,
    written,
)

EVENTS = "".join(entity(name, "SingleEvent", value=number) for number, name in enumerate(("a", "b", "c"), 1))
MERGE = entity("Merge", "ptolemy.domains.de.lib.Merge") + entity("Recorder", "Recorder")


def relation(name: str, width: int | None = None) -> str:
    said = "" if width is None else prop("width", width)
    return f'<relation name="{name}" class="ptolemy.actor.TypedIORelation">{said}</relation>'


def link(port: str, relation: str, **where: int) -> str:
    said = "".join(f' {key}="{value}"' for key, value in where.items())
    return f'<link port="{port}" relation="{relation}"{said}/>'


def connections(text: str) -> list[str]:
    lines = text.rsplit("connections:\n", maxsplit=1)[-1].splitlines()
    return [line.strip().removeprefix("- ") for line in lines if line.startswith("  - ")]


def test_one_output_to_several_inputs(tmp_path: Path) -> None:
    views = entity("x", "Recorder") + entity("y", "Recorder")
    text = written(tmp_path, model(entity("a", "SingleEvent"), views, wires("a.output x.input y.input")))
    assert connections(text) == ["a.output -> x.input, y.input"]


def test_channels_come_in_the_order_of_the_links(tmp_path: Path) -> None:
    """Though the relations were made, and their senders linked, in another order."""
    links = link("a.output", "r0") + link("b.output", "r1") + link("c.output", "r2")
    links += link("Merge.input", "r2") + link("Merge.input", "r0") + link("Merge.input", "r1")
    text = model(
        EVENTS, MERGE, *(relation(f"r{each}") for each in range(3)), links, wires("Merge.output Recorder.input")
    )
    text = (
        text.replace('name="r0" class="ptolemy.actor.TypedIORelation"/>\n', 'name="s" class="x"/>')
        .replace('Merge.output" relation="r0"', 'Merge.output" relation="s"')
        .replace('Recorder.input" relation="r0"', 'Recorder.input" relation="s"')
    )
    assert recorded(tmp_path, text) == [(0.0, 1, 3), (0.0, 2, 1), (0.0, 3, 2)]


def test_insert_at_gives_a_link_its_place(tmp_path: Path) -> None:
    links = (
        "".join(link(f"{name}.output", name) for name in "abc") + link("Merge.input", "a") + link("Merge.input", "b")
    )
    links += link("Merge.input", "c", insertAt=0)
    text = model(EVENTS, MERGE, *map(relation, "abc"), links, wires("Merge.output Recorder.input"))
    assert [token for _, _, token in recorded(tmp_path, text)] == [3, 1, 2]


def test_an_empty_place_takes_no_channel(tmp_path: Path) -> None:
    links = (
        link("a.output", "a") + link("b.output", "b") + link("Merge.input", "a", insertAt=3) + link("Merge.input", "b")
    )
    text = written(tmp_path, model(EVENTS, MERGE, *map(relation, "ab"), links, wires("Merge.output Recorder.input")))
    assert connections(text) == ["a.output -> Merge.input", "b.output -> Merge.input", "Merge.output -> Recorder.input"]


def test_several_outputs_at_one_relation_are_one_channel(tmp_path: Path) -> None:
    actors = entity("a", "DiscreteClock") + entity("b", "DiscreteClock", offsets="{0.5}") + entity("Delay", "TimeDelay")
    text = model(
        actors,
        entity("Recorder", "Recorder"),
        wires("a.output b.output Delay.input", "Delay.output Recorder.input"),
        stop=2,
    )
    assert connections(written(tmp_path, text))[0] == "{from: [a.output, b.output], to: Delay.input, shared: true}"
    assert [time for time, _, _ in recorded(tmp_path, text)] == [1.0, 1.5, 2.0]


def test_linked_relations_are_one(tmp_path: Path) -> None:
    links = link("a.output", "r") + '<link relation1="r" relation2="s"/><link relation1="t" relation2="s"/>'
    links += link("x.input", "t") + link("y.input", "r")
    views = entity("x", "Recorder") + entity("y", "Recorder")
    text = written(tmp_path, model(entity("a", "SingleEvent"), views, *map(relation, "rst"), links))
    assert connections(text) == ["a.output -> x.input, y.input"]


def test_a_channel_of_a_multiport_may_fan_out(tmp_path: Path) -> None:
    actors = entity("a", "DiscreteClock", values="{10, 20}", offsets="{0.0, 0.5}")
    actors += entity("k", "DiscreteClock", values="{0, 1}", offsets="{0.0, 0.5}") + entity("Switch", "Switch")
    actors += "".join(entity(name, "Recorder") for name in ("x", "y", "Recorder"))
    nets = wires(
        "a.output Switch.input",
        "k.output Switch.control",
        "Switch.output x.input y.input",
        "Switch.output Recorder.input",
    )
    text = model(actors, nets, stop=1)
    assert "{from: Switch.output, to: [x.input, y.input], shared: true}" in connections(written(tmp_path, text))
    assert recorded(tmp_path, text) == [(0.5, 1, 20)]
    assert recorded(tmp_path, text, "y") == [(0.0, 1, 10), (1.0, 1, 10)]


@pytest.mark.parametrize("width", [None, 2])
@pytest.mark.parametrize("director", [False, True])
def test_a_multiport_of_a_composite_is_a_port_for_each_channel(
    tmp_path: Path, width: int | None, director: bool
) -> None:
    """The width of the relation inside follows from that outside, or is said."""
    inside = (
        relation("w", width)
        + link("in", "w")
        + link("Merge.input", "w")
        + relation("o")
        + link("Merge.output", "o")
        + link("out", "o")
    )
    inner = composite(
        "C",
        port("in", "input", "multiport"),
        port("out", "output"),
        entity("Merge", "ptolemy.domains.de.lib.Merge"),
        inside,
        director=director,
    )
    text = model(
        EVENTS, inner, entity("Recorder", "Recorder"), wires("b.output C.in", "a.output C.in", "C.out Recorder.input")
    )
    assert "    inputs: [in, in_1]\n" in written(tmp_path, text)
    assert [token for _, _, token in recorded(tmp_path, text)] == [2, 1]


def test_wires_that_lead_nowhere_are_left_out(tmp_path: Path) -> None:
    text = model(
        entity("a", "SingleEvent"),
        entity("x", "Recorder"),
        relation("r"),
        link("a.output", "r"),
        link("x.input", "none"),
    )
    assert "connections" not in written(tmp_path, text)


@pytest.mark.parametrize("change", ["deleteEntity", "deleteRelation", "unlink", "rename"])
def test_what_is_taken_out_again_is_not_supported(tmp_path: Path, change: str) -> None:
    text = model(EVENTS, f'<{change} name="c"/>')
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, text)
    assert str(caught.value) == f"m.xml cannot be imported:\n   - line 16: <{change}> is not supported"
