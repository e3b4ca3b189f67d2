"""Aspects that are models: tokens go through a composite on their way, each to where it was going."""

from __future__ import annotations

import numpy as np
import pytest

from epicycle.actors import Actor, InputPort, OutputPort
from epicycle.aspects import Request
from epicycle.runner import ActorError
from tests.aspects.core.composite_parts import CLASSES, PAIR, TWINS, acts, load, pair, run, sends
from tests.engine import engine_parts


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
    edges: list[tuple[str, int]] = []
    for i in range(8):
        known = ["t", *names[:i]]
        edges += [(known[k], i) for k in random.permutation(len(known))[: random.integers(1, 4)]]
    chosen = [edges[k] for k in random.permutation(len(edges))[:4]]
    actors = "".join(f"  {name}: {{type: AddSubtract}}\n" for name in names)

    def text(through: list[tuple[str, int]], aspects: str, more: str) -> str:
        ways = []
        for k, (source, i) in enumerate(edges):
            if (source, i) in through:
                ways += [f"{source}.output -> i{k}.input", f"i{k}.output -> n{i}.plus"]
            else:
                ways.append(f"{source}.output -> n{i}.plus")
        return (
            f"{CLASSES}actors:\n  t: {{type: Ticker}}\n{actors}{more}connections: [{', '.join(ways)}]\n"
            f"aspects: {{{aspects}}}\nrun: {{stop: 3 s}}"
        )

    woven = ", ".join(f"w{k}: {{type: Line, at: {a}.output -> n{i}.plus}}" for k, (a, i) in enumerate(chosen))
    inserted = "".join(f"  i{k}: {{type: Scale, factor: -1}}\n" for k, edge in enumerate(edges) if edge in chosen)
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
    with pytest.raises(ActorError, match="but no such request to net waits for an answer"):
        run(firings)


def test_what_comes_out_must_have_gone_in() -> None:
    text = PAIR.replace("{type: Negate}", "{type: Unwrap}").replace("{ASPECTS}", "{net: {type: Line, at: a.input}}")
    with pytest.raises(ActorError) as caught:
        run(load(text))
    assert str(caught.value).partition("\n")[0] == (
        "aspect net failed in delivering at (0 s, 1): net.response sends 0, which is not a request: an aspect that "
        "is a model must send back the requests that it receives, with another token in them if needed"
    )
