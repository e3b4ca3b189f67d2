"""Aspects that are models: tokens go through a composite on their way, each to where it was going."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.actors import Actor, InputPort, OutputPort
from epicycle.aspects import PacketLoss, Request
from epicycle.runner import ActorError, ModelError, Simulation, load_composite, load_model
from epicycle.runner.engine import Results
from epicycle.runner.model import Model
from epicycle.runner.show import aspects_at
from tests.engine import engine_parts
from tests.engine.engine_parts import Join, Scale, Ticker


class Negate(Actor):
    """Turns the sign of what is requested."""

    input = InputPort(Request)
    output = OutputPort(Request)

    def fire(self) -> None:
        for request in self.input.tokens:
            self.output.send(dataclasses.replace(request, token=-request.token))


class Unwrap(Actor):
    """Sends tokens where requests are asked for."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        for request in self.input.tokens:
            self.output.send(request.token)


CLASSES = """
composites:
  Wire:
    inputs: [request]
    outputs: [response]
    connections: [request -> response]
  Line:
    inputs: [request]
    outputs: [response]
    actors: {negate: {type: Negate}}
    connections: [request -> negate.input, negate.output -> response]
  Desk:
    parameters: {time: 300 ms}
    inputs: [request]
    outputs: [response, load]
    actors: {server: {type: Server, service_time: "${time}"}}
    connections: [request -> server.input, server.output -> response, server.size -> load]
  Crossing:
    inputs: [east, west]
    outputs: [response]
    actors:
      slow: {type: TimeDelay, delay: 500 ms}
      join: {type: Merge}
    connections: [west -> slow.input, east -> join.input, slow.output -> join.input, join.output -> response]
"""
PAIR = (
    CLASSES
    + """
actors:
  t: {type: Ticker, limit: 3}
  a: {type: Scale, factor: 2}
  b: {type: Scale, factor: 3}
  j: {type: Join}
connections: [t.output -> a.input, t.output -> b.input, t.output -> j.input, a.output -> j.input, b.output -> j.input]
aspects: {ASPECTS}
run: {stop: 4 s}
"""
)


def load(text: str, **changes: Any) -> Model:
    return engine_parts.load(text, types=[Negate, Unwrap], **changes)


def pair(woven: str, **changes: Any) -> Model:
    return load(PAIR.replace("{ASPECTS}", "{" + woven + "}"), **changes)


def run(model: Model) -> Results:
    return Simulation(model, keep_log=True).run()


def acts(results: Results, *events: str) -> list[tuple[float, str, str, Any]]:
    """What aspects did: when, what, where and with which token."""
    return [
        (record.tag.seconds, record.event, f"{record.actor}.{record.port}", record.value)
        for record in results.log.records
        if record.event in events
    ]


def sends(results: Results, *ports: str) -> list[tuple[Any, ...]]:
    found = ((r.tag, f"{r.actor}.{r.port}", r.value) for r in results.log.records if r.event == "send")
    return [send for send in found if not ports or send[1] in ports]


def test_tokens_wait_their_turn_and_go_where_they_were_going() -> None:
    """A server of 0.3 s that both inputs share: the tokens of each second leave it after 0.3 and 0.6 s."""
    results = run(pair('net: {type: Desk, at: ["a.input", "b.input"]}'))
    assert acts(results, "requested", "delivered") == [
        event
        for second in range(3)
        for event in [
            (second, "requested", "a.input", second),
            (second, "requested", "b.input", second),
            (second + 0.3, "delivered", "a.input", [second, 0.3]),
            (second + 0.6, "delivered", "b.input", [second, 0.6]),
        ]
    ]
    times = {port: [tag.seconds for tag, *_ in sends(results, port)] for port in ("a.output", "b.output")}
    assert times == {"a.output": [0.3, 1.3, 2.3], "b.output": [0.6, 1.6, 2.6]}
    assert results.aspects["net"] == {"requested": 6, "delivered": 6}


@pytest.mark.parametrize("place", ["[a.input, b.input]", "t.output", "'t.output -> *.input'", "[a.output, b.output]"])
def test_a_wire_changes_nothing(place: str) -> None:
    """What passes an aspect without any actor in it is sent and received at the same tags and in the same order."""
    plain, woven = run(pair("")), run(pair(f"net: {{type: Wire, at: {place}}}"))
    assert sends(woven) == sends(plain)
    assert woven.aspects["net"]["requested"] == woven.aspects["net"]["delivered"] > 0


@pytest.mark.parametrize("place", ["a.input", "a.output", "'a.output -> j.input'", "'t.output -> a.input'"])
def test_receivers_wait_for_what_comes_through_an_aspect(place: str) -> None:
    """Actors inside an aspect fire between the sender and the receiver: the join sees all of a tag in one firing."""
    results = run(pair(f"net: {{type: Line, at: {place}}}"))
    assert [(tag.seconds, tag.microstep, value) for tag, _, value in sends(results, "j.output")] == [
        (n, 1, [[n], [-2.0 * n], [3.0 * n]]) for n in range(3)
    ]


@pytest.mark.parametrize("seed", range(12))
def test_an_aspect_is_as_good_as_actors_in_the_connections(seed: int) -> None:
    """In random networks: all fires at the same tags with the same values, if each place has an aspect of its own."""
    random = np.random.default_rng(seed)
    names = [f"n{i}" for i in range(8)]
    hops: list[tuple[str, int]] = []
    for i in range(8):
        known = ["t", *names[:i]]
        hops += [(known[k], i) for k in random.permutation(len(known))[: random.integers(1, 4)]]
    chosen = [hops[k] for k in random.permutation(len(hops))[:4]]
    actors = "".join(f"  {name}: {{type: AddSubtract}}\n" for name in names)

    def text(through: list[tuple[str, int]], aspects: str, more: str) -> str:
        ways = []
        for k, (source, i) in enumerate(hops):
            if (source, i) in through:
                ways += [f"{source}.output -> i{k}.input", f"i{k}.output -> n{i}.plus"]
            else:
                ways.append(f"{source}.output -> n{i}.plus")
        return (
            f"{CLASSES}actors:\n  t: {{type: Ticker}}\n{actors}{more}connections: [{', '.join(ways)}]\n"
            f"aspects: {{{aspects}}}\nrun: {{stop: 3 s}}"
        )

    woven = ", ".join(f"w{k}: {{type: Line, at: {a}.output -> n{i}.plus}}" for k, (a, i) in enumerate(chosen))
    inserted = "".join(f"  i{k}: {{type: Scale, factor: -1}}\n" for k, hop in enumerate(hops) if hop in chosen)
    results = [run(load(text([], woven, ""))), run(load(text(chosen, "", inserted)))]
    found, expected = ([send for send in sends(each) if send[1][0] in "tn"] for each in results)
    assert sorted(found) == sorted(expected)
    assert len(found) == 4 * 9


def test_request_ports() -> None:
    results = run(pair("net: {type: Crossing, at: [{at: a.input, request: east}, {at: b.input, request: west}]}"))
    assert acts(results, "delivered")[:3] == [
        (0.0, "delivered", "a.input", [0, 0.0]),
        (0.5, "delivered", "b.input", [0, 0.5]),
        (1.0, "delivered", "a.input", [1, 0.0]),
    ]


@pytest.mark.parametrize(
    ("aspects", "counts"),
    [
        ("loss: {LOSS a.input}, net: {DESK}", (0, 0)),
        ("net: {DESK}, loss: {LOSS a.input}", (3, 3)),
        ("loss: {LOSS net.request}, net: {DESK}", (3, 0)),
        ("net: {DESK}, loss: {LOSS net.server.input}", (3, 0)),
    ],
)
def test_order_of_aspects(aspects: str, counts: tuple[int, int]) -> None:
    """What is lost before the aspect is never requested, what is lost inside never delivered."""
    aspects = aspects.replace("{LOSS", "{type: PacketLoss, probability: 1, at:")
    results = run(pair(aspects.replace("{DESK}", "{type: Desk, at: a.input}")))
    assert results.aspects["loss"] == {"dropped": 3}
    assert results.aspects["net"] == {"requested": counts[0], "delivered": counts[1]}
    assert not sends(results, "a.output")


def test_two_at_one_port_and_one_inside_the_other() -> None:
    two = run(pair("one: {type: Desk, at: a.input}, two: {type: Desk, time: 100 ms, at: a.input}"))
    assert [time for time, *_ in acts(two, "delivered")] == [0.3, 0.4, 1.3, 1.4, 2.3, 2.4]
    nested = run(pair("net: {type: Desk, at: a.input}, inner: {type: Desk, time: 100 ms, at: net.server.input}"))
    assert [(time, where) for time, _, where, _ in acts(nested, "delivered")[:2]] == [
        (0.1, "net.server.input"),
        (0.4, "a.input"),
    ]
    assert [tag.seconds for tag, *_ in sends(nested, "a.output")] == [0.4, 1.4, 2.4]


def test_windows_and_conditions() -> None:
    results = run(pair("net: {type: Desk, at: a.input, from: 1 s, until: 2 s}"))
    assert [tag.seconds for tag, *_ in sends(results, "a.output")] == [0.0, 1.3, 2.0]
    results = run(pair("net: {type: Desk, at: a.input, when: t.output >= 1}"))
    assert [tag.seconds for tag, *_ in sends(results, "a.output")] == [0.0, 1.3, 2.3]


def test_from_outside() -> None:
    desk = 'net: {type: Desk, at: ["a.input", "b.input"]}'
    for change in ("net.time=100 ms", "net.server.service_time=0.1", "**.service_time=0.1 s"):
        assert [time for time, *_ in acts(run(pair(desk, set=[change])), "delivered")][:2] == [0.1, 0.2]
    assert run(pair(desk, set=["net.from=1.5 s"])).aspects["net"]["requested"] == 2
    assert run(pair(desk, aspects=["net=Latency,delay=5 ms"])).aspects["net"] == {"delayed": 6}
    plain = run(pair("")).digest
    assert run(pair(desk, without_aspects=["net"])).digest == plain
    assert run(pair(desk.replace("at:", "enabled: false, at:"))).digest == plain


def test_other_ports_are_connected_and_recorded() -> None:
    text = PAIR.replace("b.output -> j.input]", "b.output -> j.input, net.load -> sink.input]")
    text = text.replace("  j: {type: Join}", "  j: {type: Join}\n  sink: {type: Scale}")
    text = text.replace("{ASPECTS}", "{net: {type: Desk, at: a.input}}").replace("4 s}", "4 s, record: [net.load]}")
    results = run(load(text + "metrics: {peak: {of: net.load, take: max}}"))
    assert results.metrics == {"peak": 1}
    assert [value for *_, value in sends(results, "sink.output")] == list(results.signals["net.load"].tokens)


def test_what_is_left_out_is_no_way_into_it() -> None:
    """Or else the load of the desk would seem to go through the desk itself, within a tag."""
    text = PAIR.replace("b.output -> j.input]", "b.output -> j.input, net.load -> sink.input]")
    text = text.replace("  j: {type: Join}", "  j: {type: Join}\n  sink: {type: Scale}")
    results = run(load(text.replace("{ASPECTS}", '{net: {type: Desk, at: ["*.input", "!sink.input", "!j.input"]}}')))
    assert results.aspects["net"]["requested"] == 6


TWINS = (
    CLASSES
    + """
  Twin:
    inputs: [go]
    outputs: [gone]
    actors: {scale: {type: Scale}}
    connections: [go -> scale.input, scale.output -> gone]
    aspects: {net: {type: Desk, time: "${0.1 * (index + 1)}", at: PLACE}}
actors: {t: {type: Ticker, limit: 2}, twin: {type: Twin, count: 3}}
connections: ["t.output -> twin[*].go"]
run: {stop: 2 s}
"""
)


@pytest.mark.parametrize("place", ["scale.input", "scale.output", "'go -> scale.input'"])
def test_each_instance_of_a_class_has_its_own(place: str) -> None:
    model = load(TWINS.replace("PLACE", place))
    assert [woven.model.path for woven in model.aspects if woven.model] == [f"twin[{i}].net" for i in range(3)]
    results = run(model)
    assert [tag.seconds for tag, *_ in sends(results, "twin[2].scale.output")] == [0.3, 1.3]
    assert [time for time, *_ in acts(results, "delivered")] == [0.1, 0.2, 0.3, 1.1, 1.2, 1.3]


def test_at_the_ports_of_composites() -> None:
    text = TWINS.replace('{net: {type: Desk, time: "${0.1 * (index + 1)}", at: PLACE}}', "{}")
    results = run(load(text.replace("run:", "aspects: {net: {type: Desk, at: ['*.go', 'twin[1].gone']}}\nrun:", 1)))
    assert acts(results, "delivered")[:4] == [
        (0.3, "delivered", "twin[0].go", [0, 0.3]),
        (0.6, "delivered", "twin[1].go", [0, 0.6]),
        (0.9, "delivered", "twin[2].go", [0, 0.9]),
        (1.2, "delivered", "twin[1].gone", [0.0, 0.6]),
    ]


def test_single_channels() -> None:
    """What is sent to one channel of three arrives there alone, through an aspect that all of them share."""
    text = """
actors: {t: {type: Ticker}, s: {type: Spread}, d: {type: TimeDelay, count: 3}}
connections: [t.output -> s.input, "s.output -> d[*].input"]
aspects: {net: {type: Desk, time: 0.1, at: "d[*].input"}}
run: {stop: 2 s}
"""
    found = [(tag.seconds, *rest) for tag, *rest in sends(run(load(CLASSES + text))) if rest[0][0] == "d"]
    assert found == [((11 + n) / 10, f"d[{n}].output", f"0/{n}") for n in range(3)]


def test_an_aspect_in_local_time() -> None:
    """Inside of a clock that goes twice as fast, a service of 0.3 s is over after 0.15 s."""
    text = PAIR.replace("  Desk:\n", "  Desk:\n    director: {drift: 2}\n")
    results = run(load(text.replace("{ASPECTS}", "{net: {type: Desk, at: a.input}}")))
    assert [tag.seconds for tag, *_ in sends(results, "a.output")] == [0.15, 1.15, 2.15]


class Twice(Actor):
    """Answers every request twice."""

    input = InputPort(Request)
    output = OutputPort(Request)

    def fire(self) -> None:
        for request in self.input.tokens:
            self.output.send(request)
            self.output.send(request)


def test_an_answer_may_come_twice_but_a_firing_happens_once() -> None:
    text = PAIR.replace("{type: Negate}", "{type: Twice}")
    ports = engine_parts.load(text.replace("{ASPECTS}", "{net: {type: Line, at: a.input}}"), types=[Twice])
    assert [value for *_, value in sends(run(ports), "a.output")] == [0, 0, 2, 2, 4, 4]
    firings = engine_parts.load(text.replace("{ASPECTS}", "{net: {type: Line, at: {at: a, time: 0}}}"), types=[Twice])
    with pytest.raises(ActorError, match="which is no request to net that waits for an answer"):
        run(firings)


def test_what_comes_out_must_have_gone_in() -> None:
    text = PAIR.replace("{type: Negate}", "{type: Unwrap}").replace("{ASPECTS}", "{net: {type: Line, at: a.input}}")
    with pytest.raises(ActorError) as caught:
        run(load(text))
    assert str(caught.value).partition("\n")[0] == (
        "aspect net failed in delivering at (0 s, 1): net.response sends 0, which is no request: what leaves an aspect "
        "that is a model must be what came in, with another token in it if need be"
    )


# -- at actors ------------------------------------------------------------------------------------------------------

CPU = """
  Cpu:
    inputs: [request]
    outputs: [response]
    actors:
      each: {type: Merge}
      cost: {type: Expression, expression: "job['execution_time']"}
      server: {type: Server}
    connections:
      - request -> each.input
      - each.output -> cost.job, server.input
      - cost.output -> server.service_time
      - server.output -> response
  Hub:
    inputs: [request]
    outputs: [response]
    actors: {join: {type: Merge}}
    connections: [request -> join.input, join.output -> response]
"""


def firing_pair(woven: str, **changes: Any) -> Model:
    text = PAIR.replace("actors:\n  t:", CPU.lstrip("\n") + "actors:\n  t:")
    return load(text.replace("{ASPECTS}", "{" + woven + "}"), **changes)


def test_firings_wait_for_a_model() -> None:
    """A processor for which both compute: at each second a for 0.1 s, then b for 0.2 s."""
    woven = "cpu: {type: Cpu, at: [{at: a, time: 100 ms}, {type: Scale, time: 0.2}]}".replace("type: Scale", "at: b")
    results = run(firing_pair(woven))
    assert acts(results, "requested", "executed")[:4] == [
        (0.0, "requested", "a.", 0.1),
        (0.0, "requested", "b.", 0.2),
        (0.1, "executed", "a.", 0.1),
        (pytest.approx(0.3), "executed", "b.", 0.3),
    ]
    assert [(tag.seconds, value) for tag, _, value in sends(results, "b.output")] == [(0.3, 0), (1.3, 3), (2.3, 6)]
    assert results.aspects["cpu"] == {"requested": 6, "executed": 6}
    changed = run(firing_pair(woven, set=["cpu.server.servers=2"]))
    assert [tag.seconds for tag, *_ in sends(changed, "b.output")] == [0.2, 1.2, 2.2]


def test_a_wire_lets_actors_fire_as_ever() -> None:
    places = "[{type: Scale, time: 0}, {at: j, time: 1 s}, {at: t, time: 0}]"
    assert sends(run(firing_pair(f"net: {{type: Wire, at: {places}}}"))) == sends(run(firing_pair("")))


def test_what_fires_inside_takes_a_microstep() -> None:
    """An actor has its turn before the model that it asks, so the answer counts at the next microstep."""
    results = run(firing_pair("hub: {type: Hub, at: {at: a, time: 0}}"))
    assert [(tag.seconds, tag.microstep) for tag, *_ in sends(results, "a.output")] == [(0, 2), (1, 2), (2, 2)]
    assert [(tag.seconds, tag.microstep) for tag, *_ in sends(results, "b.output")] == [(0, 1), (1, 1), (2, 1)]


def test_a_firing_that_is_not_answered_does_not_happen() -> None:
    results = run(
        firing_pair("net: {type: Hub, at: {at: a, time: 0}}, loss: {type: PacketLoss, probability: 1, at: net.request}")
    )
    assert results.aspects["net"] == {"requested": 3, "executed": 0}
    assert not sends(results, "a.output")


def test_the_list_of_aspects_says_where_each_comes_in() -> None:
    crossing = "net: {type: Crossing, at: [{at: a.input, request: east}, {at: t.output -> b.input, request: west}]}"
    model = firing_pair(f"{crossing}, cpu: {{type: Cpu, at: {{at: b, time: 5 ms}}}}")
    assert aspects_at(model) == {
        "a.input": [("net", "Crossing", "request: east")],
        "b": [("cpu", "Cpu", "time: 0.005")],
        "t.output -> b.input": [("net", "Crossing", "request: west")],
    }


# -- what cannot be -------------------------------------------------------------------------------------------------


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
   help: valid types: those that 'epicycle aspects' lists
   help: one of your own is known after '--types FILE.py'; in Python, give its class as types=[...]""",
        ),
        (
            "net: {type: Crossing, at: a.input}",
            """m.yaml:33:37: error: aspect net: Crossing has 2 inputs, none of them called 'request'
   help: its inputs: east, west
   help: call one of them 'request', or say where the tokens come in: {at: ..., request: ...}""",
        ),
        (
            "net: {type: Crossing, at: {at: a.input, request: eats}}",
            """m.yaml:33:60: error: aspect net: Crossing has no input 'eats', did you mean 'east'?
   help: its inputs: east, west""",
        ),
        (
            "net: {type: PacketLoss, probability: 0, at: {at: a.input, request: east}}",
            "m.yaml:33:78: error: aspect net: PacketLoss is no composite, so a pointcut of it has no 'request'",
        ),
        (
            "net: {type: Desk, at: {at: a.input, type: Scale}}",
            """m.yaml:33:33: error: a pointcut chooses by pattern, by type or by tag
   help: write {at: ...}, {type: ..., port: ...} or {tag: ...}""",
        ),
        (
            "net: {type: Desk, at: [a.input, {at: b, time: 1 s}]}",
            """m.yaml:33:34: error: aspect net: it stands at ports here, and elsewhere at actors
   help: give every place a time, or none: actors have one, the execution time of their firings""",
        ),
        (
            "net: {type: Desk, at: {at: a.input, time: -1}}",
            """m.yaml:33:38: error: aspect net: Desk stands at actors, but a.input is a port
   help: write 'a', without the port
m.yaml:33:53: error: aspect net: time: -1 is out of bounds, expected a time in s >= 0, a distribution, \
or these by input port""",
        ),
        (
            "net: {type: Desk, at: {at: a, time: {inptu: 1, input: 1 m}}}",
            "m.yaml:33:65: error: aspect net: time: input: '1 m' is a length, expected a time in s",
        ),
        (
            "net: {type: Desk, at: {at: a, time: {inptu: 1}}}",
            """m.yaml:33:48: error: aspect net: time: no actor that this is for has an input 'inptu', did you mean \
'input'?
   help: their inputs: input""",
        ),
        (
            "net: {type: PacketLoss, probability: 0, at: {at: a.input, time: 1}}",
            "m.yaml:33:75: error: aspect net: PacketLoss is no composite, so a pointcut of it has no 'time'",
        ),
        (
            "one: {type: Desk, at: {at: a, time: 1}}, two: {type: Desk, at: {at: '*', time: 1}}",
            """m.yaml:33:52: error: aspect two: a runs on the processor 'one' already
   help: an actor has one processor: leave it out here, with '!a', or there""",
        ),
        (
            "net: {type: Desk, at: {at: net.server, time: 1}}",
            "m.yaml:33:38: error: aspect net: it cannot stand inside of itself, at net.server",
        ),
        (
            "a: {type: Desk, at: b.input}",
            """m.yaml:33:11: error: 'a' is the name of an actor and of an aspect that is a model
   help: rename one""",
        ),
        (
            "net: {type: Desk, at: net.server.input}",
            "m.yaml:33:33: error: aspect net: it cannot stand inside of itself, at net.server.input",
        ),
        (
            "net: {type: Desk, at: a}",
            """m.yaml:33:33: error: aspect net: 'a' matches no port
   help: that is an actor, not a port: write a.input, a.output""",
        ),
        (
            "net: {type: Desk}",
            """m.yaml:33:11: error: aspect net does not say where it stands
   help: add 'at:' with ports or patterns""",
        ),
        (
            "net: {type: Desk, tiem: 2, at: a.input, until: 2 s, from: 3 s}",
            """m.yaml:33:11: error: aspect net: it is never active: until 2 s is not after from 3 s
m.yaml:33:29: error: net: Desk has no parameter 'tiem', did you mean 'time'?
   help: valid parameters: time""",
        ),
        (
            "net: {type: Line, at: [a.input, j.input]}",
            """m.yaml:33:11: error: a loop without delay: a -> net.negate -> a
   help: a.output -> net.request -> net.negate.input (m.yaml:33, m.yaml:12)
   help: net.negate.output -> net.response -> a.input (m.yaml:12, m.yaml:33)
   help: the aspect net sends the tokens of all its ports through one model: let it stand at fewer of them, or give \
that model a delay""",
        ),
        (
            "one: {type: Desk, at: two.server.input}, two: {type: Desk, at: one.server.input}",
            """m.yaml:33:11: error: aspect one: it stands inside of two, and two inside of it
   help: a token would never come out: let one of them stand elsewhere, or leave it out: '!two.**'""",
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
            """m.yaml:5:14: error: aspect net: request of Wire is for float, but through an aspect go requests
   help: leave out its type: the actors inside get requests, which hold the tokens""",
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
            """m.yaml:32:57: error: aspect net: net.request is for the tokens of this aspect, and nothing else can be \
connected to it
   help: add another input for what else the composite needs""",
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
            """error: aspect net: twin[0].scale.input is inside of twin[0], which has a director of its own
   help: declare it inside of twin[0], or let it stand at the ports of twin[0]""",
        ),
        (
            "{net: {type: Desk, at: go}}",
            "{}",
            """error: aspect twin[0].net: twin[0].go is outside of twin[0], which has a director of its own
   help: declare it outside of twin[0]""",
        ),
    ],
)
def test_no_aspect_stands_under_two_directors(inside: str, outside: str, message: str) -> None:
    text = TWINS.replace('{net: {type: Desk, time: "${0.1 * (index + 1)}", at: PLACE}}', inside + "\n    director: {}")
    found = problem(text.replace("run:", f"aspects: {outside}\nrun:"))
    assert found[found.index("error:") :] == message


# -- in Python ------------------------------------------------------------------------------------------------------


def python_pair() -> Model:
    model = Model("pair", stop=4)
    ticker, join = model.add(Ticker("t", limit=3)), model.add(Join("j"))
    for name, factor in (("a", 2), ("b", 3)):
        scale = model.add(Scale(name, factor=factor))
        model.connect(ticker.output, scale.input)
        model.connect(scale.output, join.input)
    return model


def library(tmp_path: Path) -> Path:
    path = tmp_path / "media.yaml"
    path.write_text(CLASSES, encoding="utf-8")
    return path


def test_models_built_in_python(tmp_path: Path) -> None:
    desk = load_composite(library(tmp_path), "Desk", types=[Negate])
    crossing = load_composite(library(tmp_path), "Crossing", types=[Negate])
    model = python_pair()
    model.weave("net", desk("net", time=0.1), at=[model["a"].input, "b.input"])
    assert [time for time, *_ in acts(run(model), "delivered")][:2] == [0.1, 0.2]
    model.unweave("net")
    model.weave("cpu", desk("cpu"), at=[model["a"], "b"], time="1 s")
    assert [time for time, *_ in acts(run(model), "executed")][:2] == [0.3, 0.6]
    model.unweave("cpu")
    assert not model.graph.composites
    assert not model.aspects
    assert run(model).digest == run(python_pair()).digest
    model.weave("net", crossing("net"), at={"east": model["a"].input, "west": ["b.input"]})
    assert [(time, port) for time, _, port, _ in acts(run(model), "delivered")][:2] == [
        (0.0, "a.input"),
        (0.5, "b.input"),
    ]
    model.remove("net")
    assert not model.aspects

    net = model.composite("medium", inputs=["request"], outputs=["response"])
    net.add(Negate("negate"))
    net.connect("request -> negate.input")
    net.connect("negate.output -> response")
    model.weave("net", net, at="a.input")
    assert [value for *_, value in sends(run(model), "a.output")] == [0.0, -2.0, -4.0]
    with pytest.raises(ModelError, match="medium is the model of another aspect already"):
        model.weave("again", net, at="b.input")
    assert [woven.name for woven in model.aspects] == ["net"]


def test_a_weaving_that_fails_changes_nothing(tmp_path: Path) -> None:
    desk = load_composite(library(tmp_path), "Desk", types=[Negate])
    model = python_pair()
    for at, message in (
        ("a.inptu", "'a.inptu' matches no port"),
        ("net.server.input", "it cannot stand inside of itself"),
    ):
        with pytest.raises(ModelError, match=message):
            model.weave("net", desk("net"), at=at)
    assert run(model).digest == run(python_pair()).digest
    model.weave("loss", PacketLoss(probability=0), at="a.input")
    with pytest.raises(ModelError, match="there is an aspect 'loss' already"):
        model.weave("loss", desk("net"), at="a.input")
    assert not model.graph.composites


def test_a_loaded_model_can_be_changed(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(
        "model: m" + PAIR.replace("{ASPECTS}", "{net: {type: Desk, at: [a.input, b.input]}}"), encoding="utf-8"
    )
    model = load_model(path, types=[Ticker, Scale, Join, Negate])
    model.unweave("net")
    assert run(model).digest == run(pair("")).digest


DISTURBANCE = """
disturbance: congestion
parameters: {time: {value: 100 ms, doc: how long a message takes}}
composites:
  Line2:
    parameters: {time: }
    inputs: [request]
    outputs: [response]
    actors: {server: {type: Server, service_time: "${time}"}}
    connections: [request -> server.input, server.output -> response]
aspects:
  net: {type: Line2, time: "${time}", at: [a.input, b.input]}
"""


def test_a_disturbance_brings_its_model_along(tmp_path: Path) -> None:
    path = tmp_path / "congestion.yaml"
    path.write_text(DISTURBANCE, encoding="utf-8")
    text = PAIR.replace("{ASPECTS}", "{}")
    loaded = load(text, disturb=path)
    assert [time for time, *_ in acts(run(loaded), "delivered")][:2] == [0.1, 0.2]
    assert [time for time, *_ in acts(run(load(text, disturb=path, set=["time=1 ms"])), "delivered")][:1] == [0.001]
    later = load(text)
    later.disturb(path)
    assert run(later).digest == run(loaded).digest
    later.unweave("net")
    assert run(later).digest == run(load(text)).digest

    path.write_text(DISTURBANCE.replace("b.input]", "b.inptu]"), encoding="utf-8")
    with pytest.raises(ModelError, match=r"'b.inptu' matches no port"):
        later.disturb(path)
    assert run(later).digest == run(load(text)).digest
    path.write_text(DISTURBANCE.replace("Line2", "Line"), encoding="utf-8")
    with pytest.raises(ModelError, match=r"there is a composite 'Line' already"):
        load(text, disturb=path)
    path.write_text(DISTURBANCE.replace("net:", "a:"), encoding="utf-8")
    for attempt in (lambda: later.disturb(path), lambda: load(text, disturb=path)):
        with pytest.raises(ModelError, match=r"'a' is the name of an actor and of an aspect that is a model"):
            attempt()


def test_the_streams_of_a_model_in_an_aspect_are_its_own() -> None:
    """Another aspect, before or behind, moves no random number inside."""
    random = PAIR.replace('service_time: "${time}"', "distribution: {type: Exponential, mean: 0.1}")
    random = random.replace("    parameters: {time: 300 ms}\n", "")
    alone = run(load(random.replace("{ASPECTS}", "{net: {type: Desk, at: a.input}}")))
    others = "noise: {type: Noise, deviation: 1, at: b.output}, two: {type: Desk, at: b.input}"
    both = run(load(random.replace("{ASPECTS}", f"{{{others}, net: {{type: Desk, at: a.input}}}}")))
    assert sends(alone, "a.output") == sends(both, "a.output")
    assert len({tag for tag, *_ in sends(alone, "a.output")}) == 3
