"""What aspects that are models cannot be, and where they cannot stand."""

from __future__ import annotations

import re

import pytest

from epicycle.runner import ModelError
from tests.aspects.core.composite_parts import PAIR, TWINS, load


def problem(text: str) -> str:
    with pytest.raises(ModelError) as caught:
        load(text)
    lines = re.sub(r"[^\s(]*m\.yaml", "m.yaml", str(caught.value)).splitlines()
    return "\n".join(line for line in lines if "error:" in line or line.startswith("   help:"))


WIRE = "inputs: [request]\n    outputs: [response]\n    connections: [request -> response]"


@pytest.mark.parametrize(
    ("aspects", "message"),
    [
        (
            "net: {type: Desks, at: a.input}",
            """m.yaml:33:23: error: aspect net: there is no aspect type 'Desks', did you mean 'Desk'?
   help: valid types: those that 'epicycle list aspects' lists
   help: for your own types, add '--types FILE.py'; in Python, pass the classes as types=[...]""",
        ),
        (
            "net: {type: Crossing, at: a.input}",
            """m.yaml:33:37: error: aspect net: Crossing has 2 inputs, none of them called 'request'
   help: its inputs: east, west
   help: call one of them 'request', or name the input that takes the tokens: {at: ..., request: ...}""",
        ),
        (
            "net: {type: Crossing, at: {at: a.input, request: eats}}",
            """m.yaml:33:60: error: aspect net: Crossing has no input 'eats', did you mean 'east'?
   help: its inputs: east, west""",
        ),
        (
            "net: {type: PacketLoss, probability: 0, at: {at: a.input, request: east}}",
            "m.yaml:33:78: error: aspect net: PacketLoss is not a composite, so its pointcuts have no 'request'",
        ),
        (
            "net: {type: Desk, at: {at: a.input, type: Scale}}",
            """m.yaml:33:33: error: a pointcut selects by pattern, type or tag
   help: write {at: ...}, {type: ..., port: ...} or {tag: ...}""",
        ),
        (
            "net: {type: Desk, at: [a.input, {at: b, time: 1 s}]}",
            """m.yaml:33:34: error: aspect net: it attaches to ports here, but to actors elsewhere
   help: give every place a time, or none: at actors it is the execution time of their firings""",
        ),
        (
            "net: {type: Desk, at: {at: a.input, time: -1}}",
            """m.yaml:33:38: error: aspect net: Desk attaches to actors, but a.input is a port
   help: write 'a', without the port
m.yaml:33:53: error: aspect net: time: -1 is out of bounds, expected a time in s >= 0, a distribution, \
or a mapping of input ports to these""",
        ),
        (
            "net: {type: Desk, at: {at: a, time: {inptu: 1, input: 1 m}}}",
            "m.yaml:33:65: error: aspect net: time: input: '1 m' is a length, expected a time in s",
        ),
        (
            "net: {type: Desk, at: {at: a, time: {inptu: 1}}}",
            """m.yaml:33:48: error: aspect net: time: no actor that this applies to has an input 'inptu', did you mean \
'input'?
   help: their inputs: input""",
        ),
        (
            "net: {type: PacketLoss, probability: 0, at: {at: a.input, time: 1}}",
            "m.yaml:33:75: error: aspect net: PacketLoss is not a composite, so its pointcuts have no 'time'",
        ),
        (
            "one: {type: Desk, at: {at: a, time: 1}}, two: {type: Desk, at: {at: '*', time: 1}}",
            """m.yaml:33:52: error: aspect two: a already runs on the processor 'one'
   help: an actor has one processor: exclude it here, with '!a', or there""",
        ),
        (
            "net: {type: Desk, at: {at: net.server, time: 1}}",
            "m.yaml:33:38: error: aspect net: it cannot attach to its own inside, at net.server",
        ),
        (
            "a: {type: Desk, at: b.input}",
            """m.yaml:33:11: error: 'a' is the name of both an actor and an aspect that is a model
   help: rename one""",
        ),
        (
            "net: {type: Desk, at: net.server.input}",
            "m.yaml:33:33: error: aspect net: it cannot attach to its own inside, at net.server.input",
        ),
        (
            "net: {type: Desk, at: a}",
            """m.yaml:33:33: error: aspect net: 'a' matches no port
   help: that is an actor, not a port: write a.input, a.output""",
        ),
        (
            "net: {type: Desk}",
            """m.yaml:33:11: error: aspect net has no 'at'
   help: add 'at:' with ports or patterns""",
        ),
        (
            "net: {type: Desk, tiem: 2, at: a.input, until: 2 s, from: 3 s}",
            """m.yaml:33:11: error: aspect net: it is never active: 'until' (2 s) must be after 'from' (3 s)
m.yaml:33:29: error: net: Desk has no parameter 'tiem', did you mean 'time'?
   help: valid parameters: time""",
        ),
        (
            "net: {type: Line, at: [a.input, j.input]}",
            """m.yaml:33:11: error: a loop without delay: a -> net.negate -> a
   help: a.output -> net.request -> net.negate.input (m.yaml:33, m.yaml:12)
   help: net.negate.output -> net.response -> a.input (m.yaml:12, m.yaml:33)
   help: the aspect net sends the tokens of all its ports through one model: attach it to fewer of them, or give \
that model a delay""",
        ),
        (
            "one: {type: Desk, at: two.server.input}, two: {type: Desk, at: one.server.input}",
            """m.yaml:33:11: error: aspect one: it attaches inside two, and two inside it
   help: a token would never leave: attach one of them elsewhere, or exclude it: '!two.**'""",
        ),
    ],
)
def test_wrong_aspects(aspects: str, message: str) -> None:
    assert problem(PAIR.replace("{ASPECTS}", "{" + aspects + "}")) == message


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            WIRE,
            "connections: []",
            """m.yaml:31:11: error: aspect net: Wire has no output
   help: add 'outputs: [response]' to Wire
m.yaml:31:33: error: aspect net: Wire has no input
   help: add 'inputs: [request]' to Wire""",
        ),
        (
            WIRE,
            'inputs: [request]\n    outputs: [a, b]\n    connections: ["request -> a, b"]',
            """m.yaml:33:11: error: aspect net: Wire has 2 outputs, none of them called 'response'
   help: its outputs: a, b
   help: call one of them 'response'""",
        ),
        (
            WIRE,
            WIRE.replace("[request]", "{request: float}", 1),
            """m.yaml:5:14: error: aspect net: request of Wire has the type float, but aspects pass requests
   help: leave out its type: the actors inside receive requests, which contain the tokens""",
        ),
        (
            WIRE,
            WIRE.replace("connections", "actors: {scale: {type: Scale}}\n    connections").replace(
                "request -> response", "request -> scale.input, scale.output -> response"
            ),
            """m.yaml:8:19: error: net.request sends Request, but net.scale.input takes float
   help: net.request is a port of Wire, declared at m.yaml:5:14
   help: net.scale is a Scale, declared at m.yaml:7:14
m.yaml:8:43: error: net.scale.output sends float, but net.response takes Request
   help: net.scale is a Scale, declared at m.yaml:7:14
   help: net.response is a port of Wire, declared at m.yaml:6:15""",
        ),
        (
            WIRE,
            WIRE + "\n    aspects: {again: {type: Wire, at: request}}",
            "m.yaml:8:29: error: net.again: composite Wire contains itself: Wire -> Wire",
        ),
        (
            "t.output -> b.input,",
            "t.output -> b.input, t.output -> net.request,",
            """m.yaml:32:57: error: aspect net: net.request takes the tokens of this aspect, so nothing else can be \
connected to it
   help: add another input for other tokens""",
        ),
    ],
)
def test_wrong_classes(old: str, new: str, message: str) -> None:
    assert problem(PAIR.replace(old, new, 1).replace("{ASPECTS}", "{net: {type: Wire, at: a.input}}")) == message


@pytest.mark.parametrize(
    ("inside", "outside", "message"),
    [
        (
            "{}",
            "{net: {type: Desk, at: 'twin[0].scale.input'}}",
            """error: aspect net: twin[0].scale.input is inside twin[0], which has its own director
   help: declare it inside twin[0], or attach it to the ports of twin[0]""",
        ),
        (
            "{net: {type: Desk, at: go}}",
            "{}",
            """error: aspect twin[0].net: twin[0].go is outside twin[0], which has its own director
   help: declare it outside twin[0]""",
        ),
    ],
)
def test_no_aspect_stands_under_two_directors(inside: str, outside: str, message: str) -> None:
    text = TWINS.replace('{net: {type: Desk, time: "${0.1 * (index + 1)}", at: PLACE}}', inside + "\n    director: {}")
    found = problem(text.replace("run:", f"aspects: {outside}\nrun:"))
    assert found[found.index("error:") :] == message
