"""Ports by themselves: what they hold, and which types go together."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from epicycle.actors import (
    Actor,
    InputPort,
    OutputPort,
    PortError,
    PortParameter,
    accepts,
    declared_ports,
    shaped,
    type_name,
)


class Hub(Actor):
    """Has one port of each kind."""

    one = InputPort(float)
    many = InputPort(int, multi=True, required=False, triggers=False, doc="any number")
    out = OutputPort(float, depends_on=("one",))
    outs = OutputPort(np.ndarray, shape=(2, None), multi=True)


def test_what_ports_declare() -> None:
    hub = Hub("site.hub")
    assert {port.width for port in (*hub.inputs.values(), *hub.outputs.values())} == {0}
    one, many, out, outs = hub.one, hub.many, hub.out, hub.outs
    assert (one.multi, one.required, one.triggers, one.doc) == (False, True, True, "")
    assert (many.multi, many.required, many.triggers, many.doc) == (True, False, False, "any number")
    assert (out.depends_on, out.multi, outs.depends_on, outs.multi) == (("one",), False, None, True)
    assert repr(outs) == "<output port site.hub.outs: array[2, n]>"
    assert repr(Hub.one) == "<input port one: float>"
    assert Hub("b").one is not one


class Loop(Hub):
    """Has an output by which it may be part of a loop, whatever inputs a subclass adds."""

    level = PortParameter(float, 0.0)
    apart = OutputPort(float, independent_of=("many",))


class WiderLoop(Loop):
    """Adds an input."""

    more = InputPort(float)


def test_an_output_depends_on_all_inputs_but_some() -> None:
    assert Loop("loop").apart.depends_on == ("one", "level")
    assert WiderLoop("loop").apart.depends_on == ("one", "level", "more")
    assert declared_ports(Loop)["apart"].depends_on == ("one", "level")  # type: ignore[union-attr]

    class Wrong(Hub):
        apart = OutputPort(float, independent_of=("ome",))

    with pytest.raises(TypeError) as raised:
        Wrong("wrong")
    assert str(raised.value) == "Wrong.apart is independent of 'ome', which is no input"


def test_a_port_may_differ_from_its_declaration() -> None:
    hub, other = Hub("hub"), Hub("other")
    assert hub.one.terms is other.one.terms is Hub.one.terms
    hub.one.triggers = True  # as declared
    assert hub.one.terms is Hub.one.terms
    hub.one.triggers, hub.out.depends_on = False, ()
    twin = hub.one.twin(other)
    assert (hub.one.triggers, twin.triggers, other.one.triggers, Hub.one.triggers) == (False, False, True, True)
    assert (hub.out.depends_on, other.out.depends_on) == ((), ("one",))
    assert (hub.one.name, hub.one.type, hub.one.required, twin.path, twin.actor) == (
        "one", float, True, "hub.one", other,
    )  # fmt: skip


def test_tokens_are_those_of_one_port() -> None:
    one, other = Hub("a").one, Hub("b").one
    assert one.arrived is other.arrived  # neither has any
    one.receive(1.0, 0)
    assert (one.tokens, one.value, other.present, Hub.one.present) == ((1.0,), 1.0, False, False)
    other.shown = []  # hidden while something else is done
    other.receive(2.0, 0)
    assert (other.present, other.arrived, one.tokens) == (False, [2.0], (1.0,))


def test_what_an_input_holds() -> None:
    port = Hub("hub").many
    assert (port.present, port.tokens) == (False, ())
    port.width = 3
    for token, channel in ((5, 1), (6, 0), (7, 1)):
        port.receive(token, channel)
    assert (port.present, port.tokens, port.value) == (True, (5, 6, 7), 7)
    assert port.by_channel() == [[6], [5, 7], []]
    assert port.arrivals() == [(0, 6), (1, 5), (1, 7)]
    port.clear()
    assert (port.present, port.tokens, port.arrivals()) == (False, (), [])


def test_nothing_is_sent_outside_of_a_run() -> None:
    port, sent = Hub("hub").out, []
    for _ in range(2):
        with pytest.raises(PortError) as caught:
            port.send(1.0)
        assert str(caught.value) == "hub.out cannot send now: send tokens only in fire() or run() of a running model"
        port.connect(lambda token, channel=None: sent.append((token, channel)))
        port.send(2.0)
        port.send(3.0, 1)
        port.disconnect()
        port.disconnect()
    assert sent == [(2.0, None), (3.0, 1)] * 2


@pytest.mark.parametrize(
    ("wanted", "given", "fits"),
    [
        (float, int, True),
        (int, float, False),
        (bool, int, False),
        (int, bool, True),
        (object, str, True),
        (str, object, False),
        (str, Any, True),
        (float | str, int, True),
        (float | str, int | str, True),
        (float, int | str, False),
        (int | str, float, False),
        (list, list[int], True),
        (list[int], list, False),
        (list[int], list[int], True),
        (list[int], list[str], False),
        (list[float], list[int], False),
        (tuple[int, str], tuple[int, str], True),
        (np.ndarray, shaped(np.ndarray, (2,)), True),
        (shaped(np.ndarray, (2,)), np.ndarray, True),
        (shaped(np.ndarray, (2,)), shaped(np.ndarray, (3,)), False),
        (shaped(np.ndarray, (None,)), shaped(np.ndarray, (3,)), True),
        (shaped(np.ndarray, (3,)), shaped(np.ndarray, (None,)), False),
        (shaped(np.ndarray, (2,)), shaped(np.ndarray, (2, 2)), False),
        (shaped(np.ndarray, (2, 2)), shaped(np.ndarray, (2,)), False),
        (Hub, Actor, False),
        (Actor, Hub, True),
    ],
)
def test_which_types_go_together(wanted: Any, given: Any, fits: bool) -> None:
    assert accepts(wanted, given) is fits


@pytest.mark.parametrize(
    ("declared", "name"),
    [
        (object, "any"),
        (Any, "any"),
        (float, "float"),
        (np.ndarray, "array"),
        (shaped(np.ndarray, (None, 3)), "array[n, 3]"),
        (int | str, "int | str"),
        (dict[str, list[int]], "dict[str, list[int]]"),
        (Hub, "Hub"),
    ],
)
def test_names_of_types(declared: Any, name: str) -> None:
    assert type_name(declared) == name
