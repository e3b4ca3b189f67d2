"""Where and when aspects act: pointcuts by pattern, type, tag and connection; windows of time; conditions on ports."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.actors import EpicycleError
from epicycle.actors.expression import ExpressionError, PortFormula
from epicycle.aspects import Bias, JoinPoint, PacketLoss, PortAspect
from epicycle.runner import ActorError, ModelError
from epicycle.runner.execution.engine import Results
from tests.engine.engine_parts import load, simulate

PARTS = """
composites:
  Twin:
    inputs: [go]
    outputs: [gone]
    actors: {{first: {{type: Scale}}, second: {{type: Scale, tags: [radio]}}}}
    connections: [go -> first.input, first.output -> second.input, second.output -> gone]
actors:
  t: {{type: Ticker, period: 1 ms}}
  a: {{type: Scale, tags: radio}}
  b: {{type: Scale, tags: [radio, spare]}}
  twin: {{type: Twin, count: 3}}
connections: [t.output -> a.input, t.output -> b.input, "t.output -> twin[*].go"]
aspects:
  loss: {{{}}}
run: {{stop: 9 ms}}
"""
ALL = [f"{path}.input" for path in ("a", "b", *(f"twin[{i}].{s}" for i in range(3) for s in ("first", "second")))]


def woven(aspect: str) -> Any:
    return load(PARTS.format(aspect)).aspects[0]


def problem(aspect: str) -> str:
    with pytest.raises(ModelError) as caught:
        load(PARTS.format(aspect))
    lines = str(caught.value).splitlines()
    told = [line for line in lines if "error:" in line or line.strip().startswith("help:")]
    return "\n".join(line[line.index("m.yaml") :] if "m.yaml" in line else line for line in told)


def dropped(aspect: str, stop: str = "9 ms") -> dict[str, list[int]]:
    """The ticks whose tokens were taken away, for each port."""
    results: Results = simulate(PARTS.format(aspect).replace("9 ms", stop))[1]
    found: dict[str, list[int]] = {}
    for record in results.log.records:
        if record.event == "dropped":
            found.setdefault(f"{record.actor}.{record.port}", []).append(round(record.tag.time / 1e6))
    return found


@pytest.mark.parametrize(
    ("at", "ports"),
    [
        ('"*.input"', ALL[:2]),
        ('"**.input"', ALL),
        ('["**.input", "!twin[*].**"]', ALL[:2]),
        ('["!twin[1].**", "**.input"]', [port for port in ALL if "twin[1]" not in port]),
        ('["*.input", "!b.input"]', ["a.input"]),
        ("{type: Scale}", ALL),
        ("{type: Scale, port: input}", ALL),
        ("{type: Twin}", [f"twin[{i}].go" for i in range(3)]),
        ("{tag: radio}", ["a.input", "b.input", *(f"twin[{i}].second.input" for i in range(3))]),
        ("[{tag: spare}, {type: Twin, port: go}, '!twin[0].go']", ["b.input", "twin[1].go", "twin[2].go"]),
    ],
)
def test_pointcuts(at: str, ports: list[str]) -> None:
    assert woven(f"type: PacketLoss, probability: 1, at: {at}").ports == ports


def test_an_aspect_on_one_connection() -> None:
    aspect = "type: PacketLoss, probability: 1, at: 't.output -> b.input'"
    assert woven(aspect).ports == []
    assert woven(aspect).connections == [("t.output", "b.input")]
    assert dropped(aspect) == {"b.input": list(range(10))}
    several = "type: PacketLoss, probability: 1, at: ['*.output -> *.input', '!t.output -> a.input']"
    assert woven(several).connections == [("t.output", "b.input")]
    port_left_out = "type: PacketLoss, probability: 1, at: ['*.output -> *.input', '!a.input']"
    assert woven(port_left_out).connections == [("t.output", "b.input")]


@pytest.mark.parametrize(
    "place",
    [
        "at: {type: Twin}",
        "at: {type: Difference, port: input}",
        "at: {tag: third}",
        "at: 'twin[*].go'",
        "at: ['a.input', '!twin[*].go']",
        "at: 't.output -> twin[*].go'",
        "at: a.input, when: 'twin[0].gone > 3'",
    ],
)
def test_an_empty_array_is_no_mistake(place: str) -> None:
    text = PARTS.format(f"type: PacketLoss, probability: 1, {place}").replace("count: 3", "count: 0")
    text = text.replace("first: {type: Scale}", "first: {type: Difference, tags: third}")
    assert load(text).aspects[0].places == (["a.input"] if "a.input" in place else [])


def test_connections_have_streams_of_their_own() -> None:
    both = dropped("type: PacketLoss, probability: 0.5, at: '*.output -> *.input'", stop="99 ms")
    alone = dropped("type: PacketLoss, probability: 0.5, at: 't.output -> b.input'", stop="99 ms")
    assert both["b.input"] == alone["b.input"] != both["a.input"]


@pytest.mark.parametrize(
    ("window", "ticks"),
    [
        ("from: 3 ms", [3, 4, 5, 6, 7, 8, 9]),
        ("until: 3 ms", [0, 1, 2]),
        ("from: 2 ms, until: 4 ms", [2, 3]),
        ("until: 2 ms, every: 5 ms", [0, 1, 5, 6]),
        ("from: 1 ms, until: 2 ms, every: 3 ms", [1, 4, 7]),
        ("when: b.output > 4", [5, 6, 7, 8, 9]),  # b fires first, so its token of the same tag counts
        ("when: b.output > 4 and b.output <= 6", [5, 6]),
        ("from: 7 ms, when: b.output > 4", [7, 8, 9]),
    ],
)
def test_when_an_aspect_is_active(window: str, ticks: list[int]) -> None:
    at = '"twin[0].second.input"' if "b.output" in window else '"a.input"'
    found = dropped(f"type: PacketLoss, probability: 1, {window}, at: {at}")
    (port,) = found
    assert found[port] == ticks


def test_windows_can_be_set_from_outside() -> None:
    model = load(PARTS.format("type: PacketLoss, probability: 1, at: a.input"), set=["loss.from=4 ms"])
    assert model.aspects[0].aspect.from_ == 0.004


@pytest.mark.parametrize(
    ("aspect", "message"),
    [
        (
            "type: PacketLoss, probability: 1, at: {type: Scales}",
            (
                "m.yaml:16:55: error: aspect loss: there is no actor of type 'Scales', did you mean 'Scale'?\n"
                "   help: types here: Scale, Ticker, Twin"
            ),
        ),
        (
            "type: PacketLoss, probability: 1, at: {tag: radios}",
            (
                "m.yaml:16:54: error: aspect loss: there is no actor with the tag 'radios', did you mean 'radio'?\n"
                "   help: tags here: radio, spare"
            ),
        ),
        (
            "type: PacketLoss, probability: 1, at: {type: Scale, port: inpt}",
            (
                "m.yaml:16:68: error: aspect loss: no actor of type 'Scale' has a port 'inpt', did you mean 'input'?\n"
                "   help: their ports: input, output"
            ),
        ),
        (
            "type: PacketLoss, probability: 1, at: {port: input}",
            (
                "m.yaml:16:48: error: a pointcut selects by pattern, type or tag\n"
                "   help: write {at: ...}, {type: ..., port: ...} or {tag: ...}"
            ),
        ),
        (
            "type: PacketLoss, probability: 1, at: 't.output -> c.input'",
            (
                "m.yaml:16:48: error: aspect loss: 't.output -> c.input' matches no connection, "
                "did you mean 't.output -> b.input'?"
            ),
        ),
        (
            "type: Bias, by: 1, at: 't.output -> b.input'",
            "m.yaml:16:33: error: aspect loss: Bias attaches to output ports, not to connections",
        ),
        (
            "type: PacketLoss, probability: 1, at: ['a.input', '!b.inptu']",
            (
                "m.yaml:16:60: error: aspect loss: 'b.inptu' matches no port, did you mean 'b.input'?\n"
                "   help: valid ports of b: input"
            ),
        ),
        (
            "type: PacketLoss, probability: 1, at: '!a.input'",
            "m.yaml:16:48: error: aspect loss: 'at' has only exclusions",
        ),
        (
            "type: PacketLoss, probability: 1, at: ['a.input', '!*.input']",
            "m.yaml:16:49: error: aspect loss: 'at' excludes everything that it selects",
        ),
        (
            "type: PacketLoss, probability: 1, at: ['*.input', '!t.output -> a.input']",
            (
                "m.yaml:16:60: error: aspect loss: '!t.output -> a.input' excludes no selected connection\n"
                "   help: exclude ports from ports and connections from connections: select some, as in '*.out -> b.in'"
            ),
        ),
        (
            "type: PacketLoss, probability: 1, at: 'a.input, b.input'",
            (
                "m.yaml:16:48: error: aspect loss: 'a.input, b.input' is not a pointcut: 'input, b' is not a name, "
                "a name with an index, '*' or '**'\n"
                "   help: for several pointcuts, write a list: [a.in, b.in]"
            ),
        ),
        (
            "type: PacketLoss, probability: 1, at: a.input, when: b.outpt > 3",
            "m.yaml:16:63: error: aspect loss: when: 'b.outpt' names no output port, did you mean 'b.output'?",
        ),
        (
            "type: PacketLoss, probability: 1, at: a.input, when: b.input > 3",
            "m.yaml:16:63: error: aspect loss: when: b.input is an input port, but an output port is needed",
        ),
        (
            "type: PacketLoss, probability: 1, at: a.input, when: x > 3",
            (
                "m.yaml:16:63: error: aspect loss.when: 'x > 3' is not an expression over ports: "
                "unknown name 'x': a port is written 'actor.port'"
            ),
        ),
        (
            "type: PacketLoss, probability: 1, at: a.input, from: 3 s, until: 2 s",
            "m.yaml:16:3: error: aspect loss: it is never active: 'until' (2 s) must be after 'from' (3 s)",
        ),
        (
            "type: PacketLoss, probability: 1, at: a.input, every: 2 s",
            "m.yaml:16:3: error: aspect loss: 'every' (2 s) needs 'until' as well",
        ),
        (
            "type: PacketLoss, probability: 1, at: a.input, until: 3 s, every: 2 s",
            "m.yaml:16:3: error: aspect loss: 'every' (2 s) needs to be at least the time from 'from' to 'until'",
        ),
    ],
)
def test_wrong_places_and_times(aspect: str, message: str) -> None:
    assert problem(aspect) == message


def test_no_port_of_the_kind() -> None:
    with pytest.raises(ModelError) as caught:
        load(PARTS.replace("a: {{type: Scale", "a: {{type: Recorder").format("type: Bias, by: 1, at: {type: Recorder}"))
    assert str(caught.value).partition("\n")[0].partition("error: ")[2] == (
        "aspect loss: Bias attaches to output ports, but no actor of type 'Recorder' has one"
    )


def test_a_condition_that_cannot_be_evaluated() -> None:
    with pytest.raises(ActorError) as caught:
        dropped("type: PacketLoss, probability: 1, at: 'twin[0].go', when: 'b.output[0] > 3'")
    assert str(caught.value).partition("\n")[0] == (
        "aspect loss failed in when at (0.001 s, 1): 'b.output[0] > 3': b.output[0]: a number has no elements, "
        "with b.output = 0.0"
    )


def test_conditions_on_fields() -> None:
    formula = PortFormula("a.state.position[0] < 2 and b[0].c == 'x.y'")
    assert formula.references == ("a.state.position", "b[0].c")
    assert formula([[1.0, 5.0], "x.y"]) is True
    with pytest.raises(EpicycleError, match=r"a\.state\.position"):
        formula(["text", "x.y"])
    with pytest.raises(ExpressionError, match=r"it names no port: write a port as 'actor.port'"):
        PortFormula("1 < 2")


class Nosy(PortAspect):
    """Adds up what others have sent."""

    stands_at = frozenset({"input"})
    events = ("seen",)

    def reads(self) -> tuple[str, ...]:
        return ("*.output",)

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.shared["times"] = point.shared.get("times", 0) + 1
        point.act("seen", [point.owner, point.latest("b.output"), point.shared["times"]])
        point.forward(token)


def test_an_aspect_may_look_at_ports_and_share_a_memory() -> None:
    text = PARTS.format("type: Nosy, at: ['*.input', 'twin[2].go']").replace("9 ms", "1 ms")
    model = load(text, types=[Nosy])
    from epicycle.runner import Simulation

    results = Simulation(model, keep_log=True).run()
    values = [record.value for record in results.log.records if record.event == "seen"]
    # The ticker sends to all at once, before b has fired; the memory is one for all ports.
    assert values == [
        ["a", None, 1],
        ["b", None, 2],
        ["twin[2]", None, 3],
        ["a", 0.0, 4],
        ["b", 0.0, 5],
        ["twin[2]", 0.0, 6],
    ]
    again = Simulation(load(text, types=[Nosy]), keep_log=True).run()
    assert again.digest == results.digest


def test_a_failing_aspect_is_named_and_not_the_sender() -> None:
    with pytest.raises(ActorError) as caught:
        dropped("type: Bias, by: 1, fields: x, at: t.output")
    assert str(caught.value).partition("\n")[0] == (
        "aspect loss failed in pass_token() at t.output at (0 s, 1): a token of type int has no fields; leave out "
        "'fields' to alter all its numbers"
    )


def test_a_window_in_python() -> None:
    aspect = PacketLoss(probability=1, **{"from": 1, "until": "2 s", "every": 4})
    assert (aspect.from_, aspect.until, aspect.every) == (1.0, 2.0, 4.0)
    assert [second for second in range(12) if aspect.is_due(second * 10**9)] == [1, 5, 9]
    assert not aspect.is_always_active
    assert Bias(by=1).is_always_active
