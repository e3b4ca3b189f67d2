"""Actors in which tokens wait, and actors that deal with time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.runner.execution.engine import ActorError
from tests.actors.library_parts import Feeds, behave, problem, tokens


@pytest.mark.parametrize(
    ("actor", "feeds", "expected"),
    [
        # Tokens come in before triggers let them out; a trigger that finds nothing is lost.
        ("Queue", [("input", [[1, "a"], [1, "b"]]), ("trigger", [[0, 0], [1, 0]])],
         [(1, 1, "size", 1), (1, 1, "size", 2), (1, 1, "output", "a"), (1, 1, "size", 1)]),
        ("Queue, persistent_trigger: true", [("input", [[1, "a"], [1, "b"]]), ("trigger", [[0, 0], [0, 0]])],
         [(1, 1, "size", 1), (1, 1, "size", 2), (1, 1, "output", "a"), (1, 1, "size", 1), (1, 1, "output", "b"),
          (1, 1, "size", 0)]),
        ("Queue, capacity: 1", [("input", [[0, "a"], [0, "b"], [2, "c"]]), ("trigger", [[1, 0], [1, 0]])],
         [(0, 1, "size", 1), (0, 1, "rejected", "b"), (1, 1, "output", "a"), (1, 1, "size", 0), (2, 1, "size", 1)]),
        # Server: no time at all is a microstep.
        ("Server, service_time: 0", [("input", [[0, "a"], [0, "b"]])],
         [(0, 1, "size", 1), (0, 1, "size", 2), (0, 2, "output", "a"), (0, 2, "size", 1), (0, 3, "output", "b"),
          (0, 3, "size", 0)]),
        ("Server, service_time: 2 s", [("input", [[0, "a"], [1, "b"], [4, "c"]])],
         [(0, 1, "size", 1), (1, 1, "size", 2), (2, 1, "output", "a"), (2, 1, "size", 1), (4, 1, "output", "b"),
          (4, 1, "size", 0), (4, 1, "size", 1), (6, 1, "output", "c"), (6, 1, "size", 0)]),
        # The service time is settled on arrival.
        ("Server", [("service_time", [[0, 3], [1, 1]]), ("input", [[0, "a"], [0.5, "b"], [1, "c"]])],
         [(0, 1, "size", 1), (0.5, 1, "size", 2), (1, 1, "size", 3), (3, 1, "output", "a"), (3, 1, "size", 2),
          (6, 1, "output", "b"), (6, 1, "size", 1), (7, 1, "output", "c"), (7, 1, "size", 0)]),
        # With several servers, one that is quicker overtakes.
        ("Server, servers: 2", [("service_time", [[0, 5], [1, 1]]), ("input", [[0, "a"], [1, "b"], [1, "c"]])],
         [(0, 1, "size", 1), (1, 1, "size", 2), (1, 1, "size", 3), (2, 1, "output", "b"), (2, 1, "size", 2),
          (3, 1, "output", "c"), (3, 1, "size", 1), (5, 1, "output", "a"), (5, 1, "size", 0)]),
        ("Server, servers: 2", [("input", [[0, "a"], [0, "b"], [0, "c"]])],
         [(0, 1, "size", 1), (0, 1, "size", 2), (0, 1, "size", 3), (1, 1, "output", "a"), (1, 1, "size", 2),
          (1, 1, "output", "b"), (1, 1, "size", 1), (2, 1, "output", "c"), (2, 1, "size", 0)]),
        ("Server, servers: null", [("input", [[0, "a"], [0, "b"], [0.5, "c"]])],
         [(0, 1, "size", 1), (0, 1, "size", 2), (0.5, 1, "size", 3), (1, 1, "output", "a"), (1, 1, "size", 2),
          (1, 1, "output", "b"), (1, 1, "size", 1), (1.5, 1, "output", "c"), (1.5, 1, "size", 0)]),
        # A place that becomes free is free for who comes at the same tag.
        ("Server, capacity: 1", [("input", [[0, "a"], [0.5, "b"], [1, "c"]])],
         [(0, 1, "size", 1), (0.5, 1, "rejected", "b"), (1, 1, "output", "a"), (1, 1, "size", 0), (1, 1, "size", 1),
          (2, 1, "output", "c"), (2, 1, "size", 0)]),
        ("TimeDelay", [("input", [[0, "a"], [0.5, "b"]])], [(1, 1, "output", "a"), (1.5, 1, "output", "b")]),
        ("TimeDelay, delay: 0", [("input", [[0, "a"], [0, "b"]])], [(0, 2, "output", "a"), (0, 2, "output", "b")]),
        # A shorter delay overtakes; two that meet leave in the order in which they came.
        ("TimeDelay", [("delay", [[0, 3], [1, 1], [2, 1]]), ("input", [[0, "a"], [1, "b"], [2, "c"]])],
         [(2, 1, "output", "b"), (3, 1, "output", "a"), (3, 1, "output", "c")]),
        ("Timer, value: done", [("input", [[0, 2], [0, 0], [1, 1]])],
         [(0, 2, "output", "done"), (2, 1, "output", "done"), (2, 1, "output", "done")]),
        ("ResettableTimer, value: 1", [("input", [[0, 2], [1, 2]])], [(3, 1, "output", 1)]),
        ("ResettableTimer", [("input", [[0, 2], [1, -1], [4, 0]])], [(4, 2, "output", True)]),
        # Too late to stop it; the new time runs from there.
        ("ResettableTimer", [("input", [[0, 2], [2, -1], [3, 1], [4, 1]])],
         [(2, 1, "output", True), (4, 1, "output", True), (5, 1, "output", True)]),
        ("TimeGap", [("input", [[1, "a"], [1.5, "b"], [1.5, "c"], [4, "d"]])],
         [(1.5, 1, "output", 0.5), (1.5, 1, "output", 0.0), (4, 1, "output", 2.5)]),
    ],
)  # fmt: skip
def test_waiting(actor: str, feeds: Feeds, expected: list[Any]) -> None:
    assert behave(f"{{type: {actor}}}", feeds) == expected


def times(least: float, most: float) -> st.SearchStrategy[float]:
    # Eighths of a second: exact in both floats and nanoseconds.
    return st.integers(int(8 * least), int(8 * most)).map(lambda n: n / 8)


@settings(max_examples=60, deadline=None)
@given(
    jobs=st.lists(st.tuples(times(0, 10), times(0.125, 5)), max_size=12),
    servers=st.integers(1, 3),
    room=st.none() | st.integers(0, 3),
)
def test_server_against_the_recursion_of_kiefer_and_wolfowitz(
    jobs: list[tuple[float, float]], servers: int, room: int | None
) -> None:
    """Each job takes the server that is free first; it is lost if all places are taken when it comes."""
    jobs.sort(key=lambda job: job[0])
    arrivals = sorted({time for time, _ in jobs})
    # One job a tag, for a port can bring one service time a tag.
    jobs = [next(job for job in jobs if job[0] == time) for time in arrivals]
    capacity = None if room is None else servers + room
    free, expected, lost = [0.0] * servers, [], []
    for number, (arrival, service) in enumerate(jobs):
        if capacity is not None and sum(end > arrival for end, _ in expected) >= capacity:
            lost.append(number)
            continue
        first = int(np.argmin(free))
        free[first] = max(free[first], arrival) + service
        expected.append((free[first], number))
    sends = behave(
        f"{{type: Server, servers: {servers}, capacity: {'null' if capacity is None else capacity}}}",
        [
            ("service_time", [[arrival, service] for arrival, service in jobs]),
            ("input", [[arrival, number] for number, (arrival, _) in enumerate(jobs)]),
        ],
    )
    assert sorted((time, token) for time, _, port, token in sends if port == "output") == sorted(expected)
    assert tokens(sends, "rejected") == lost
    assert tokens(sends, "size")[-1:] in ([], [0])


def test_services_may_be_drawn() -> None:
    server = "{type: Server, servers: null, distribution: {type: Uniform, low: 1, high: 2}}"
    sends = [send for send in behave(server, [("input", [[0, n] for n in range(500)])], seed=5) if send[2] == "output"]
    found = np.sort([time for time, *_ in sends])
    assert sorted(token for *_, token in sends) == list(range(500))
    assert 1 < found[0] < found[-1] < 2
    assert abs(found.mean() - 1.5) < 4 * np.sqrt(1 / 12 / 500)


def test_rounding_does_not_add_up_while_a_server_is_busy() -> None:
    third = 1 / 3
    sends = behave(f"{{type: Server, service_time: {third!r}}}", [("input", [[0, n] for n in range(3000)])], until=2000)
    ends = [time for time, _, port, _ in sends if port == "output"]
    assert max(abs(time - (n + 1) * third) for n, time in enumerate(ends)) < 1e-9


@pytest.mark.parametrize(
    ("server", "message"),
    [
        ("servers: 2, capacity: 1", "capacity: 1 is less than 'servers' (2), but it includes tokens in service"),
        ("servers: null, capacity: 1",
         "capacity: 1 is less than 'servers' (unlimited), but it includes tokens in service"),
        ("distribution: {type: Bernoulli}", "distribution: Bernoulli gives values other than numbers"),
    ],
)  # fmt: skip
def test_wrong_servers(server: str, message: str) -> None:
    assert problem(f"{{type: Server, {server}}}", [("input", [])]) == f"it: {message}"


@pytest.mark.parametrize(
    ("actor", "feeds", "message"),
    [
        ("Server, distribution: {type: Constant, value: -1}", [("input", [[0, 1]])],
         "-1.0 drawn from Constant(value=-1.0) is not a service time in s: it must be a number >= 0"),
        ("Server", [("input", [[0, 1]]), ("service_time", [[0, -1]])],
         "it.service_time: -1 is out of bounds, expected a number in s >= 0"),
        ("TimeDelay", [("input", [[0, 1]]), ("delay", [[0, "soon"]])],
         "it.delay: 'soon' is not a number with a unit, expected a time in s"),
        ("Timer", [("input", [[0, -1]])], "it.input is -1 s, but a timer needs a time >= 0"),
    ],
)  # fmt: skip
def test_times_that_are_none(actor: str, feeds: Feeds, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        behave(f"{{type: {actor}}}", feeds)
    assert caught.value.reason == message
