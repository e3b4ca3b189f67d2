"""Changes of a model as changes of its text: what a model becomes, and that all else in the text stays."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.runner.desk import Knowledge, controls, difference, editing, read
from epicycle.runner.desk.changes import apply, edits_between
from epicycle.runner.desk.parts import data_of
from epicycle.runner.model.catalogue.packaged import packaged_models
from tests.desk.editing_parts import FLOW, TEXT, Act, set_value

COMPOSITE = """model: inside
composites:
  Pair:
    inputs: [tick]
    actors:
      gain: {type: Scale, factor: 2}  # doubles
      other: {type: Scale, factor: 3}
    connections:
      - tick -> gain.input, other.input
actors:
  clock: {type: Clock, period: 1 s}
  pair: {type: Pair}
connections: [clock.output -> pair.tick]
run: {stop: 3 s}
"""


def knowledge(text: str, folder: Path) -> Knowledge:
    path = folder / "model.yaml"
    return Knowledge(read(path, {path.resolve(): text}))


def changes(before: str, after: str, folder: Path) -> list[str]:
    """What changed in the model, as far as it goes: an input may be left without a sender."""
    one, other = (knowledge(text, folder).reading.loading.model for text in (before, after))
    assert one is not None
    assert other is not None
    return [str(each) for each in difference(one, other).changes]


def lines(before: str, after: str) -> tuple[list[str], list[str]]:
    """The lines that went, and those that came; the others are the same, in the same order."""
    old, new = before.splitlines(keepends=True), after.splitlines(keepends=True)
    gone, come = [line for line in old if line not in new], [line for line in new if line not in old]
    assert [line for line in old if line not in gone] == [line for line in new if line not in come]
    return gone, come


CASES: dict[str, tuple[str, Act, list[str], list[str], list[str]]] = {
    "connect": (
        TEXT,
        lambda text: editing.change(text, "connect", "", "clock.output", "left.trigger"),
        [],
        ["- clock.output -> left.trigger\n"],
        [],
    ),
    "disconnect": (
        TEXT,
        lambda text: editing.change(text, "disconnect", "", "clock.output", "left.trigger"),
        ["- clock.output -> left.trigger   # at once\n"],
        [],
        ["- clock.output -> left.trigger"],
    ),
    "disconnect a mapping": (
        TEXT,
        lambda text: editing.change(text, "disconnect", "", "clock.output", "right.trigger"),
        ["- {from: clock.output, to: right.trigger, delay: 100 ms}\n"],
        [],
        ["- clock.output -> right.trigger: delay 0.1 s"],
    ),
    "add an actor": (
        TEXT,
        lambda text: editing.change(text, "add_part", "", "actors", "more", "Merge", {}),
        [],
        ["  more: {type: Merge}\n"],
        [
            "+ more: type Merge, discard false",
        ],
    ),
    "remove an actor": (
        TEXT,
        lambda text: editing.change(set_value(text, ("run", "record"), "left.state"), "remove", "", "actors", "right"),
        [
            "  right:\n",
            "    type: CircularMotion\n",
            "    start: [0, -1]   # below\n",
            "- {from: clock.output, to: right.trigger, delay: 100 ms}\n",
            "run: {stop: 10 s, seed: 1, record: [left.state, right.state]}\n",
        ],
        ["run: {stop: 10 s, seed: 1, record: left.state}\n"],
        [],
    ),
    "set a parameter": (
        TEXT,
        lambda text: editing.change(text, "set_parameter", "", "actors", "right", "start", "[1, 2]"),
        ["    start: [0, -1]   # below\n"],
        ["    start: [1, 2]   # below\n"],
        ["~ right.start: [0, -1] -> [1, 2]"],
    ),
    "set a parameter that has its default": (
        TEXT,
        lambda text: editing.change(text, "set_parameter", "", "actors", "right", "speed", "3 m/s"),
        [],
        ["    speed: 3 m/s\n"],
        ["~ right.speed: 1.26 -> 3"],
    ),
    "set a parameter of the model": (
        TEXT,
        lambda text: editing.change(text, "set_parameter", "", "parameters", "loss", "", "0.5"),
        ["  loss: {value: 0.2, min: 0, max: 1, doc: probability that a tick is lost}  # set by hand\n"],
        ["  loss: {value: 0.5, min: 0, max: 1, doc: probability that a tick is lost}  # set by hand\n"],
        ["~ loss: 0.2 -> 0.5", "~ lossy.probability: 0.2 -> 0.5"],
    ),
    "attach an aspect": (
        TEXT,
        lambda text: editing.change(
            text, "add_part", "", "aspects", "late", "Latency", {"delay": "1 s", "at": "clock.output"}
        ),
        [],
        ["  late: {type: Latency, delay: 1 s, at: clock.output}\n"],
        [],
    ),
    "switch an aspect off": (
        TEXT,
        lambda text: editing.change(text, "switch", "", "lossy", False),
        ['  lossy: {type: PacketLoss, probability: "${loss}", at: "*.trigger"}  # now and then\n'],
        ['  lossy: {type: PacketLoss, probability: "${loss}", at: "*.trigger", enabled: false}  # now and then\n'],
        [],
    ),
    "remove the last aspect": (
        TEXT,
        lambda text: editing.change(text, "remove", "", "aspects", "lossy"),
        ["aspects:\n", '  lossy: {type: PacketLoss, probability: "${loss}", at: "*.trigger"}  # now and then\n'],
        [],
        [],
    ),
    "in brackets: connect": (
        FLOW,
        lambda text: editing.change(text, "connect", "", "sum.output", "gain.input"),
        [' connections: [clock.output -> gain.input, "gain.output -> sum.input"], run: {stop: 3 s}}\n'],
        [FLOW.splitlines(keepends=True)[-1].replace("], run", ", sum.output -> gain.input], run")],
        [],
    ),
    "in brackets: disconnect": (
        FLOW,
        lambda text: editing.change(text, "disconnect", "", "clock.output", "gain.input"),
        [' connections: [clock.output -> gain.input, "gain.output -> sum.input"], run: {stop: 3 s}}\n'],
        [' connections: ["gain.output -> sum.input"], run: {stop: 3 s}}\n'],
        [],
    ),
    "in brackets: add": (
        FLOW,
        lambda text: editing.change(text, "add_part", "", "actors", "more", "Merge", {}),
        ["  },\n"],
        ["  , more: {type: Merge}},\n"],
        [],
    ),
    "in brackets: a value for a key without one": (
        FLOW,
        lambda text: editing.change(text, "set_parameter", "", "parameters", "b", "", "2"),
        [FLOW.splitlines(keepends=True)[0]],
        ["{model: flow, parameters: {a: 1, b: 2}, actors: {\n"],
        [],
    ),
    "inside of a composite: connect": (
        COMPOSITE,
        lambda text: editing.change(text, "connect", "Pair", "gain.output", "other.input"),
        [],
        ["      - gain.output -> other.input\n"],
        ["+ pair.gain.output -> pair.other.input"],
    ),
    "inside of a composite: one of several": (
        COMPOSITE,
        lambda text: editing.change(text, "disconnect", "Pair", "tick", "gain.input"),
        ["      - tick -> gain.input, other.input\n"],
        ["      - tick -> other.input\n"],
        ["- pair.tick -> pair.gain.input"],
    ),
    "inside of a composite: the first aspect": (
        COMPOSITE,
        lambda text: editing.change(
            text, "add_part", "Pair", "aspects", "lossy", "PacketLoss", {"probability": "0.5", "at": "gain.input"}
        ),
        [],
        ["    aspects:\n", "      lossy: {type: PacketLoss, probability: 0.5, at: gain.input}\n"],
        ["+ pair.lossy: type PacketLoss, at [pair.gain.input], probability 0.5, spare_first false, from 0"],
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_an_edit_changes_what_is_meant_and_nothing_else(name: str, tmp_path: Path) -> None:
    before, act, gone, come, meant = CASES[name]
    after = act(before)
    if name != "connect":  # which writes a line that is there already
        assert lines(before, after) == (gone, come)
    if meant:
        found = changes(before, after, tmp_path)
        assert [each for each in found if not each.startswith("+ more.")] == meant  # the ports of an actor
    # The same in a file of another system, and with a byte order mark.
    ends = before.replace("\n", "\r\n")
    assert act(ends) == after.replace("\n", "\r\n")
    assert act("\ufeff" + before) == "\ufeff" + after


@pytest.mark.parametrize("name", CASES)
def test_edits_make_one_text_of_the_other(name: str) -> None:
    before, act, *_ = CASES[name]
    after = act(before)
    found = edits_between(Path("m.yaml"), before, after)
    assert apply(before, found) == after
    assert all(each.text != before[each.start : each.end] for each in found)


def test_what_a_swapped_aspect_does_not_know_goes(tmp_path: Path) -> None:
    after = editing.change(TEXT, "swap", "", "lossy", "Latency", knowledge(TEXT, tmp_path))
    assert '  lossy: {type: Latency, at: "*.trigger"}  # now and then\n' in after
    same = editing.change(TEXT, "swap", "", "lossy", "Corrupt", knowledge(TEXT, tmp_path))
    assert '  lossy: {type: Corrupt, probability: "${loss}", at: "*.trigger"}  # now and then\n' in same


def test_a_model_grows_from_nothing(tmp_path: Path) -> None:
    text = "# mine\n"
    text = set_value(text, ("model",), "grown")
    text = set_value(text, ("run",), "{stop: 3 s}")
    text = editing.change(
        text, "add_part", "", "aspects", "lossy", "PacketLoss", {"probability": "0.5", "at": "*.input"}
    )
    text = editing.change(text, "add_part", "", "actors", "clock", "Clock", {"period": "1 s"})
    text = editing.change(text, "add_part", "", "actors", "gain", "Scale", {"factor": "2"})
    text = editing.change(text, "connect", "", "clock.output", "gain.input")
    assert text == (
        "# mine\nmodel: grown\n"
        "actors:\n  clock: {type: Clock, period: 1 s}\n  gain: {type: Scale, factor: 2}\n"
        "connections:\n  - clock.output -> gain.input\n"
        'aspects:\n  lossy: {type: PacketLoss, probability: 0.5, at: "*.input"}\n'
        "run: {stop: 3 s}\n"
    )
    assert knowledge(text, tmp_path).reading.problems == ()


def test_a_disturbance_is_dropped_in(tmp_path: Path) -> None:
    disturbance = "disturbance: rain\nparameters: {wet: 0.3}\nset: {loss: 0.7}\naspects:\n"
    disturbance += '  rain: {type: PacketLoss, probability: "${wet}", at: left.trigger}\n'
    assert changes(TEXT, editing.change(TEXT, "drop_in", "", disturbance), tmp_path) == [
        "~ loss: 0.2 -> 0.7",
        "+ wet: 0.3",
        "~ lossy.probability: 0.2 -> 0.7",
        "+ rain: type PacketLoss, at [left.trigger], probability 0.3, spare_first false, from 0",
    ]


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name == "changing_roles")) for name in packaged_models()]
)
def test_switching_off_and_on_leaves_a_packaged_model_as_it_was(name: str) -> None:
    text = packaged_models()[name].read_text(encoding="utf-8")
    data = data_of(text)
    for aspect in data.get("aspects", {}):
        off = editing.change(text, "switch", "", aspect, False)
        gone, come = lines(text, off)
        assert len(gone) <= 1 <= len(come)
        assert editing.change(off, "switch", "", aspect, True) == text
    for actor, said in data.get("actors", {}).items():
        if "type" in said:
            assert set_value(text, ("actors", actor, "type"), said["type"]) == text
        new = editing.change(text, "add_part", "", "actors", f"{actor}_twin", "Merge", {})
        assert editing.change(new, "remove", "", "actors", f"{actor}_twin") == text


def test_bounds_are_numbers_in_the_unit_of_the_parameter(tmp_path: Path) -> None:
    text = "model: m\nparameters: {pace: {value: 1 min, min: 500 ms, max: 0.1 h}}\n"
    text += 'actors: {clock: {type: Clock, period: "${pace}"}}\nrun: {stop: 1 h}\n'
    path = tmp_path / "m.yaml"
    (field,) = controls.parameters(Knowledge(read(path, {path.resolve(): text})))
    assert (field["low"], field["high"], field["number"], field["unit"]) == (0.5, 360.0, 60.0, "s")
