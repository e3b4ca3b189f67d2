"""Changes of a model as changes of its text: what a model becomes, and that all else in the text stays."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from epicycle.runner.desk import Knowledge, controls, difference, editing, read
from epicycle.runner.desk.changes import apply, edits_between
from epicycle.runner.desk.parts import EditError, data_of, rendered, typed
from epicycle.runner.model.catalogue.packaged import packaged_models

TEXT = """# A line of robots.
model: two_bodies   # its name

parameters:
  loss: {value: 0.2, min: 0, max: 1, doc: probability that a tick is lost}  # set by hand
actors:
  # The first of all.
  clock: {type: Clock, period: 500 ms}
  left: {type: CircularMotion, start: [0, 1]}    # on the left
  right:
    type: CircularMotion
    start: [0, -1]   # below

connections:
- clock.output -> left.trigger   # at once
# late
- {from: clock.output, to: right.trigger, delay: 100 ms}

aspects:
  lossy: {type: PacketLoss, probability: "${loss}", at: "*.trigger"}  # now and then
  # the end of aspects
run: {stop: 10 s, seed: 1, record: [left.state, right.state]}
metrics:
  heard: {of: left.state, take: count}
# the end
"""
FLOW = (
    "{model: flow, parameters: {a: 1, b}, actors: {\n  clock: {type: Clock, period: 1 s}, # ticks\n"
    "  gain: {type: Scale, factor: 2},\n  sum: {type: Merge} # all\n  },\n"
    ' connections: [clock.output -> gain.input, "gain.output -> sum.input"], run: {stop: 3 s}}\n'
)
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
Act = Callable[[str], str]


def knowledge(text: str, folder: Path) -> Knowledge:
    path = folder / "model.yaml"
    return Knowledge(read(path, {path.resolve(): text}))


def changes(before: str, after: str, folder: Path) -> list[str]:
    """What changed in the model, as far as it goes: an input may be left without a sender."""
    one, other = (knowledge(text, folder).reading.loading.model for text in (before, after))
    assert one is not None
    assert other is not None
    return [str(each) for each in difference(one, other).changes]


def set_value(text: str, keys: tuple[str, ...], said: str) -> str:
    """A text with a value, as somebody types it, in the place of another, or behind the others if there is none."""
    data = holder = data_of(text)
    for key in keys[:-1]:
        holder = holder[key]
    holder[keys[-1]] = typed(said)
    return rendered(text, data)


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


# -- what is refused, and what cannot get in --------------------------------------------------------------------------

HOSTILE = (
    "x: 1",
    "x}, evil: {type: Process",
    "x\nevil: {type: Process}",
    "x\u2028evil: 1",
    "- a",
    "&a x",
    "*a",
    "!!python/object:os.system x",
    "# gone",
    "x # gone",
    "x #gone",
    '"',
    "'",
    "'}, evil: 1",
    "[",
    "]",
    "{{",
    "${",
    "${__import__('os')}",
    "| x",
    "> x",
    "% x",
    "@x",
    "`x`",
    "---",
    "...",
    "<<",
    "\x00",
    "\x85",
    "\ufeff",
    "\U0001f600",
    "true",
    "null",
    "1e5",
    "0x10",
    "",
    " ",
    "a, b",
    "a: ",
    "? a",
    "\\",
    "\\n",
)


@pytest.mark.parametrize("said", HOSTILE)
@pytest.mark.parametrize("text", [TEXT, FLOW], ids=["lines", "brackets"])
def test_a_value_stays_one_value(said: str, text: str) -> None:
    before = data_of(text)
    for keys in (("run", "stop"), ("run", "extra"), ("actors", "clock", "period"), ("actors", "clock", "extra")):
        data = data_of(set_value(text, keys, said))
        holder, old = data, before
        for key in keys[:-1]:
            holder, old = holder[key], old[key]
        new = holder.pop(keys[-1])
        assert isinstance(new, (str, int, float, bool, type(None)))
        assert new == said.strip() or not isinstance(new, str)
        assert {key: each for key, each in old.items() if key != keys[-1]} == holder
        assert data.keys() == before.keys()


@pytest.mark.parametrize("said", HOSTILE)
def test_a_name_is_a_name(said: str) -> None:
    acts: dict[str, Act] = {
        "is not a name: use letters, digits and _, and no digit first": lambda text: editing.change(
            text, "add_part", "", "actors", said, "Clock", {}
        ),
        "is not the name of a type": lambda text: editing.change(text, "add_part", "", "actors", "new", said, {}),
        "is not a port: write actor.port, or a port of the composite": lambda text: editing.change(
            text, "connect", "", f"clock.{said}", "left.trigger"
        ),
    }
    for message, act in acts.items():
        if said in ("true", "null") and act is not acts["is not a name: use letters, digits and _, and no digit first"]:
            continue  # which might be those of a type and of a port
        if said in ("true", "null"):
            assert data_of(act(TEXT))["actors"][said] == {"type": "Clock"}
            continue
        with pytest.raises(EditError, match=re.escape(message)):
            act(TEXT)


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (
            lambda text: editing.change(text, "disconnect", "", "a.b", "c.d"),
            "there is no connection a.b -> c.d in this text",
        ),
        (lambda text: editing.change(text, "remove", "", "aspects", "none"), "there is no aspects.none in this text"),
        (
            lambda text: editing.change(text, "set_parameter", "", "actors", "none", "x", "1"),
            "there is no actors.none in this text",
        ),
        (
            lambda text: editing.change(text, "add_part", "", "actors", "clock", "Clock", {}),
            "there is already 'clock' among the actors",
        ),
        (
            lambda text: editing.change(text, "connect", "None", "a.b", "c.d"),
            "there is no composites.None in this text",
        ),
        (
            lambda text: editing.change(text, "drop_in", "", "model: x"),
            "this is not a disturbance that consists of parameters, values and aspects only",
        ),
        (
            lambda text: editing.change(text + "x: [", "connect", "", "a.b", "c.d"),
            "this can be changed once the text can be read: broken YAML: did not find expected node content",
        ),
    ],
)
def test_what_cannot_be_changed_is_said(act: Act, message: str) -> None:
    with pytest.raises(EditError) as caught:
        act(TEXT)
    assert str(caught.value) == message


def test_an_alias_is_left_to_its_author() -> None:
    text = "model: x\nactors:\n  a: {type: Clock, period: &p 1 s}\n  b: {type: Clock, period: *p}\n"
    with pytest.raises(EditError) as caught:
        editing.change(text, "set_parameter", "", "actors", "b", "period", "2 s")
    assert str(caught.value) == "actors.b.period is an alias: change it by hand"
    with pytest.raises(EditError) as caught:
        editing.change(text, "set_parameter", "", "actors", "a", "period", "2 s")
    assert str(caught.value) == ("this text is written in a way that no program can change here: change it by hand")


def test_bounds_are_numbers_in_the_unit_of_the_parameter(tmp_path: Path) -> None:
    text = "model: m\nparameters: {pace: {value: 1 min, min: 500 ms, max: 0.1 h}}\n"
    text += 'actors: {clock: {type: Clock, period: "${pace}"}}\nrun: {stop: 1 h}\n'
    path = tmp_path / "m.yaml"
    (field,) = controls.parameters(Knowledge(read(path, {path.resolve(): text})))
    assert (field["low"], field["high"], field["number"], field["unit"]) == (0.5, 360.0, 60.0, "s")


@pytest.mark.parametrize(
    "act",
    [
        lambda text: editing.change(text, "remove", "", "actors", "a"),
        lambda text: editing.change(text, "remove", "", "aspects", "a"),
        lambda text: editing.change(text, "switch", "", "a", False),
        lambda text: editing.change(text, "switch", "", "a", True),
        lambda text: editing.change(text, "add_part", "", "actors", "b", "Clock", {}),
        lambda text: editing.change(text, "add_part", "", "aspects", "b", "PacketLoss", {"at": "a.b"}),
        lambda text: editing.change(text, "connect", "", "a.b", "c.d"),
        lambda text: editing.change(text, "disconnect", "", "a.b", "c.d"),
        lambda text: editing.change(text, "set_parameter", "", "actors", "a", "period", "1 s"),
        lambda text: editing.change("model: m\n", "drop_in", "", text),
    ],
)
@pytest.mark.parametrize("text", ["model: m\nactors: {a: {type: Clock\n", "a: 1\na: 2\n", "\x00", "a: *b\n", "[" * 500])
def test_a_text_that_cannot_be_read_is_not_changed(act: Callable[[str], str], text: str) -> None:
    with pytest.raises(EditError):
        act(text)
