"""What actors do, against what the sources of Ptolemy II's actors of these names say."""

from __future__ import annotations

from contextlib import nullcontext
from itertools import pairwise
from typing import Any

import pytest

from epicycle.actors import Clock, Tag
from epicycle.actors.testing import Harness
from epicycle.runner.execution.engine import ActorError, Simulation
from tests.actors.feeding import load
from tests.actors.library_parts import Feeds, behave, problem, text
from tests.engine.engine_parts import Probe


def there(actor: str, feeds: Feeds, until: float = 100, outputs: int = 0) -> list[Any]:
    """What the actor sends: time, microstep, port with the channel if one was given, token."""
    model = "model: m\n" + text(f"{{type: {actor}}}", feeds, outputs)
    results = Simulation(load(model, [Probe]), keep_log=True).run(until=until)
    return [
        (r.tag.seconds, r.tag.microstep, r.port if r.channel is None else f"{r.port}/{r.channel}", r.value)
        for r in results.log.records
        if r.event == "send" and r.actor == "it"
    ]


@pytest.mark.parametrize(
    ("actor", "feeds", "expected"),
    [
        # Nothing is connected to the trigger; tokens of one tag come in firing by firing.
        ("Queue", [("input", [[0, "a"], [0, "b"]])], [(0, 1, "size", 1), (0, 1, "size", 2)]),
        ("Counter, reset_by: any", [("increment", [[0, 0]]), ("reset", [[1, 5]])],
         [(0, 1, "output", 1), (1, 1, "output", 0)]),
        ("PoissonClock, mean_interval: 1000 s, stop_time: 0 s", [("trigger", [[1, 0]])], [(0, 1, "output", 0)]),
        ("Server", [("input", [[0, "a"], [0.5, "b"]])],
         [(0, 1, "size", 1), (0.5, 1, "size", 2), (1, 1, "output", "a"), (1, 1, "size", 1), (2, 1, "output", "b"),
          (2, 1, "size", 0)]),
        # The service time is settled on arrival; no time at all is a microstep.
        ("Server", [("service_time", [[0, 3], [1, 0]]), ("input", [[0, "a"], [1, "b"]])],
         [(0, 1, "size", 1), (1, 1, "size", 2), (3, 1, "output", "a"), (3, 1, "size", 1), (3, 2, "output", "b"),
          (3, 2, "size", 0)]),
        ("ResettableTimer, preemptive: false", [("input", [[0, 2], [1, 2], [1.5, 1]])],
         [(2, 1, "output", True), (4, 1, "output", True), (5, 1, "output", True)]),
        # A negative one takes back what waits last, or what runs.
        ("ResettableTimer, preemptive: false", [("input", [[0, 2], [1, 2], [1.5, -1], [5, 1], [5.5, -1], [6, 1]])],
         [(2, 1, "output", True), (7, 1, "output", True)]),
        ("Comparator, comparison: '==', value: 2", [("left", [[0, 1], [0, 2]])],
         [(0, 1, "output", False), (0, 1, "output", True)]),
        ("Expression, expression: a + iteration, iteration: true", [("a", [[0, 10], [0, 20], [1, 30]])],
         [(0, 1, "output", 11), (0, 1, "output", 22), (1, 1, "output", 33)]),
        ("Select, unread: lost", [("input", [[0, "a"], [2, "b"]]), ("input", [[0, "x"]]), ("control",
         [[1, 1], [2, 0]])],
         [(0, 1, "output", "a"), (2, 1, "output", "b")]),
    ],
)  # fmt: skip
def test_sends(actor: str, feeds: Feeds, expected: list[Any]) -> None:
    assert there(actor, feeds) == expected


@pytest.mark.parametrize(
    ("clock", "feeds", "expected"),
    [
        # The first tick is sent, and those for which a trigger has come since the one before, or comes with them.
        ("period: 1 s", [("trigger", [[0.5, 0], [2.2, 0], [2.5, 0], [5, 0]])],
         [(0, 1, 0), (1, 1, 1), (3, 1, 3), (5, 1, 5)]),
        ("period: 2 s, offsets: [0, 2 s], values: [a, b]", [],
         [(0, 1, "a"), (2, 1, "b"), (2, 2, "a"), (4, 1, "b"), (4, 2, "a")]),
        ("period: .inf, offsets: [1 s, 1 s, 2 s]", [], [(1, 1, 0), (1, 2, 1), (2, 1, 2)]),
        ("period: 1 s, offsets: [0, 0.5 s], cycles: 2", [], [(0, 1, 0), (0.5, 1, 1), (1, 1, 2), (1.5, 1, 3)]),
        ("period: 1 s, reset_period: false", [("start", [[0, 0], [3.5, 0]]), ("period", [[1, 2]])],
         [(0, 1, 0), (1, 1, 1), (3, 1, 2), (3.5, 1, 0), (5.5, 1, 1)]),
        # A new period counts at once, for the wait up to the next cycle, if that is not over already.
        ("period: 4 s, new_period: at once", [("period", [[1, 2], [3, 0.5]])],
         [(0, 1, 0), (2, 1, 1), (4, 1, 2), (4.5, 1, 3), (5, 1, 4), (5.5, 1, 5)]),
        ("period: 2 s, new_period: at once", [("period", [[2, 3], [4, 1]])],
         [(0, 1, 0), (3, 1, 1), (4, 1, 2), (5, 1, 3)]),
        ("period: 2 s, offsets: [0, 1 s], new_period: at once", [("period", [[0.5, 4]])], [(0, 1, 0), (1, 1, 1), (4,
         1, 2), (5, 1, 3)]),
    ],
)  # fmt: skip
def test_clock(clock: str, feeds: Feeds, expected: list[Any]) -> None:
    sends = there(f"Clock, {clock}", feeds, until=5.5)
    assert [(time, microstep, token) for time, microstep, _, token in sends] == expected


@pytest.mark.parametrize(("late", "expected"), [(False, [0.0, 3.0]), (True, [0.0, 1.0])])
def test_a_trigger_that_comes_microsteps_after_the_tick(late: bool, expected: list[float]) -> None:
    harness = Harness(Clock("clock", period=1.0, late_trigger=late), widths={"trigger": 1})
    harness.run(until=1.0)
    harness.fire(1.0, microstep=2, trigger=[0])
    harness.tag = Tag(1_500_000_000, 1)
    if not late:  # the trigger counts for the next tick
        harness.run(until=2.0)
        harness.tag = Tag(2_500_000_000, 1)
        harness.run(until=3.0, trigger=[(2.5, [0])])
        assert [time for time, _ in harness.sent["output"]] == [0.0, 2.0, 3.0]
        return
    harness.run(until=2.0)
    assert [time for time, _ in harness.sent["output"]] == expected


@pytest.mark.parametrize(
    ("actor", "feeds", "expected"),
    [
        ("Pulse", [("trigger", [[n, 0] for n in range(4)])], [1, 0, 0, 0]),
        ("Pulse, values: [2.5, 3.5], indexes: [1, 3]", [("trigger", [[n, 0] for n in range(5)])], [0.0, 2.5, 0.0,
         3.5, 0.0]),
        ("Pulse, values: [[1, {x: 2.5}]], indexes: [1]", [("trigger", [[0, 0], [1, 0]])],
         [[0, {"x": 0.0}], [1, {"x": 2.5}]]),
        ("Pulse, repeat: true, values: [a, b], indexes: [0, 2]", [("trigger", [[n, 0] for n in range(7)])],
         ["a", "", "b", "a", "", "b", "a"]),
        # The trigger that begins anew is answered only if a value is due at once.
        ("Pulse, repeat: true, values: [7], indexes: [1]", [("trigger", [[n, 0] for n in range(5)])], [0, 7, 7]),
        ("Ramp, init: 3, step: 2", [("trigger", [[0, 0], [1, 0]])], [3, 5]),
        ("Ramp, limit: 2", [("trigger", [[0, 0], [0, 0], [1, 0]])], [0, 1]),
        ("Const, limit: 2, value: a", [("trigger", [[0, 0], [1, 0], [2, 0]])], ["a", "a"]),
        ("Const, limit: 1", [], [1]),
        ("Pulse, limit: 3", [("trigger", [[n, 0] for n in range(5)])], [1, 0, 0]),
        # Triggers that come together, one on each channel, are one.
        ("Ramp", [("trigger", [[0, 0], [1, 0]]), ("trigger", [[1, 0], [2, 0], [2, 0]])], [0, 1, 2, 3]),
        ("CurrentTime", [("trigger", [[0, 0], [1, 0]]), ("trigger", [[1, 0]])], [0.0, 1.0, 1.0]),
        ("CurrentMicrostep", [("trigger", [[0, 0], [1, 0]]), ("trigger", [[1, 0]])], [1, 1]),
        ("Sequence, values: [1, 2], hold: true", [("trigger", [[n, 0] for n in range(4)])], [1, 2, 2, 2]),
        ("Integrator, method: trapezoid", [("input", [[0, 1.0], [2, 3.0], [6, 1.0], [7, 1.0]]), ("reset", [[5, 0]])],
         [0.0, 4.0, 4.0, 0.0, 1.0]),
        ("Derivative", [("input", [[0, 1], [2, 3], [2, 3], [3, 1], [4, 9]]), ("reset", [[3, 0]])], [1.0, -2.0]),
        ("TimeAverage", [("input", [[0, 1], [2, 3], [4, 0], [8, 1]])], [1.0, 2.0, 1.0]),
        ("Sequencer", [("input", [[n, n] for n in range(5)]), ("number", [[0, 2], [1, 0], [3, 1], [4, 4]])], [1, 2, 0]),
        ("Collect", [("input", [[0, 1], [1, 2]]), ("input", [[1, "a"], [1, "b"], [2, "c"]])], [[1, "a"], [2, "b"]]),
        ("Collect, joined: true", [("input", [[0, [1]]]), ("input", [[1, [2, 3]]])], [[1, 2, 3]]),
        ("RecordAssembler, fields: [x], onto: input", [("input", [[0, {"x": 1, "y": 2}]]), ("x", [[1, 5]])],
         [{"x": 5, "y": 2}]),
        ("Changes, by: 1", [("input", [[n, token] for n, token in enumerate([0.5, 1.5, 1.6, 0.7, 0.5])])],
         [0.5, 1.6, 0.5]),
        ("Previous", [("input", [[0, "a"], [1, "b"], [1, "c"]])], ["a", "b"]),
        ("Previous, initial: z", [("input", [[0, "a"], [1, "b"]])], ["z", "a"]),
        ("FirstOfInstant", [("input", [[0, "a"], [0, "b"], [1, "c"]])], ["a", "c"]),
        ("Filter", [("input", [[0, True], [1, False], [2, True]])], [True, True]),
        ("Filter, condition: token > 1", [("input", [[0, 1], [1, 2], [2, 3]])], [2, 3]),
        ("Equals", [("input", [[0, 1], [1, "a"]]), ("input", [[0, 1.0], [1, "b"], [2, 3]])], [True, False, True]),
        ("Equals, tolerance: 0.1",
         [("input", [[0, 1], [1, "a"], [2, [1, {"x": 2}]]]), ("input", [[0, 1.05], [1, "b"], [2, [1, {"x": 2.05}]]])],
         [True, False, True]),
        ("WaitingTime", [("waiter", [[0, 0], [1, 0], [3, 0], [4, 0]]), ("waited_for", [[3, 0], [3.5, 0]])], [3.0,
         2.0, 0.0]),
        ("TimeCompare", [("first", [[0, 0], [1, 0], [5, 0]]), ("second", [[0.5, 0], [3, 0], [4, 0]])], [0.5, 2.0,
         -1.0]),
        ("TimeCompare, nonnegative: true", [("first", [[1, 0], [5, 0]]), ("second", [[0, 0], [2, 0], [3, 0], [6, 0]])],
         [1.0, 1.0]),
        # An index that comes keeps, and sends nothing.
        ("HoldingExpression, expression: 'input[index]', held: {index: 0}", [("input", [[0, [1, 2]], [2, [3, 4]], [3,
         [5, 6]]]), ("index", [[1, 1], [3, 0]])], [1, 4, 5]),
        ("HoldingExpression, expression: a + b, held: {a: x, b: ''}", [("b", [[0, "y"], [1, "z"]])], ["xy", "xz"]),
        ("BlockExpression, expression: 'block[1]', number: 2", [("input", [[n, n] for n in range(5)])], [1, 3]),
        ("BlockExpression, expression: '[block[0], 0.0]', items: true", [("input", [[0, 1.5], [1, 2.5]])],
         [1.5, 0.0, 2.5, 0.0]),
        ("BlockExpression, expression: past + block, past: [0, 0]", [("input", [[n, n + 1] for n in range(3)])],
         [[0, 0, 1], [0, 1, 2], [1, 2, 3]]),
        ("TextFunction, function: contains, other: b", [("text", [[0, "abc"], [1, "B"]]), ("other", [[2, "B"]])],
         [True, False, True]),
        ("TextFunction, function: equals, other: b, ignore_case: true", [("text", [[0, "B"]])], [True]),
        # What is found is found in any case, and what is around it keeps its own.
        ("TextFunction, function: replace, other: LO, new: x, ignore_case: true", [("text", [[0, "HeLlo, World"]])],
         ["HeLx, World"]),
        ("TextFunction, function: split, other: X, ignore_case: true", [("text", [[0, "AxBXC"]])], [["A", "B", "C"]]),
        ("TextFunction, function: trim, ignore_case: true", [("text", [[0, " A "]])], ["A"]),
        ("TextFunction, function: find, other: b, ignore_case: true", [("text", [[0, "\u0130B"]])], [1]),
        ("TextFunction, function: replace, other: a, new: xy", [("text", [[0, "aba"]])], ["xybxy"]),
        ("TextFunction, function: replace first, other: a, new: xy", [("text", [[0, "aba"]])], ["xyba"]),
        ("TextFunction, function: find", [("text", [[0, "abc"]]), ("other", [[0, "c"], [1, "x"]])], [2, -1]),
        ("TextFunction, function: split, other: ', '", [("text", [[0, "a, b"]])], [["a", "b"]]),
        ("TextFunction, function: trim", [("text", [[0, " a "]])], ["a"]),
        ("Commutator", [("input", [[0, "a"], [1, "b"]]), ("input", [[2, "x"], [3, "y"]])], ["a", "x", "b", "y"]),
        ("Commutator, block: 2", [("input", [[0, "a"], [1, "b"], [4, "c"]]), ("input", [[2, "x"], [3, "y"]])],
         ["a", "b", "x", "y"]),
    ],
)  # fmt: skip
def test_tokens(actor: str, feeds: Feeds, expected: list[Any]) -> None:
    told = [token for *_, token in there(actor, feeds)]
    assert told == expected
    assert [type(token) for token in told] == [type(token) for token in expected]


@pytest.mark.parametrize(
    ("actor", "feeds", "outputs", "expected"),
    [
        ("Inhibit", [("input", [[0, "a"], [1, "b"], [2, "c"]]), ("inhibit", [[1, 0]])], 0,
         [(0, 1, "output", "a"), (2, 1, "output", "c")]),
        # The second token has no inhibiting one.
        ("Inhibit", [("input", [[0, "a"], [0, "b"]]), ("input", [[0, "x"]]), ("inhibit", [[0, 0]])], 2,
         [(0, 1, "output/0", "b")]),
        ("Register, initial: z", [("input", [[1, "a"], [2, "b"]]), ("trigger", [[0, 0], [1, 0], [3, 0]])], 0,
         [(0, 1, "output", "z"), (1, 1, "output", "z"), (3, 1, "output", "b")]),
        ("MostRecent", [("input", [[1, "a"], [2, "b"]]), ("trigger", [[0, 0], [2, 0]]), ("trigger",
         [[2, 0], [3, 0]])], 0,
         [(2, 1, "output", "b"), (3, 1, "output", "b")]),
        ("SharedQueue, capacity: 1", [("input", [[n, n] for n in range(6)]), ("trigger", [[5, 0]]), ("trigger",
         [[3, 0]])], 2,
         [(0, 1, "output/0", 0), (0, 1, "size", 0), (1, 1, "output/1", 1), (1, 1, "size", 0), (2, 1, "size", 1),
          (3, 1, "output/1", 2), (3, 1, "size", 1), (4, 1, "rejected", 4), (4, 1, "size", 1), (5, 1, "output/0", 3),
          (5, 1, "size", 1)]),
        ("SharedQueue", [("input", [[2, "a"]]), ("trigger", [[0, 0]])], 1, [(0, 1, "size", 0), (2, 1, "output/0",
         "a"), (2, 1, "size", 0)]),
        ("Extreme, take: greatest", [("input", [[0, 1], [1, 5]]), ("input", [[1, 5], [2, 2.5]])], 0,
         [(0, 1, "value", 1), (0, 1, "channel", 0), (1, 1, "value", 5), (1, 1, "channel", 0), (2, 1, "value", 2.5),
          (2, 1, "channel", 1)]),
        ("Extreme, take: least", [("input", [[0, 1]]), ("input", [[0, -1]])], 0,
         [(0, 1, "value", -1), (0, 1, "channel", 1)]),
        ("Spread", [("input", [[0, [1, 2, 3]], [1, ["a"]]])], 2,
         [(0, 1, "output/0", 1), (0, 1, "output/1", 2), (1, 1, "output/0", "a")]),
        ("LatestOfAll, initial: 0", [("input", [[0, 1], [2, 2]]), ("input", [[1, "x"]])], 2,
         [(0, 1, "output/0", 1), (0, 1, "output/1", 0), (1, 1, "output/0", 1), (1, 1, "output/1", "x"),
          (2, 1, "output/0", 2), (2, 1, "output/1", "x")]),
        ("LatestOfAll", [("input", [[0, 1], [0, 2]])], 0, [(0, 1, "output", 1), (0, 1, "output", 2)]),
        ("IsPresent", [("input", [[0, "a"], [1, "b"]]), ("input", [[1, "x"]])], 2,
         [(0, 1, "output/0", True), (0, 1, "output/1", False), (1, 1, "output/0", True), (1, 1, "output/1", True)]),
        ("BooleanSelect", [("true_input", [[0, "a"], [1, "b"]]), ("false_input", [[2, "x"]]),
                           ("control", [[3, True], [4, False], [5, False], [6, True]])], 0,
         [(3, 1, "output", "a"), (4, 1, "output", "x")]),
        ("BooleanSelect", [("true_input", [[0, "a"], [1, "b"]]), ("control", [[0, True], [0, True], [2, True]])], 0,
         [(0, 1, "output", "a"), (1, 1, "output", "b")]),
        # Channel by channel.
        ("BooleanSwitch, control: true", [("input", [[0, "a"]]), ("input", [[0, "b"]])], 0, []),
    ],
)  # fmt: skip
def test_channels(actor: str, feeds: Feeds, outputs: int, expected: list[Any]) -> None:
    assert there(actor, feeds, outputs=outputs) == expected


@pytest.mark.parametrize(
    ("test", "feeds", "message"),
    [
        ("values: [1, 2], follow: false", [("input", [[0, 1], [1, 2], [2, 3]])],
         "token 2 is 3, expected only 2 tokens"),
        ("values: [[1, a], [2, b]], together: true", [("input", [[0, 1], [1, 2]]), ("input", [[0, "a"], [1, "b"]])],
         ""),
        ("values: [[1, a], [2, b]], together: true", [("input", [[0, 1], [1, 2]]), ("input", [[0, "a"], [1, "c"]])],
         "token 1 is [2, 'c'], expected [2, 'b'] within 1e-09"),
        ("values: [[1, a], [2, b]], together: true", [("input", [[0, 1], [1, 2]]), ("input", [[0, "a"]])],
         "no token came for value 1 on channel 1"),
        ("values: [{x: 1.0, y: [2]}]", [("input", [[0, {"x": 1 + 1e-12, "y": [2]}]])], ""),
        ("values: [{x: 1.0}]", [("input", [[0, {"y": 1.0}]])],
         "token 0 is {'y': 1.0}, expected {'x': 1.0} within 1e-09"),
        ("values: [1, 2]", [("input", [[0, 1]])], "1 of 2 expected tokens came; the next should have been 2"),
    ],
)  # fmt: skip
def test_checks(test: str, feeds: Feeds, message: str) -> None:
    with pytest.raises(ActorError) if message else nullcontext() as caught:
        there(f"Test, {test}", feeds)
    assert (caught.value.reason if caught else "") == message


@pytest.mark.parametrize(
    ("actor", "feeds", "message"),
    [
        ("Spread", [("input", [[0, "abc"]])], "'abc' is not a list"),
        ("Filter", [("input", [[0, 1]])], "'token' gives 1 for 1, expected true or false"),
        ("BlockExpression, expression: 'block[0]', items: true", [("input", [[0, 1]])],
         "'block[0]' gives 1, which is not a list of items to send"),
        ("TextFunction, function: replace, other: a", [("text", [[0, "a" * 200]]), ("new", [[0, "b" * 1000]])],
         "the result is longer than 100,000 characters"),
        ("Ramp", [("trigger", [[0, 0], [1, 0], [2, 0]]), ("step", [[0, 0.5]])],
         ("init and step are whole numbers, but a step of 0.5 came; write 'init: 0.0' to allow fractions")),
        ("Derivative", [("input", [[0, 1], [0, 2]])], "1 and 2 came at the same time, and a jump has no slope"),
    ],
)  # fmt: skip
def test_messages(actor: str, feeds: Feeds, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        there(actor, feeds)
    assert caught.value.reason == message


@pytest.mark.parametrize(
    ("actor", "message"),
    [
        ("Pulse, indexes: [1, 0]", "indexes: [1, 0] is not an ascending list of whole numbers >= 0"),
        ("RecordAssembler, fields: [input], onto: input", ("onto: 'input' is also one of the fields; choose another "
                                                          "name")),
        ("BlockExpression, expression: token", "expression: 'token' is unknown; the names are 'block' and 'past'"),
        ("HoldingExpression, expression: input, held: {index: 1}", ("held: 'index' is not a name in the expression "
                                                                   "'input'")),
        ("Pulse, indexes: [0]", "values: 2 values for 1 of 'indexes'; give one for each"),
        ("Pulse, indexes: [], values: []", "values: the list is empty; give at least one value"),
        ("Sequence, values: [1], repeat: true, hold: true",
         "repeat and hold cannot both be true: after the last value comes either the first or the last one again"),
        ("Test, values: [1], together: true", "values: value 0 is 1, expected a list with a token for each channel"),
    ],
)  # fmt: skip
def test_parameters_that_do_not_go_together(actor: str, message: str) -> None:
    port = "trigger" if actor.startswith(("Pulse", "Sequence")) else "input"
    assert problem(f"{{type: {actor}}}", [(port, [])]) == f"it: {message}"


def test_a_trigger_of_a_poisson_clock() -> None:
    """It ticks at once, and waits anew: the tick that was to come does not."""
    clock = "{type: PoissonClock, mean_interval: 5 s, values: [a, b]}"
    alone, with_trigger = behave(clock, [], until=200), behave(clock, [("trigger", [[0.05, 0]])], until=200)
    (first, *_), gaps = alone, [after[0] - before[0] for before, after in pairwise(alone)]
    assert with_trigger[0] == first
    assert with_trigger[1] == (0.05, 1, "output", "b")
    later = [after[0] - before[0] for before, after in pairwise(with_trigger[1:])]
    assert later[:5] == pytest.approx(gaps[1:6])


EVERY = [
    (actor.partition(",")[0], number, actor, feeds)
    for test in (test_sends, test_tokens, test_channels)
    for number, (actor, feeds, *_) in enumerate(test.pytestmark[0].args[1])
]


@pytest.mark.parametrize(("kind", "number", "actor", "feeds"), EVERY)
def test_snapshots_and_crashes(kind: str, number: int, actor: str, feeds: Feeds) -> None:
    """A run that goes on from a snapshot is the whole one; after a crash that costs the state the actor begins anew."""
    outputs = (
        2 if kind in ("Spread", "Switch", "IsPresent", "SharedQueue") or (len(feeds) == 3 and kind == "Inhibit") else 0
    )
    model = f"model: m\n{text(f'{{type: {actor}}}', feeds, outputs)}\n"
    whole = Simulation(load(model, [Probe]), keep_log=True).run(until=20).digest
    cut = Simulation(load(model, [Probe]), keep_log=True)
    cut.advance(1.0)
    assert cut.fork().run(until=20).digest == whole
    crash = "aspects: {crash: {type: CrashRestart, at: it, times: [1.25 s], repair: 0.125 s}}"
    results = Simulation(load(model + crash, [Probe]), keep_log=True).run(until=20)
    assert [record.event for record in results.log.records if record.aspect == "crash"][:2] == ["crashed", "restarted"]
