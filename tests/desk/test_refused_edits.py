"""Changes of a model's text that are refused, and what cannot get into a text."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from epicycle.runner.desk import editing
from epicycle.runner.desk.parts import EditError, data_of
from tests.desk.editing_parts import FLOW, TEXT, Act, set_value

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
