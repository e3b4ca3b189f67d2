"""Actors that hand tokens on."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.runner.execution.engine import ActorError
from tests.actors.library_parts import Feeds, behave, problem, tokens


@pytest.mark.parametrize(
    ("actor", "feeds", "outputs", "expected"),
    [
        # Merge: the lowest channel first, one token a microstep; what comes later in the instant is not pushed back.
        ("Merge", [("input", [[0, 1], [0, 2]]), ("input", [[0, 3], [1, 4]])], 0,
         [(0, 1, "output", 1), (0, 2, "output", 2), (0, 3, "output", 3), (1, 1, "output", 4)]),
        ("Merge, discard: true", [("input", [[1, 1], [1, 2]]), ("input", [[0, 5], [1, 3]])], 0,
         [(0, 1, "output", 5), (1, 1, "output", 1)]),
        ("Router", [("input", [[0, 1], [0, 2], [1, 3], [2, 4]])], 3,
         [(0, 1, "output/0", 1), (0, 1, "output/1", 2), (1, 1, "output/2", 3), (2, 1, "output/0", 4)]),
        ("Router", [("input", [[0, 1]])], 0, []),
        ("Router, policy: expression, channel: kind", [("input", [[0, {"kind": 1}], [1, {"kind": 0}]])], 2,
         [(0, 1, "output/1", {"kind": 1}), (1, 1, "output/0", {"kind": 0})]),
        # What a channel is told to have counts until it tells anew, and so does what is sent there.
        ("Router, policy: shortest queue",
         [("load", [[0, 2]]), ("load", [[0, 3]]), ("load", [[0, 4], [2, 0]]), ("input", [[1, 1], [2, 2], [2, 3]])], 3,
         [(1, 1, "output/0", 1), (2, 1, "output/2", 2), (2, 1, "output/2", 3)]),
        ("Switch", [("input", [[0, 1], [1, 2], [1, 3], [2, 4]]), ("control", [[1, 1], [2, 0]])], 2,
         [(0, 1, "output/0", 1), (1, 1, "output/1", 2), (1, 1, "output/1", 3), (2, 1, "output/0", 4)]),
        ("Switch", [("input", [[0, 1]]), ("control", [])], 0, [(0, 1, "output", 1)]),
        ("BooleanSwitch", [("input", [[0, 1], [1, 2], [2, 3]]), ("control", [[1, True]])], 0,
         [(0, 1, "false_output", 1), (1, 1, "true_output", 2), (2, 1, "true_output", 3)]),
        ("Select", [("input", [[0, 1], [1, 2]]), ("input", [[0, 3], [1, 4], [1, 5]]), ("control", [[1, 1]])], 0,
         [(0, 1, "output", 1), (1, 1, "output", 4), (1, 1, "output", 5)]),
        ("Repeat", [("input", [[0, 1], [1, 2]]), ("times", [[1, 3]])], 0,
         [(0, 1, "output", 1)] * 2 + [(1, 1, "output", 2)] * 3),
        ("Repeat, times: 0", [("input", [[0, 1]])], 0, []),
        ("Sampler", [("input", [[0, 1], [1, 2], [1, 3]]), ("trigger", [[1, 0], [2, 0]])], 2,
         [(1, 1, "output", 2), (1, 1, "output", 3)]),
        ("Sampler", [("input", [[0, 1]]), ("input", [[0, 2]]), ("trigger", [[0, 0]])], 2,
         [(0, 1, "output/0", 1), (0, 1, "output/1", 2)]),
        ("MostRecent", [("input", [[1, 1], [2, 2]]), ("trigger", [[0, 0], [1.5, 0], [2, 0], [3, 0]])], 1,
         [(1.5, 1, "output", 1), (2, 1, "output", 2), (3, 1, "output", 2)]),
        ("MostRecent, initial: 7", [("input", [[1, 1]]), ("input", []), ("trigger", [[0, 0], [1, 0]])], 2,
         [(0, 1, "output/0", 7), (0, 1, "output/1", 7), (1, 1, "output/0", 1), (1, 1, "output/1", 7)]),
        ("Synchronizer", [("input", [[0, 1], [1, 2], [1, 3]]), ("input", [[2, 4], [3, 5], [3, 6], [3, 7]])], 2,
         [(2, 1, "output/0", 1), (2, 1, "output/1", 4), (3, 1, "output/0", 2), (3, 1, "output/1", 5),
          (3, 1, "output/0", 3), (3, 1, "output/1", 6)]),
        ("Synchronizer", [("input", [[0, 1], [0, 2]])], 2, [(0, 1, "output", 1), (0, 1, "output", 2)]),
    ],
)  # fmt: skip
def test_flow(actor: str, feeds: Feeds, outputs: int, expected: list[Any]) -> None:
    assert behave(f"{{type: {actor}}}", feeds, outputs=outputs) == expected


def test_a_random_router_uses_every_channel_alike() -> None:
    sends = behave("{type: Router, policy: random}", [("input", [[0, 0]] * 3000)], outputs=3)
    counts = [len(tokens(sends, f"output/{channel}")) for channel in range(3)]
    # Binomial with mean 1000 and standard deviation 26.
    assert sum(counts) == 3000
    assert all(abs(count - 1000) < 110 for count in counts)


def test_a_router_goes_by_weights() -> None:
    router = "{type: Router, policy: random, weights: [3, 0, 1]}"
    sends = behave(router, [("input", [[0, 0]] * 3000)], outputs=3)
    counts = [len(tokens(sends, f"output/{channel}")) for channel in range(3)]
    assert counts[1] == 0
    assert abs(counts[0] - 2250) < 100  # binomial with standard deviation 24


def test_among_the_shortest_queues_one_is_drawn() -> None:
    feeds: Feeds = [("load", [[time, 0] for time in range(99)])] * 2 + [("input", [[time, 0] for time in range(99)])]
    sends = behave("{type: Router, policy: shortest queue}", feeds, outputs=2)
    assert 30 < len(tokens(sends, "output/0")) < 70


@pytest.mark.parametrize(
    ("router", "message"),
    [
        ("weights: [1, 2]", "weights: it is for the policy 'random', but the policy is 'round robin'"),
        ("policy: random, channel: token", "channel: it is for the policy 'expression', but the policy is 'random'"),
        ("policy: expression", "policy: 'expression' needs 'channel', an expression for the channel of a token"),
        ("policy: random, weights: [0]", "weights [0.0]: expected numbers >= 0 with a finite sum > 0"),
    ],
)
def test_wrong_routers(router: str, message: str) -> None:
    assert problem(f"{{type: Router, {router}}}", [("input", [])]) == f"it: {message}"


@pytest.mark.parametrize(
    ("router", "message"),
    [
        ("policy: shortest queue",
         "it.output has 2 channels and it.load has 0; 'shortest queue' needs one load for each channel"),
        ("policy: random, weights: [1, 2, 3]", "it.output has 2 channels, but there are 3 weights; give one for each"),
        ("policy: expression, channel: token + channels",
         "'token + channels' gives 3 for 1, but it.output has 2 channels, counted from 0"),
    ],
)  # fmt: skip
def test_routers_at_work(router: str, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        behave(f"{{type: Router, {router}}}", [("input", [[0, 1]])], outputs=2)
    assert caught.value.reason == message


ALIKE = "give both the same number of channels, because each channel of the input leads to one of the output"


@pytest.mark.parametrize(
    ("actor", "feeds", "message"),
    [
        ("Switch", [("input", [[0, 1]]), ("control", [[0, 2]])],
         "it.control is 2, but output has 2 channels, counted from 0"),
        ("Select", [("input", [[0, 1]]), ("control", [[0, -1]])],
         "it.control is -1, but input has 1 channel, counted from 0"),
        ("Select, initial: 1", [("input", [[0, 1]]), ("control", [])],
         "it.initial is 1, but input has 1 channel, counted from 0"),
        ("Synchronizer", [("input", []), ("input", []), ("input", [])],
         f"it.input has 3 channels and it.output has 2; {ALIKE}"),
        ("Repeat", [("input", [[0, 1]]), ("times", [[0, -1]])],
         "it.times: -1 is out of bounds, expected an integer >= 0"),
    ],
)  # fmt: skip
def test_wrong_channels(actor: str, feeds: Feeds, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        behave(f"{{type: {actor}}}", feeds, outputs=2)
    assert caught.value.reason == message


def test_a_policy_by_its_former_name() -> None:
    actor = "{type: Router, policy: in turn}"
    assert problem(actor, [("input", [])]) == "it.policy: 'in turn' is now called 'round robin'"
