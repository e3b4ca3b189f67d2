"""What actors do under a director with ``like: ptolemy``, against what the sources of Ptolemy II's actors say."""

from __future__ import annotations

import math
from contextlib import nullcontext
from typing import Any

import pytest

from epicycle.ptolemy.computing import Test as Checks
from epicycle.runner.execution.engine import ActorError, Simulation
from tests.actors.feeding import load
from tests.actors.library_parts import Feeds, behave, text
from tests.engine.engine_parts import Probe


def there(actor: str, feeds: Feeds, until: float = 100, outputs: int = 0, director: str = "like: ptolemy") -> list[Any]:
    """What the actor sends: time, microstep, port with the channel if one was given, token."""
    model = f"model: m\ndirector: {{{director}}}\n" + text(f"{{type: {actor}}}", feeds, outputs)
    results = Simulation(load(model, [Probe]), keep_log=True).run(until=until)
    return [
        (r.tag.seconds, r.tag.microstep, r.port if r.channel is None else f"{r.port}/{r.channel}", r.value)
        for r in results.log.records
        if r.event == "send" and r.actor == "it"
    ]


@pytest.mark.parametrize(
    ("actor", "feeds", "expected"),
    [
        # Size is told at the end of each firing, also when nothing changes; a token may pass at once.
        ("Queue", [("input", [[0, "a"], [2, "b"]]), ("trigger", [[1, 0], [2, 0], [3, 0]])],
         [(0, 1, "size", 1), (1, 1, "output", "a"), (1, 1, "size", 0), (2, 1, "output", "b"), (2, 1, "size", 0),
          (3, 1, "size", 0)]),
        # A full one loses what comes.
        ("Queue, capacity: 1", [("input", [[0, "a"], [1, "b"]])],
         [(0, 1, "size", 1), (1, 1, "rejected", "b"), (1, 1, "size", 1)]),
        # What comes with a trigger to a full one counts in the size told, but is lost.
        ("Queue, capacity: 1", [("input", [[0, "a"], [1, "b"]]), ("trigger", [[1, 0], [2, 0]])],
         [(0, 1, "size", 1), (1, 1, "output", "a"), (1, 1, "rejected", "b"), (1, 1, "size", 1), (2, 1, "size", 0)]),
        # One trigger waits at most.
        ("Queue, persistent_trigger: true", [("trigger", [[0, 0], [1, 0]]), ("input", [[2, "a"], [3, "b"]])],
         [(0, 1, "size", 0), (1, 1, "size", 0), (2, 1, "output", "a"), (2, 1, "size", 0), (3, 1, "size", 1)]),
        # Nothing is connected to the trigger; tokens of one tag come in firing by firing.
        ("Queue", [("input", [[0, "a"], [0, "b"]])], [(0, 1, "size", 1), (0, 1, "size", 2)]),
        # Only the first channel of its trigger lets it fire; what comes on another counts when it does.
        ("Queue", [("input", [[0, "a"], [2, "b"]]), ("trigger", [[3, 0]]), ("trigger", [[1, 0], [3, 0]])],
         [(0, 1, "size", 1), (2, 1, "output", "a"), (2, 1, "size", 1), (3, 1, "output", "b"), (3, 1, "size", 0)]),
        # Only what is true resets it, and that counts behind what is counted with it.
        ("Counter", [("increment", [[0, 0], [1, 0], [2, 0], [2, 0], [3, 0]]),
                     ("reset", [[1, True], [2, False], [4, False], [5, True]])],
         [(0, 1, "output", 1), (1, 1, "output", 0), (2, 1, "output", 1), (2, 1, "output", 2), (3, 1, "output", 3),
          (5, 1, "output", 0)]),
        ("Counter", [("decrement", [[0, 0], [0, 0]]), ("reset", [[0, True]])],
         [(0, 1, "output", 0), (0, 1, "output", -1)]),
        ("Counter, reset_by: any", [("increment", [[0, 0]]), ("reset", [[1, 5]])],
         [(0, 1, "output", 1), (1, 1, "output", 0)]),
        # Each trigger lets a tick come, and the first at its end is the last.
        ("PoissonClock, mean_interval: 1000 s, stop_time: 3 s", [("trigger", [[1, 0], [1, 0], [4, 0], [4, 0], [5, 0]])],
         [(0, 1, "output", 0), (1, 1, "output", 1), (1, 1, "output", 2), (4, 1, "output", 3)]),
        ("PoissonClock, mean_interval: 1000 s, stop_time: 0 s", [("trigger", [[1, 0]])], [(0, 1, "output", 0)]),
        ("Server", [("input", [[0, "a"], [0.5, "b"]])],
         [(0, 1, "size", 1), (0.5, 1, "size", 2), (1, 1, "output", "a"), (1, 1, "size", 1), (2, 1, "output", "b"),
          (2, 1, "size", 0)]),
        ("Server, capacity: 1", [("input", [[0, "a"], [0.5, "b"]])],
         [(0, 1, "size", 1), (0.5, 1, "rejected", "b"), (0.5, 1, "size", 1), (1, 1, "output", "a"), (1, 1, "size", 0)]),
        # The service time is settled on arrival; no time at all is a microstep.
        ("Server", [("service_time", [[0, 3], [1, 0]]), ("input", [[0, "a"], [1, "b"]])],
         [(0, 1, "size", 1), (1, 1, "size", 2), (3, 1, "output", "a"), (3, 1, "size", 1), (3, 2, "output", "b"),
          (3, 2, "size", 0)]),
        # Values of one time leave in successive microsteps.
        ("Timer", [("input", [[0, 2], [1, 1], [3, 0]])],
         [(2, 1, "output", True), (2, 2, "output", True), (3, 2, "output", True)]),
        ("Merge", [("input", [[0, "a"], [0, "b"]]), ("input", [[0, "c"], [0, "d"]])],
         [(0, 1, "output", "a"), (0, 1, "output", "b"), (0, 2, "output", "c"), (0, 2, "output", "d")]),
        ("Merge, discard: true", [("input", [[0, "a"], [0, "b"]]), ("input", [[0, "c"], [1, "d"]])],
         [(0, 1, "output", "a"), (0, 1, "output", "b"), (1, 1, "output", "d")]),
        # Tokens wait for those that they go with.
        ("Comparator, comparison: <", [("left", [[0, 1], [1, 2], [2, 3]]), ("right", [[2, 2], [3, 2]])],
         [(2, 1, "output", True), (3, 1, "output", False)]),
        ("Comparator, comparison: '==', value: 2", [("left", [[0, 1], [0, 2]])],
         [(0, 1, "output", False), (0, 1, "output", True)]),
        ("Expression, expression: a - b", [("a", [[0, 5], [0, 6]]), ("b", [[1, 1], [2, 2], [2, 3]])],
         [(1, 1, "output", 4), (2, 1, "output", 4)]),
        ("Expression, expression: a + iteration, iteration: true", [("a", [[0, 10], [0, 20], [1, 30]])],
         [(0, 1, "output", 11), (0, 1, "output", 22), (1, 1, "output", 33)]),
        ("Counter", [("increment", [[0, 0], [0, 0], [1, 0]]), ("increment", [[0, 0]]), ("decrement", [[1, 0], [1, 0]])],
         [(0, 1, "output", 2), (0, 1, "output", 3), (1, 1, "output", 3), (1, 1, "output", 2)]),
        ("Expression, expression: 'a[1:]'", [("a", [[0, [1, 2, 3]]])], [(0, 1, "output", [2, 3])]),
        # What is not chosen waits; a number of no channel chooses none.
        ("Select", [("input", [[0, "a"], [3, "b"]]), ("input", [[0, "x"], [1, "y"]]), ("control",
         [[1, 1], [2, 7], [4, 0]])],
         [(0, 1, "output", "a"), (1, 1, "output", "x"), (1, 1, "output", "y"), (4, 1, "output", "b")]),
        ("Select, unread: lost", [("input", [[0, "a"], [2, "b"]]), ("input", [[0, "x"]]), ("control",
         [[1, 1], [2, 0]])],
         [(0, 1, "output", "a"), (2, 1, "output", "b")]),
        ("LookupTable, values: [a, b]", [("input", [[0, 1], [1, 2], [2, -1], [3, 0]])],
         [(0, 1, "output", "b"), (3, 1, "output", "a")]),
        # A key is known by its text; it is written before it is read, and forgotten without a value.
        ("Dictionary", [("write_key", [[0, 1], [2, "1"]]), ("value", [[0, "a"]]), ("read_key", [[0, "1"], [2, 1]]),
                        ("trigger_keys", [[1, 0], [2, 0]])],
         [(0, 1, "result", "a"), (1, 1, "keys", ["1"]), (2, 1, "result", None), (2, 1, "not_found", ["1"]),
          (2, 1, "keys", [])]),
        ("Dictionary", [("write_key", [[0, "a"]]), ("value", [[0, 7]]), ("read_key_array", [[0, ["a", "b"]]])],
         [(0, 1, "result_array", [7, None]), (0, 1, "not_found", ["b"])]),
    ],
)  # fmt: skip
def test_one_at_a_time(actor: str, feeds: Feeds, expected: list[Any]) -> None:
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
        # A start gives back the period of the model, unless one comes with it.
        ("period: 1 s", [("start", [[0, 0], [3.5, 0], [5, 0]]), ("period", [[1, 2], [5, 3]])],
         [(0, 1, 0), (1, 1, 1), (3, 1, 2), (3.5, 1, 0), (4.5, 1, 1), (5, 1, 0)]),
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


@pytest.mark.parametrize(
    ("actor", "feeds", "expected"),
    [
        ("Ramp, init: 3, step: 2", [("trigger", [[0, 0], [1, 0]])], [3, 5]),
        ("Ramp, limit: 2", [("trigger", [[0, 0], [0, 0], [1, 0]])], [0, 1]),
        # Triggers that come together, one on each channel, are one.
        ("Ramp", [("trigger", [[0, 0], [1, 0]]), ("trigger", [[1, 0], [2, 0], [2, 0]])], [0, 1, 2, 3]),
        ("AddSubtract", [("plus", [[0, "a"]]), ("plus", [[0, 2.5]]), ("plus", [[0, True]])], ["a2.5true"]),
        ("AddSubtract", [("plus", [[0, [1, 2]], [1, {"x": 1, "y": 2}]]), ("plus", [[0, 1], [1, {"y": 3}]]),
                         ("minus", [[0, [1, 1]]])], [[1, 2], {"y": 5}]),
        ("Scale, factor: 2", [("input", [[0, [1, 2.5]], [1, 3]])], [[2, 5.0], 6]),
        ("Scale, factor: 2, offset: 1", [("input", [[0, [1, 2]]])], [[3, 5]]),
        # A new step counts behind the number that comes next.
        ("Ramp", [("trigger", [[n, 0] for n in range(4)]), ("step", [[0.5, 10], [2, 100]])], [0, 1, 11, 111]),
        ("MultiplyDivide", [("multiply", [[0, 7], [1, -7], [2, 7.0]]), ("divide", [[n, 2] for n in range(3)])], [3,
         -3, 3.5]),
        ("Accumulator", [("input", [[0, 1], [1, 2], [2, 4]]), ("reset", [[1, False], [2, True], [3, False]])], [1,
         3, 4, 4]),
        ("Default", [("preferred", [[0, 1], [2, 3]]), ("alternate", [[0, 7], [1, 8]])], [1, 7, 8, 3]),
        # An index that comes keeps, and sends nothing.
        ("HoldingExpression, expression: 'input[index]', held: {index: 0}", [("input", [[0, [1, 2]], [2, [3, 4]], [3,
         [5, 6]]]), ("index", [[1, 1], [3, 0]])], [1, 4, 5]),
        ("HoldingExpression, expression: a + b, held: {a: x, b: ''}", [("b", [[0, "y"], [1, "z"]])], ["xy", "xz"]),
    ],
)  # fmt: skip
def test_tokens(actor: str, feeds: Feeds, expected: list[Any]) -> None:
    told = [token for *_, token in there(actor, feeds)]
    assert told == expected
    assert [type(token) for token in told] == [type(token) for token in expected]


@pytest.mark.parametrize(
    ("actor", "feeds", "outputs", "expected"),
    [
        ("Extreme, take: greatest", [("input", [[0, 1], [1, 5]]), ("input", [[1, 5], [2, 2.5]])], 0,
         [(0, 1, "value", 1), (0, 1, "channel", 0), (1, 1, "value", 5), (1, 1, "channel", 0), (2, 1, "value", 2.5),
          (2, 1, "channel", 1)]),
        ("Extreme, take: least", [("input", [[0, 1]]), ("input", [[0, -1]])], 0,
         [(0, 1, "value", -1), (0, 1, "channel", 1)]),
        ("Switch", [("input", [[0, "a"], [1, "b"], [2, "c"]]), ("control", [[1, 5], [2, 1]])], 2,
         [(0, 1, "output/0", "a"), (2, 1, "output/1", "c")]),
    ],
)  # fmt: skip
def test_channels(actor: str, feeds: Feeds, outputs: int, expected: list[Any]) -> None:
    assert there(actor, feeds, outputs=outputs) == expected


@pytest.mark.parametrize(
    ("test", "feeds", "message"),
    [
        ("values: [1, 2]", [("input", [[0, 1], [1, 2], [2, 3]])], ""),
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
        ("AddSubtract", [("plus", [[0, [1]]]), ("plus", [[0, [1, 2]]])], "[1] has 1 item, but [1, 2] has 2"),
        ("AddSubtract", [("plus", [[0, 1]]), ("minus", [[0, "a"]])], "1 and 'a' cannot be combined"),
        ("Scale, factor: 2", [("input", [[0, "a"]])], "'a' and 2 cannot be combined"),
        ("Ramp", [("trigger", [[0, 0], [1, 0], [2, 0]]), ("step", [[0, 0.5]])],
         ("init and step are whole numbers, but a step of 0.5 came; write 'init: 0.0' to allow fractions")),
    ],
)  # fmt: skip
def test_messages(actor: str, feeds: Feeds, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        there(actor, feeds)
    assert caught.value.reason == message


def test_the_last_tick_of_a_poisson_clock_comes_behind_its_end() -> None:
    """So it does in Ptolemy, where the clock is done when it has fired; here none comes behind it."""
    clock = "PoissonClock, mean_interval: 20 ms, stop_time: 1 s"
    all_of_them = there("PoissonClock, mean_interval: 20 ms", [], until=1.5)
    last = next(number for number, each in enumerate(all_of_them) if each[0] > 1)
    assert last > 20
    assert there(clock, [], until=1.5) == all_of_them[: last + 1]
    assert there(clock, [], until=1.5, director="like: epicycle") == all_of_them[:last]
    triggers: Feeds = [("trigger", [[1.2, 0], [1.4, 0]])]
    assert behave(f"{{type: {clock}}}", triggers, until=1.5) == behave(f"{{type: {clock}}}", [], until=1.5)


EVERY = [
    (actor.partition(",")[0], number, actor, feeds)
    for test in (test_one_at_a_time, test_tokens, test_channels)
    for number, (actor, feeds, *_) in enumerate(test.pytestmark[0].args[1])
]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "number", "actor", "feeds"), EVERY)
def test_snapshots_and_crashes(kind: str, number: int, actor: str, feeds: Feeds) -> None:
    """A run that goes on from a snapshot is the whole one; after a crash that costs the state the actor begins anew."""
    outputs = (
        2 if kind in ("Spread", "Switch", "IsPresent", "SharedQueue") or (len(feeds) == 3 and kind == "Inhibit") else 0
    )
    model = f"model: m\ndirector: {{like: ptolemy}}\n{text(f'{{type: {actor}}}', feeds, outputs)}\n"
    whole = Simulation(load(model, [Probe]), keep_log=True).run(until=20).digest
    cut = Simulation(load(model, [Probe]), keep_log=True)
    cut.advance(1.0)
    assert cut.fork().run(until=20).digest == whole
    crash = "aspects: {crash: {type: CrashRestart, at: it, times: [1.25 s], repair: 0.125 s}}"
    results = Simulation(load(model + crash, [Probe]), keep_log=True).run(until=20)
    assert [record.event for record in results.log.records if record.aspect == "crash"][:2] == ["crashed", "restarted"]


@pytest.mark.parametrize(
    ("token", "value", "is_alike"),
    [
        (1, "1", True),
        ("1", 1, True),
        (1, "1.0", False),
        (1.0, "1.0", True),
        (1.0, "1", False),
        (1e10, "1.0E10", True),
        (True, "true", True),
        ("True", True, False),
        (True, 1, False),
        ([1, True], ["1", "true"], True),
        ("x", 1.5, False),
        ([1], "1", False),
        (math.inf, -math.inf, False),
        (5.0, math.inf, False),
        (10**400, 1.5, False),
        (0.8, 0.7, False),
        (0.3, 0.2, True),
        ({"a": [7]}, {"a": [None]}, True),
        ({"a": 7}, {"b": 7}, False),
        (math.nan, 5.0, True),
        (5.0, math.nan, True),
        (math.nan, "5.0", False),
    ],
)
def test_test_compares_as_ptolemy_does(token: Any, value: Any, is_alike: bool) -> None:
    assert Checks("it", values=[value], tolerance=0.1).matches(token, value) is is_alike
