"""Links, switches, and both ends of ARQ."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.runner.execution.engine import ActorError
from tests.actors.library_parts import Feeds, behave
from tests.engine.engine_parts import simulate


@pytest.mark.parametrize(
    ("actor", "feeds", "outputs", "expected"),
    [
        ("Link, rate: 2 bit/s, size: token, delay: 1 s", [("input", [[0, 3], [0, 2], [5, 4]])], 1,
         [(0, 1, "waiting", 1), (1.5, 1, "waiting", 0), (2.5, 1, "output", 3), (3.5, 1, "output", 2),
          (8, 1, "output", 4)]),
        # The frame that is being sent takes no room; one that is sent makes place.
        ("Link, rate: 1 bit/s, size: token, buffer: 3 bit", [("input", [[0, 2], [0, 3], [1, 1], [2, 1], [2, 2]])], 1,
         [(0, 1, "waiting", 1), (1, 1, "rejected", 1), (2, 1, "waiting", 0), (2, 1, "waiting", 2),
          (2, 2, "output", 2), (5, 1, "waiting", 1), (5, 2, "output", 3), (6, 1, "waiting", 0), (6, 2, "output", 1),
          (8, 2, "output", 2)]),
        # All that come at one tag are looked at before the first is chosen.
        ("Link, rate: 1 bit/s, order: token", [("input", [[0, 5], [0, 4], [0.5, 3]])], 1,
         [(0, 1, "waiting", 1), (0.5, 1, "waiting", 2), (1, 1, "waiting", 1), (1, 2, "output", 4),
          (2, 1, "waiting", 0), (2, 2, "output", 3), (3, 2, "output", 5)]),
        ("Link, delay: 2 s", [("input", [[0, 1], [1, 2]]), ("delay", [[1, 0.5]])], 1,
         [(1.5, 1, "output", 2), (2, 1, "output", 1)]),
        ("Link, loss: 1", [("input", [[0, 1]])], 1, [(0, 2, "lost", 1)]),
        ("NetworkSwitch, port: token % 2, rate: 1 bit/s", [("input", [[0, 1], [0, 3], [0, 2]])], 2,
         [(0, 2, "waiting", 1), (1, 1, "output/0", 2), (1, 1, "output/1", 1), (1, 1, "waiting", 0),
          (2, 1, "output/1", 3)]),
        # What has come by then is looked at before the next is chosen.
        ("NetworkSwitch, port: 0, rate: 1 bit/s, order: token, latency: 1 s",
         [("input", [[0, 1], [0.5, 9], [1, 2]])], 1,
         [(1.5, 1, "waiting", 1), (2, 1, "output", 1), (3, 1, "output", 2), (3, 1, "waiting", 0),
          (4, 1, "output", 9)]),
        ("NetworkSwitch, port: 0", [("input", [[0, 1]])], 1, [(0, 2, "output", 1)]),
        ("ArqReceiver", [("input", [[0, {"number": 0, "data": "a"}], [1, {"number": 2, "data": "c"}],
                                    [2, {"number": 1, "data": "b"}]])], 1,
         [(0, 1, "output", "a"), (0, 1, "ack", 0), (1, 1, "ack", 0), (2, 1, "output", "b"), (2, 1, "ack", 1)]),
        ("ArqReceiver, repeat: one",
         [("input", [[1, {"number": 1, "data": "b"}], [2, {"number": 0, "data": "a"}],
                     [3, {"number": 0, "data": "a"}]])],
         1, [(1, 1, "ack", 1), (2, 1, "output", "a"), (2, 1, "output", "b"), (2, 1, "ack", 0), (3, 1, "ack", 0)]),
        # It waits for none before the oldest.
        ("ArqReceiver", [("input", [[0, {"number": 2, "data": "c", "oldest": 2}],
                                    [1, {"number": 1, "data": "b", "oldest": 1}]])], 1,
         [(0, 1, "output", "c"), (0, 1, "ack", 2), (1, 1, "ack", 2)]),
        ("ArqReceiver, repeat: one", [("input", [[0, {"number": 1, "data": "b", "oldest": 0}],
                                                 [1, {"number": 4, "data": "e", "oldest": 0}],
                                                 [2, {"number": 3, "data": "d", "oldest": 3}], [3, {"oldest": 6}]])],
         1, [(0, 1, "ack", 1), (1, 1, "ack", 4), (2, 1, "output", "b"), (2, 1, "output", "d"), (2, 1, "output", "e"),
             (2, 1, "ack", 3)]),
    ],
)  # fmt: skip
def test_links(actor: str, feeds: Feeds, outputs: int, expected: list[Any]) -> None:
    assert behave(f"{{type: {actor}}}", feeds, outputs=outputs) == expected


def frames(sends: list[Any]) -> list[tuple[float, int]]:
    return [(time, token["number"]) for time, _, port, token in sends if port == "output"]


def test_a_sender_goes_back_and_sends_all_anew() -> None:
    feeds: Feeds = [("input", [[0, "a"], [0, "b"], [0, "c"], [0, "d"]]), ("ack", [[1, 0], [6, 3]])]
    sends = behave("{type: ArqSender, window: 3, timeout: 4 s}", feeds)
    assert frames(sends) == [(0, 0), (0, 1), (0, 2), (1, 3), (4, 1), (4, 2), (4, 3)]
    assert [(time, token) for time, _, port, token in sends if port == "acknowledged"] == [
        (1, "a"), (6, "b"), (6, "c"), (6, "d")]  # fmt: skip
    assert [token for _, _, port, token in sends if port == "repeated"] == [1, 2, 3]


def test_a_sender_sends_anew_what_is_late() -> None:
    feeds: Feeds = [("input", [[0, "a"], [0, "b"], [0, "c"], [0, "d"]]), ("ack", [[1, 1], [1, 2], [5, 0], [6, 3]])]
    sends = behave("{type: ArqSender, window: 3, timeout: 4 s, repeat: one, spacing: 0.5 s}", feeds)
    # The window waits for frame 0.
    assert frames(sends) == [(0, 0), (0.5, 1), (1, 2), (4, 0), (5, 3)]


def told(sends: list[Any]) -> list[Any]:
    """Frames as (number, oldest), and the tokens that were given up."""
    return [
        (time, (token.get("number"), token["oldest"]) if port == "output" else token)
        for time, _, port, token in sends
        if port in ("output", "abandoned")
    ]


@pytest.mark.parametrize(
    ("sender", "feeds", "expected"),
    [
        # The last one is told alone.
        ("window: 1, tries: 2", [("input", [[0, "a"], [0, "b"]]), ("ack", [])],
         [(0, (0, 0)), (4, (0, 0)), (8, "a"), (8, (1, 1)), (12, (1, 1)), (16, "b"), (16, (None, 2))]),
        # Of those that are sent together, the oldest alone is tried.
        ("window: 2, tries: 1", [("input", [[0, "a"], [0, "b"]]), ("ack", [[5, 1]])],
         [(0, (0, 0)), (0, (1, 0)), (4, "a"), (4, (1, 1))]),
        ("window: 2, tries: 1, repeat: one", [("input", [[0, "a"], [0, "b"]]), ("ack", [[3, 1]])],
         [(0, (0, 0)), (0, (1, 0)), (4, "a"), (4, (None, 2))]),
        # Those that wait grow old, too; one that is acknowledged does not.
        ("window: 1, lifetime: 5 s", [("input", [[0, "a"], [1, "b"], [4, "c"]]), ("ack", [[4.5, 0]])],
         [(0, (0, 0)), (4, (0, 0)), (4.5, (1, 1)), (6, "b"), (6, (2, 2)), (9, "c"), (9, (None, 3))]),
        ("window: 1, lifetime: 3 s", [("input", [[0, "a"], [0, "b"]]), ("ack", [])],
         [(0, (0, 0)), (3, "a"), (3, "b"), (3, (None, 1))]),
        # The spacing is kept.
        ("window: 2, tries: 1, repeat: one, spacing: 3 s", [("input", [[0, "a"], [0, "b"]]), ("ack", [])],
         [(0, (0, 0)), (3, (1, 0)), (4, "a"), (6, (None, 1)), (7, "b"), (9, (None, 2))]),
    ],
)  # fmt: skip
def test_a_sender_with_a_limit_gives_up(sender: str, feeds: Feeds, expected: list[Any]) -> None:
    assert told(behave(f"{{type: ArqSender, timeout: 4 s, {sender}}}", feeds)) == expected


LOSSY = """
actors:
  source: {{type: Clock, period: 1 s, stop_time: 400 s}}
  sender: {{type: ArqSender, window: 6, timeout: 3 s, repeat: {repeat}, {limit}}}
  there: {{type: Link, delay: 1 s, loss: 0.4}}
  receiver: {{type: ArqReceiver, repeat: {repeat}}}
  back: {{type: Link, delay: 1 s, loss: 0.4}}
connections:
  - source.output -> sender.input
  - sender.output -> there.input
  - there.output -> receiver.input
  - receiver.ack -> back.input
  - back.output -> sender.ack
run: {{stop: 2000 s, seed: 2, record: [receiver.output, sender.abandoned, sender.acknowledged, source.output]}}
"""


@pytest.mark.parametrize("repeat", ["all", "one"])
@pytest.mark.parametrize("limit", ["tries: 2", "lifetime: 9 s", "tries: 3, lifetime: 7 s"])
def test_every_token_arrives_once_and_in_order_or_is_abandoned(repeat: str, limit: str) -> None:
    _, results = simulate(LOSSY.format(repeat=repeat, limit=limit))
    sent, arrived, abandoned, acknowledged = (
        list(results.signals[name].values)
        for name in ("source.output", "receiver.output", "sender.abandoned", "sender.acknowledged")
    )
    assert arrived == sorted(set(arrived))
    assert set(arrived) | set(abandoned) == set(sent)
    assert set(abandoned).isdisjoint(acknowledged)
    assert set(acknowledged) <= set(arrived)
    assert min(len(arrived), len(abandoned)) > 20


@pytest.mark.parametrize(
    ("actor", "feeds", "message"),
    [
        ("Link, rate: 1 bit/s, size: length", [("input", [[0, {"lenght": 1}]])],
         ("'length': the token {'lenght': 1} has no field 'length', did you mean 'lenght'? it has lenght, and token, "
          "time are known")),
        ("Link, rate: 1 bit/s, size: token", [("input", [[0, -1]])], ("'token' gives -1 for -1, but a size must be >= "
                                                                     "0")),
        ("ArqReceiver", [("input", [[0, {"number": 0}]])],
         "the token {'number': 0} has no field 'data'; it has number"),
        ("ArqReceiver", [("input", [[0, {"number": 0.5, "data": 1}]])],
         "the number of a frame is 0.5, expected 0, 1, 2, ..."),
        ("ArqReceiver", [("input", [[0, {"oldest": "a"}]])],
         "the oldest number of a frame is 'a', expected 0, 1, 2, ..."),
        ("NetworkSwitch, port: token", [("input", [[0, 2]])],
         "'token' gives 2 for 2, but it.output has 2 channels, counted from 0"),
    ],
)  # fmt: skip
def test_what_cannot_be(actor: str, feeds: Feeds, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        behave(f"{{type: {actor}}}", feeds, outputs=2)
    assert caught.value.reason == message
