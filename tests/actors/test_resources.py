"""Pools and waiting lines: who gets what and when, who leaves before, and what is said of wrong ones."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.runner.engine import ActorError, Simulation
from tests.actors.library_parts import Feeds, Sends, behave, problem, tokens
from tests.engine.engine_parts import load, simulate

ASKS: Feeds = [("acquire", [[0, "a"], [1, "b"]]), ("acquire", [[1, "c"]])]


def of(sends: Sends, *ports: str) -> list[tuple[float, str, Any]]:
    return [(time, port, token) for time, _, port, token in sends if port in ports]


def test_what_is_asked_for_on_a_channel_is_granted_on_it_a_microstep_later() -> None:
    feeds: Feeds = [*ASKS, ("release", [[2, 0], [4, 0]]), ("release", [[3, 0]])]
    assert behave("{type: Pool}", feeds) == [
        (0, 2, "granted", "a"),
        (0, 2, "in_use", 1),
        (1, 2, "waiting", 2),
        (2, 2, "granted", "b"),
        (2, 2, "waiting", 1),
        # Channel 1 holds nothing yet: its request is withdrawn.
        (3, 2, "waiting", 0),
        (4, 2, "in_use", 0),
    ]


@pytest.mark.parametrize(
    ("pool", "feeds", "expected"),
    [
        # Who goes first.
        ("order: -token", [("acquire", [[0, 1], [1, 2], [2, 3]]), ("release", [[3, 0], [4, 0]])],
         [(0, "granted", 1), (3, "granted", 3), (4, "granted", 2)]),
        ("discipline: lifo", [("acquire", [[0, 1], [1, 2], [2, 3]]), ("release", [[3, 0], [4, 0]])],
         [(0, "granted", 1), (3, "granted", 3), (4, "granted", 2)]),
        ("order: -channel", [("acquire", [[0, 1]]), ("acquire", [[0, 2]]), ("release", [[1, 0]])],
         [(0, "granted", 2), (1, "granted", 1)]),
        # Nobody overtakes the first, however little is asked for.
        ("capacity: 3, amount: token", [("acquire", [[0, 2], [1, 3], [2, 1]]), ("release", [[3, 0], [4, 0]])],
         [(0, "granted", 2), (3, "granted", 3), (4, "granted", 1)]),
        # A release of all channels, and the request that it belongs to.
        ("capacity: 2, amount: n, key: id",
         [("acquire", [[0, {"id": 1, "n": 1}], [0, {"id": 2, "n": 1}], [1, {"id": 3, "n": 2}]]),
          ("release", [[2, {"id": 2}], [3, {"id": 1}]])],
         [(0, "granted", {"id": 1, "n": 1}), (0, "granted", {"id": 2, "n": 1}), (3, "granted", {"id": 3, "n": 2})]),
        # A shift ends: who has begun goes on, or is stopped.
        ("capacity: 2", [("acquire", [[0, 1], [0, 2], [1, 3]]), ("capacity", [[2, 1]]), ("release", [[3, 0], [4, 0]])],
         [(0, "granted", 1), (0, "granted", 2), (4, "granted", 3)]),
        ("capacity: 2, preemptive: true",
         [("acquire", [[0, 1], [0, 2]]), ("capacity", [[2, 1], [3, 0], [5, 2]]), ("release", [[6, 0]])],
         [(0, "granted", 1), (0, "granted", 2), (2, "preempted", 2), (3, "preempted", 1), (5, "granted", 1),
          (5, "granted", 2)]),
        # The urgent takes from the least urgent, and only if that is enough.
        ("capacity: 2, preemptive: true, order: token, amount: 2 if token == 0 else 1",
         [("acquire", [[0, 3], [0, 1], [1, 2], [2, 0]]), ("release", [[3, 0]])],
         [(0, "granted", 1), (0, "granted", 3), (1, "preempted", 3), (1, "granted", 2), (2, "preempted", 2),
          (2, "preempted", 1), (2, "granted", 0), (3, "granted", 1), (3, "granted", 2)]),
        ("room: 1", [("acquire", [[0, 1], [0, 2], [0, 3]]), ("release", [])],
         [(0, "granted", 1), (0, "rejected", 3)]),
        ("balking: waiting >= token", [("acquire", [[0, 0], [1, 0], [2, 1], [3, 1]]), ("release", [])],
         [(0, "granted", 0), (1, "balked", 0), (3, "balked", 1)]),
        # At one tag those that renege leave before a unit becomes free.
        ("patience: {type: Constant, value: 2 s}", [("acquire", [[0, 1], [1, 2], [2, 3]]), ("release", [[3, 0]])],
         [(0, "granted", 1), (3, "reneged", 2), (3, "granted", 3)]),
    ],
)  # fmt: skip
def test_pools(pool: str, feeds: Feeds, expected: list[Any]) -> None:
    sends = behave(f"{{type: Pool, {pool}}}", feeds)
    assert of(sends, "granted", "preempted", "rejected", "balked", "reneged") == expected


@pytest.mark.parametrize(
    ("line", "feeds", "expected"),
    [
        ("credits: 1", [("input", [[0, 1], [0, 2], [1, 3]]), ("trigger", [[2, 0], [3, 0], [4, 0]])],
         [(0, "output", 1), (2, "output", 2), (3, "output", 3)]),
        ("persistent_trigger: false", [("input", [[1, 1]]), ("trigger", [[0, 0], [2, 0]])], [(2, "output", 1)]),
        ("order: due", [("input", [[0, {"due": 5}], [0, {"due": 3}]]), ("trigger", [[1, 0]])],
         [(1, "output", {"due": 3})]),
        ("room: 5, size: token", [("input", [[0, 3], [0, 3], [0, 2]]), ("trigger", [])], [(0, "rejected", 3)]),
        ("order: token, room: 5, size: token", [("input", [[0, 3], [0, 3], [0, 2]]), ("trigger", [])],
         [(0, "rejected", 3)]),
    ],
)  # fmt: skip
def test_waiting_lines(line: str, feeds: Feeds, expected: list[Any]) -> None:
    sends = behave(f"{{type: WaitingLine, {line}}}", feeds)
    assert of(sends, "output", "rejected", "balked", "reneged") == expected


def test_in_random_order_everybody_goes_once() -> None:
    feeds: Feeds = [("input", [[0, n] for n in range(50)]), ("trigger", [[1, 0]] * 50)]
    found = tokens(behave("{type: WaitingLine, discipline: random}", feeds, seed=2))
    assert sorted(found) == list(range(50)) != found


CHANNELS = """
actors:
  jobs: {type: Clock, period: 1 s, stop_time: 3 s}
  line: {type: WaitingLine, credits: 1}
  desk: {type: Server, count: 2, service_time: "${[10, 1.5][index]}"}
connections:
  - jobs.output -> line.input
  - line.output -> desk[*].input
  - desk[*].output -> line.trigger
run: {stop: 20 s}
"""


def test_who_asks_a_line_gets_it() -> None:
    _, results = simulate(CHANNELS)
    found = [
        (r.tag.seconds, r.value, r.channel) for r in results.log.records if (r.actor, r.port) == ("line", "output")
    ]
    assert found == [(0.0, 0, 0), (1.0, 1, 1), (2.5, 2, 1), (4.0, 3, 1)]


# -- wrong ones -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("actor", "feeds", "message"),
    [
        ("Pool", [("acquire", [[0, "a"]]), ("release", [[1, 0], [2, "again"]])],
         "it.release got 'again' on channel 0, which has no request"),
        ("Pool, key: token", [("acquire", [[0, "a"]]), ("release", [[1, "b"]])],
         "it.release got 'b' on channel 0, which has no request with the key 'b'"),
        ("Pool, amount: token", [("acquire", [[0, 2]]), ("release", [])],
         "2 requests 2 of 1 unit and would wait for ever"),
        ("Pool, amount: token", [("acquire", [[0, 0.5]]), ("release", [])],
         "'token' gives 0.5, but an amount must be a whole number >= 1"),
        ("Pool, order: rank", [("acquire", [[0, {"rnk": 2}]]), ("release", [])],
         ("'rank': the token {'rnk': 2} has no field 'rank', did you mean 'rnk'? it has rnk, and token, time, channel "
          "are known")),
        ("Pool, order: token", [("acquire", [[0, "first"]]), ("release", [])],
         "'token' gives 'first', but an order must be a finite number"),
        ("Pool, balking: waiting + 2", [("acquire", [[0, 0], [0, 1]]), ("release", [])],
         "'waiting + 2' gives 2, but balking must be true or false, or a probability from 0 to 1"),
        ("WaitingLine, size: token", [("input", [[0, -1]])], "'token' gives -1, but a size must be >= 0"),
    ],
)  # fmt: skip
def test_what_cannot_be(actor: str, feeds: Feeds, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        behave(f"{{type: {actor}}}", feeds)
    assert caught.value.reason == message


def test_channels_that_do_not_belong_together() -> None:
    with pytest.raises(ActorError) as caught:
        behave("{type: Pool}", [("acquire", []), ("acquire", []), ("acquire", []), ("release", []), ("release", [])])
    assert caught.value.reason == (
        "it.acquire has 3 channels and it.release has 2; give it 1 channel, or as many, because units are released "
        "on the channel of their request"
    )
    with pytest.raises(ActorError) as caught:
        behave("{type: WaitingLine}", [("input", []), ("trigger", []), ("trigger", [])], outputs=3)
    assert caught.value.reason == (
        "it.trigger has 2 channels and it.output has 3; give both the same number of channels, because requests on a "
        "channel are answered on it"
    )
    assert problem("{type: Pool, patience: {type: Bernoulli}}", ASKS[:1]) == (
        "it: patience: Bernoulli gives values other than numbers"
    )


# -- crashes, snapshots, traces -------------------------------------------------------------------------------------

BUSY = """
actors:
  customers: {type: PoissonClock, mean_interval: 0.5 s}
  crew: {type: Pool, capacity: 2, patience: {type: Exponential, mean: 3 s}, balking: waiting / 9, discipline: random}
  work: {type: Server, servers: null, distribution: {type: Exponential, mean: 1.2 s}}
  line: {type: WaitingLine, credits: 1, patience: {type: Exponential, mean: 3 s}}
  desk: {type: Server, service_time: 0.8 s}
  entity: {type: SetFields, draw: {size: {type: Exponential, mean: 400}}, set: {port: token % 2, key: token}}
  switch: {type: NetworkSwitch, rate: 1 kbit/s, size: size, port: port, buffer: 800 bit}
  link: {type: Link, count: 2, rate: 1 kbit/s, size: size, delay: 10 ms, loss: 0.1}
  sender: {type: ArqSender, window: 4, timeout: 5 s}
  wire: {type: Link, rate: 1 bit/s, delay: 1 s, loss: 0.2}
  receiver: {type: ArqReceiver}
  batch: {type: Batch, number: 3, after: 4 s}
  match: {type: Match, key: key}
connections:
  - customers.output -> crew.acquire, entity.input
  - crew.granted -> work.input, line.input
  - work.output -> crew.release
  - line.output -> desk.input
  - desk.output -> line.trigger, batch.input
  - entity.output -> switch.input, match.input
  - entity.output -> match.input
  - switch.output -> link[*].input
  - link[*].output => sender.input
  - sender.output -> wire.input
  - wire.output -> receiver.input
  - receiver.ack -> sender.ack
run: {stop: 60 s, seed: 3}
"""
CRASHES = """
aspects:
  crash: {type: CrashRestart, at: [crew, line, switch, "link[0]", batch, match], mtbf: 10 s, repair: 1 s}
"""


@pytest.mark.parametrize("crashes", ["", CRASHES])
def test_a_run_goes_on_from_a_snapshot(crashes: str) -> None:
    text = BUSY.replace("  - link[*].output => sender.input", "  - link[0].output -> sender.input") + crashes
    whole = Simulation(load(text), keep_log=True).run()
    simulation = Simulation(load(text), keep_log=True)
    simulation.advance(25.0)
    kept = simulation.snapshot()
    simulation.advance(40.0)
    simulation.restore(kept)
    assert simulation.run().digest == whole.digest
    ports = {(record.actor, record.port) for record in whole.log.records if record.event == "send"}
    assert ports >= {("crew", "reneged"), ("line", "output"), ("switch", "output"), ("receiver", "output"),
                     ("batch", "output"), ("match", "output")}  # fmt: skip
