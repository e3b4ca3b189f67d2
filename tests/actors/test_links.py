"""Links, switches, and both ends of ARQ."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.runner.engine import ActorError
from tests.actors.library_parts import Feeds, behave


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
        ("NetworkSwitch, port: token", [("input", [[0, 2]])],
         "'token' gives 2 for 2, but it.output has 2 channels, counted from 0"),
    ],
)  # fmt: skip
def test_what_cannot_be(actor: str, feeds: Feeds, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        behave(f"{{type: {actor}}}", feeds, outputs=2)
    assert caught.value.reason == message
