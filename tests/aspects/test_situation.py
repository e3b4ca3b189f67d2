"""Disturbances that depend on where bodies are and who they are: geometry against oracles, laws at 99.9 %."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy import stats

from epicycle.aspects import Occlusion, Outage, OutOfRange, RangeLoss, SituationError
from epicycle.runner import ModelError
from epicycle.runner.execution.engine import Results
from tests.aspects.bench import Bench
from tests.engine.engine_parts import load, simulate

SURE = 0.999
COUNT = 20_000


@dataclass
class Message:
    """What a robot says."""

    robot: str
    value: int = 0


def lost(aspect: Any, world: dict[str, Any], count: int = COUNT) -> int:
    return count - len(Bench(aspect, world=world).play([Message("b")] * count).tokens)


# -- distance ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("correlation", [None, 20.0])
@pytest.mark.parametrize(
    ("distance", "exponent", "shadowing"), [(10, 3, 4), (7, 3, 4), (16, 3, 4), (12, 2, 8), (10.01, 3, 0), (9.99, 3, 0)]
)
def test_range_loss_is_the_curve_of_its_formula(
    distance: float, exponent: float, shadowing: float, correlation: float | None
) -> None:
    aspect = RangeLoss(
        positions=["a.at", "b.at"],
        sender="token.robot",
        range=10,
        exponent=exponent,
        shadowing=shadowing,
        correlation=correlation,
    )
    world = {"a.at": [1.0, 1.0], "b.at": [1.0, 1.0 + distance]}
    margin = 10 * exponent * math.log10(10 / distance)
    expected = float(stats.norm.cdf(-margin / shadowing)) if shadowing else float(margin < 0)
    low, high = stats.binom.interval(SURE, COUNT, expected)
    if correlation is None:
        assert low <= lost(aspect, world) <= high
    else:  # nobody moves: a link is what it was at first, and that has the same law
        runs = 1500
        found = [Bench(aspect, seed, world).play([Message("b")] * 3) for seed in range(runs)]
        counts = [3 - len(bench.tokens) for bench in found]
        assert set(counts) <= {0, 3}
        low, high = stats.binom.interval(SURE, runs, expected)
        assert low <= sum(counts) / 3 <= high


def test_shadowing_changes_with_the_way_that_was_moved() -> None:
    """Both of two messages are lost with probability 1/4 + asin(rho) / (2 pi), at the distance where half are lost."""
    aspect = RangeLoss(positions=["a.at", "b.at"], sender="token.robot", range=5, correlation=8)
    both, runs = 0, 4000
    for seed in range(runs):
        world = {"a.at": [0.0, 0.0], "b.at": [3.0, 4.0]}
        bench = Bench(aspect, seed, world).play([Message("b")])
        world |= {"a.at": [1.0, 0.0], "b.at": [1.0, 5.0]}  # moved by 1 m and by sqrt(5) m
        both += not bench.play([Message("b")]).tokens
    rho = math.exp(-(1 + math.sqrt(5)) / 8)
    low, high = stats.binom.interval(SURE, runs, 0.25 + math.asin(rho) / (2 * math.pi))
    assert low <= both <= high


def test_every_link_has_its_own_shadowing() -> None:
    aspect = RangeLoss(positions=["a.at", "b.at", "c.at"], sender="token.robot", range=5, correlation=8)
    world = {"a.at": [0.0, 0.0], "b.at": [5.0, 0.0], "c.at": [0.0, 5.0]}
    pairs = [
        tuple(token.robot for token in Bench(aspect, seed, world).play([Message("b"), Message("c")]).tokens)
        for seed in range(400)
    ]
    for each in ((), ("b",), ("c",), ("b", "c")):  # independent: a quarter of each
        low, high = stats.binom.interval(SURE, 400, 0.25)
        assert low <= pairs.count(each) <= high


def test_the_draws_are_the_same_whatever_the_distance() -> None:
    aspect = RangeLoss(positions=["a.at", "b.at"], sender="token.robot", range=10)
    tokens = [Message("b", number) for number in range(300)]
    kept = []
    for distance in (8.0, 12.0):
        passed = Bench(aspect, world={"a.at": [0.0], "b.at": [distance]}).play(tokens).tokens
        kept.append({token.value for token in passed})
    assert kept[1] < kept[0] < set(range(300))


def test_out_of_range() -> None:
    aspect = OutOfRange(positions="a.at", target="t.at", range=5)
    assert lost(aspect, {"a.at": [0.0, 0.0], "t.at": {"position": [3.0, 4.0]}}, 1) == 0
    assert lost(aspect, {"a.at": [0.0, 0.0], "t.at": {"position": [3.0, 4.001]}}, 1) == 1
    random = np.random.default_rng(5)
    radius, angle = 8 * np.sqrt(random.random(4000)), random.uniform(0, 2 * math.pi, 4000)
    targets = [list(place) for place in zip(radius * np.cos(angle), radius * np.sin(angle), strict=True)]
    failed = sum(lost(aspect, {"a.at": [0.0, 0.0], "t.at": target}, 1) for target in targets)
    low, high = stats.binom.interval(SURE, 4000, 1 - (5 / 8) ** 2)
    assert low <= failed <= high


# -- line of sight ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("blocker", "target", "occluded"),
    [
        ([5, 0.99], [10, 0], True),
        ([5, 1.01], [10, 0], False),
        ([-0.5, 0], [10, 0], True),  # it stands on top of the sensor
        ([-1.01, 0], [10, 0], False),  # it stands behind it
        ([10.9, 0], [10, 0], True),
        ([11.1, 0], [10, 0], False),
        ([3, 4], [0, 0], False),  # there is no way between the two
        ([0.5, 0.5], [0, 0], True),
        ([5, 5, 0.9], [10, 10, 0], True),  # in space
        ([5, 5, 1.1], [10, 10, 0], False),
    ],
)
def test_occlusion(blocker: list[float], target: list[float], occluded: bool) -> None:
    aspect = Occlusion(positions=["a.at", "b.at", "t.at"], target="t.at", radius=1)
    bench = Bench(aspect, world={"a.at": [0.0] * len(target), "b.at": blocker, "t.at": target}).play(["seen"])
    assert bench.tokens == ([] if occluded else ["seen"])
    assert bench.told == ([("occluded", "seen")] if occluded else [])


def test_a_body_at_random_occludes_as_often_as_its_stadium_is_large() -> None:
    aspect = Occlusion(positions=["a.at", "b.at"], target="t.at", radius=1.5)
    random = np.random.default_rng(8)
    places = random.uniform([-5, -5], [15, 5], (6000, 2)).tolist()
    world = {"a.at": [1.0, 1.0], "t.at": [9.0, -2.0]}
    occluded = sum(lost(aspect, world | {"b.at": place}, 1) for place in places)
    area = 2 * 1.5 * math.hypot(8, 3) + math.pi * 1.5**2
    low, high = stats.binom.interval(SURE, 6000, area / 200)
    assert low <= occluded <= high


# -- partition --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("groups", "sender", "passes"),
    [
        ({"one": "a", "two": ["b", "c"]}, "b", False),
        ({"one": "a", "two": ["b", "c"]}, "d", True),
        ({"one": ["a", "b"], "two": "c"}, "b", True),
        ({"one": ["a", "b"], "two": ["b", "c"]}, "b", True),
        ({"one": "a", "two": "c"}, "c.radio.antenna", False),
        ({"one": "a", "two": "c.radio"}, "c", True),
        ({"two": ["b", "c"]}, "b", True),
        ({"one": "a"}, "a", True),
    ],
)
def test_outage(groups: dict[str, Any], sender: str, passes: bool) -> None:
    token = Message(sender)
    bench = Bench(Outage(groups=groups, sender="token.robot")).play([token])
    assert bench.tokens == ([token] if passes else [])
    assert bench.told == ([] if passes else [("dropped", token)])


# -- who is where -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("positions", "sender", "message"),
    [
        (["a.at", "c.at"], "b", "b: no port sends its position; 'positions' selects a.at, c.at"),
        (["b.at"], "b", "a: no port sends its position; 'positions' selects b.at"),
        (["a.at", "b.x.at", "b.y.at"], "b", "b: several ports could send its position: b.x.at, b.y.at"),
        (["a.at", "b.at"], "", "sender: token.robot gives '', expected the path of the sender"),
        (
            ["a.at", "w.at"],
            "w",
            "w.at does not send a position: expected numbers, or a token with such a field 'position'",
        ),
    ],
)
def test_nobody_knows_where(positions: list[str], sender: str, message: str) -> None:
    aspect = RangeLoss(positions=positions, sender="token.robot", range=3)
    with pytest.raises(SituationError) as caught:
        Bench(aspect, world={"a.at": [0.0], "b.at": [1.0], "w.at": {"place": [1.0]}}).play([Message(sender)])
    assert str(caught.value) == message


@pytest.mark.parametrize(
    "aspect",
    [
        RangeLoss(positions=["a.at", "b.at"], sender="token.robot", range=3),
        OutOfRange(positions=["a.at"], target="b.at", range=3),
        Occlusion(positions=["a.at", "c.at", "b.at"], target="c.at", radius=3),
    ],
)
def test_positions_in_the_plane_and_in_space(aspect: Any) -> None:
    with pytest.raises(SituationError) as caught:
        Bench(aspect, world={"a.at": [0.0, 1.0], "b.at": [1.0, 1.0, 2.0], "c.at": [1.0, 1.0]}).play([Message("b")])
    assert str(caught.value) in (
        "b.at sends positions of 3 numbers, but a.at of 2: they cannot be compared",
        "a.at sends positions of 2 numbers, but b.at of 3: they cannot be compared",
    )


def test_messages_pass_until_all_have_said_where_they_are() -> None:
    aspect = RangeLoss(positions=["a.at", "b.at"], sender="token.robot", range=1, shadowing=0)
    assert lost(aspect, {"a.at": [0.0]}, 1) == 0
    assert lost(aspect, {"a.at": [0.0], "b.at": [2.0]}, 1) == 1


MODEL = """
composites:
  Robot:
    parameters: {{at: {{unit: m}}}}
    inputs: [go, hear]
    outputs: [place, said]
    actors:
      body: {{type: Expression, expression: "${{at}} + 0 * go"}}
      mouth: {{type: Scale}}
      ear: {{type: Join}}
    connections: [go -> body.go, go -> mouth.input, hear -> ear.input, body.output -> place, mouth.output -> said]
actors:
  t: {{type: Ticker, period: 1 ms}}
  robot: {{type: Robot, count: 3, at: "${{10 * index}}"}}
connections:
  - t.output -> robot[*].go
  - robot[*].said => robot[*].hear
aspects:
  {}
run: {{stop: 3 ms}}
"""


def heard(aspect: str) -> dict[str, int]:
    results: Results = simulate(MODEL.format(aspect))[1]
    found: dict[str, int] = {}
    for record in results.log.records:
        if record.event == "send" and record.port == "output" and record.actor.endswith(".ear"):
            found[record.actor] = found.get(record.actor, 0) + sum(map(len, record.value))
    return found


def problem(aspect: str) -> str:
    with pytest.raises(ModelError) as caught:
        load(MODEL.format(aspect))
    (line,) = [line for line in str(caught.value).splitlines() if "error:" in line]
    return line.partition("error: ")[2]


@pytest.mark.parametrize(
    ("aspect", "expected"),
    [
        # Until all have said where they are, at 0 s, messages pass: robot[0] speaks before the others have moved.
        (
            "r: {type: RangeLoss, positions: 'robot[*].place', range: 15, shadowing: 0, at: 'robot[*].hear'}",
            (4, 8, 5),
        ),
        (
            "r: {type: RangeLoss, positions: 'robot[*].place', range: 15, shadowing: 0, at: 'robot[0].hear'}",
            (4, 8, 8),
        ),
        ("cut: {type: Outage, groups: {a: 'robot[0]', b: ['robot[1]', 'robot[2]']}, at: 'robot[*].hear'}", (0, 4, 4)),
        ("cut: {type: Outage, until: 2 ms, groups: {a: 'robot[0]', b: 'robot[1]'}, at: 'robot[*].hear'}", (6, 6, 8)),
    ],
)
def test_in_a_model(aspect: str, expected: tuple[int, ...]) -> None:
    assert tuple(heard(aspect).get(f"robot[{index}].ear", 0) for index in range(3)) == expected


@pytest.mark.parametrize(
    ("aspect", "message"),
    [
        (
            "loss: {type: RangeLoss, positions: 'robot[*].plac', range: 3, at: '*.hear'}",
            "aspect loss: positions: 'robot[*].plac' matches no output port, did you mean 'robot[*].place'?",
        ),
        (
            "loss: {type: RangeLoss, positions: 'robot[*].go', range: 3, at: '*.hear'}",
            "aspect loss: positions: robot[0].go is an input port, but an output port is needed",
        ),
        (
            "loss: {type: RangeLoss, positions: 'robot[*].place', range: 0 m, at: '*.hear'}",
            "aspect loss.range: 0 is out of bounds, expected a number in m > 0",
        ),
        (
            "loss: {type: RangeLoss, positions: 'robot[*].place', range: 3, sender: sender, at: '*.hear'}",
            (
                "aspect loss.sender: 'sender' is not an expression over ports: unknown name 'sender': a port is "
                "written 'actor.port', and 'token' is known"
            ),
        ),
        (
            "view: {type: OutOfRange, positions: 'robot[*].place', target: 'robot[*].place', range: 3, at: '*.said'}",
            "aspect view: target: 'robot[*].place' selects robot[0].place and robot[1].place, but must select one",
        ),
        (
            "view: {type: Occlusion, positions: 'robot[*].place', target: 'robot[*].place', radius: 1, at: '*.said'}",
            "aspect view: target: 'robot[*].place' selects robot[0].place and robot[1].place, but must select one",
        ),
        (
            "view: {type: Occlusion, positions: 'robot[*].place', target: t.output, radius: -1, at: '*.said'}",
            "aspect view.radius: -1 is out of bounds, expected a number in m >= 0",
        ),
        (
            "view: {type: OutOfRange, positions: 'robot[*].place', target: t.output, range: 3, at: '*.hear'}",
            "aspect view: OutOfRange attaches to output ports, but robot[0].hear is an input port",
        ),
        (
            "cut: {type: Outage, groups: {a: 'robt[0]'}, at: '*.hear'}",
            "aspect cut: groups: 'robt[0]' matches no actor, did you mean 'robot[0]'?",
        ),
        (
            "cut: {type: Outage, groups: [a, b], at: '*.hear'}",
            "aspect cut.groups: ['a', 'b'] is not a mapping from names to lists of patterns",
        ),
        (
            "cut: {type: Outage, groups: {a: 3}, at: '*.hear'}",
            "aspect cut.groups: group 'a': 3 is not a list of patterns",
        ),
        ("cut: {type: Outage, at: '*.hear'}", "aspect cut: Outage needs a value for 'groups'"),
    ],
)
def test_mistakes(aspect: str, message: str) -> None:
    assert problem(aspect) == message


def test_a_pattern_may_select_what_there_is_none_of() -> None:
    text = MODEL.replace("count: 3", "count: 0").replace("  - robot[*].said => robot[*].hear", "")
    model = load(text.format("loss: {type: RangeLoss, positions: 'robot[*].place', range: 3, at: 'robot[*].hear'}"))
    assert [(each.name, each.ports) for each in model.aspects] == [("loss", [])]
