"""Pools and waiting lines: who gets what and when, who leaves before, and what is said of wrong ones."""

from __future__ import annotations

from typing import Any

import pytest
import simpy

from epicycle.actors import Actor, InputPort, OutputPort, Pending
from epicycle.runner.execution.engine import ActorError, Simulation
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
        # A patience is a time, or each token's own.
        ("patience: 2 s", [("acquire", [[0, 1], [1, 2], [2, 3]]), ("release", [[3, 0]])],
         [(0, "granted", 1), (3, "reneged", 2), (3, "granted", 3)]),
        ("patience: inf if token == 2 else token / 2 + channel",
         [("acquire", [[0, 1], [1, 2], [2, 3]]), ("release", [])],
         [(0, "granted", 1), (3.5, "reneged", 3)]),
    ],
)  # fmt: skip
def test_pools(pool: str, feeds: Feeds, expected: list[Any]) -> None:
    sends = behave(f"{{type: Pool, {pool}}}", feeds)
    assert of(sends, "granted", "preempted", "rejected", "balked", "reneged") == expected


A, B, AB = ({"a": a, "b": b, "order": 5} for a, b in ((1, 0), (0, 1), (1, 1)))
FIRST = {**A, "order": 1}


@pytest.mark.parametrize(
    ("pools", "feeds", "expected"),
    [
        # All at once or nothing: what waits for both holds neither, and is overtaken by nobody who needs one of them.
        ("", [("acquire", [[0, A], [1, AB], [2, B], [3, A]]), ("release", [[4, 0]])],
         [(0, "granted", A), (4, "granted", AB)]),
        # The third needs nothing of what the second waits for.
        ("", [("acquire", [[0, A], [1, A], [2, B]]), ("release", [])], [(0, "granted", A), (2, "granted", B)]),
        # One that reneges leaves the queues of all, and those behind it go on.
        ("patience: 1.5 if a + b == 2 else inf",
         [("acquire", [[0, A], [1, AB], [2, B]]), ("release", [])],
         [(0, "granted", A), (2.5, "reneged", AB), (2.5, "granted", B)]),
        ("room: 0", [("acquire", [[0, A], [1, AB], [2, B]]), ("release", [])],
         [(0, "granted", A), (1, "rejected", AB), (2, "granted", B)]),
        # Preemption takes all that the loser holds, and nothing if that is not enough.
        ("preemptive: true, order: order", [("acquire", [[0, AB], [1, FIRST], [2, B]]), ("release", [[3, 0]])],
         [(0, "granted", AB), (1, "preempted", AB), (1, "granted", FIRST), (3, "granted", AB)]),
        ("preemptive: true, order: order",
         [("acquire", [[0, FIRST], [0, B], [1, {**AB, "order": 3}]]), ("release", [])],
         [(0, "granted", FIRST), (0, "granted", B)]),
        # A shift ends in one of them, and begins again.
        ("preemptive: true", [("acquire", [[0, A], [0, B]]), ("a_capacity", [[1, 0], [2, 1]])],
         [(0, "granted", A), (0, "granted", B), (1, "preempted", A), (2, "granted", A)]),
        ("", [("acquire", [[0, A], [1, B]]), ("b_capacity", [[0, 0], [2, 1]])],
         [(0, "granted", A), (2, "granted", B)]),
    ],
)  # fmt: skip
def test_several_pools(pools: str, feeds: Feeds, expected: list[Any]) -> None:
    feeds = [*feeds, ("release", [])] if all(port != "release" for port, _ in feeds) else feeds
    more = f", {pools}" if pools else ""
    sends = behave(f"{{type: Pools, capacity: {{a: 1, b: 1}}, amount: {{a: a, b: b}}{more}}}", feeds)
    assert of(sends, "granted", "preempted", "rejected", "balked", "reneged") == expected


def test_a_unit_of_each_pool_if_nothing_else_is_said() -> None:
    feeds: Feeds = [("acquire", [[0, 1], [1, 2]]), ("release", [[2, 1]])]
    assert behave("{type: Pools, capacity: {a: 1, b: 2}}", feeds) == [
        (0, 2, "granted", 1),
        (0, 2, "a_in_use", 1),
        (0, 2, "b_in_use", 1),
        (1, 2, "waiting", 1),
        (2, 2, "granted", 2),
        (2, 2, "waiting", 0),
    ]


class Treatment(Actor):
    """Each patient's takes as long as the patient says."""

    input = InputPort(dict)
    output = OutputPort(dict, depends_on=())

    def initialize(self) -> None:
        self._treated: Pending[Any] = Pending(self)

    def fire(self) -> None:
        for patient in self._treated.due():
            self.output.send(patient)
        for patient in self.input.tokens:
            self._treated.put(patient, patient["work"])


WARD = """
actors:
  door: {type: PoissonClock, mean_interval: 5 min, fire_at_start: false}
  patient:
    type: SetFields
    draw:
      work: {type: Gamma, mean: 12 min, shape: 2}
      patience: {type: Exponential, mean: 15 min}
      urgent: {type: Bernoulli, probability: 0.2}
      needs: {type: RandomInteger, low: 0, high: 3}
    set: {number: token}
  ward:
    type: Pools
    capacity: {doctor: 3, nurse: 2, room: 4}
    amount: {doctor: 2 if urgent else 1, nurse: needs % 2, room: 1 if needs < 2 else 0}
    order: 0 if urgent else 1
    patience: 2 * patience if urgent else patience
    key: number
  treatment: {type: Treatment}
connections:
  - door.output -> patient.input
  - patient.output -> ward.acquire
  - ward.granted -> treatment.input
  - treatment.output -> ward.release
run: {stop: 48 h, seed: 5, record: [patient.output, ward.granted, ward.reneged]}
"""


def test_several_pools_do_what_a_program_in_simpy_does() -> None:
    _, results = simulate(WARD, types=[Treatment])
    came = results.signals["patient.output"]
    environment = simpy.Environment()
    free = {"doctor": 3, "nurse": 2, "room": 4}
    line: list[tuple[int, int, dict[str, int], simpy.Event]] = []
    granted, reneged = [], []

    def serve() -> None:
        claimed: set[str] = set()
        for each in sorted(line, key=lambda each: each[:2]):
            needs = each[2]
            if claimed.isdisjoint(needs) and all(free[kind] >= amount for kind, amount in needs.items()):
                free.update({kind: free[kind] - amount for kind, amount in needs.items()})
                line.remove(each)
                each[3].succeed()
            claimed.update(needs if each in line else ())

    def visit(time: float, token: dict[str, Any]) -> Any:
        yield environment.timeout(time)
        doctors, nurses, rooms = 1 + token["urgent"], token["needs"] % 2, int(token["needs"] < 2)
        needs = {"doctor": doctors, "nurse": nurses, "room": rooms}
        called = environment.event()
        me = (1 - token["urgent"], token["number"], {kind: each for kind, each in needs.items() if each}, called)
        line.append(me)
        serve()
        yield called | environment.timeout(token["patience"] * (1 + token["urgent"]))
        if not called.triggered:
            line.remove(me)
            reneged.append((environment.now, token["number"]))
            serve()
            return
        granted.append((environment.now, token["number"]))
        yield environment.timeout(token["work"])
        free.update({kind: free[kind] + amount for kind, amount in me[2].items()})
        serve()

    for time, token in zip(came.times, came.values, strict=True):
        environment.process(visit(float(time), token))
    environment.run(until=48 * 3600)
    for port, expected in (("granted", granted), ("reneged", reneged)):
        found = results.signals[f"ward.{port}"]
        assert [token["number"] for token in found.values] == [number for _, number in expected]
        assert found.times == pytest.approx([time for time, _ in expected], abs=1e-5)
    assert min(len(granted), len(reneged)) > 50


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


def test_credits_are_counted_and_go_round() -> None:
    feeds: Feeds = [("input", [[n, n] for n in range(5)]), ("trigger", [])]
    assert tokens(behave("{type: WaitingLine, credits: 1000000000}", feeds)) == [0, 1, 2, 3, 4]
    _, results = simulate(
        """
actors:
  jobs: {type: Clock, period: 1 s, stop_time: 4 s}
  line: {type: WaitingLine, credits: 2}
  desk: {type: TimeDelay, count: 2, delay: 1 h}
connections:
  - jobs.output -> line.input
  - line.output -> desk[*].input
  - desk[*].output -> line.trigger
run: {stop: 20 s}
"""
    )
    found = [(r.value, r.channel) for r in results.log.records if (r.actor, r.port) == ("line", "output")]
    assert found == [(0, 0), (1, 1), (2, 0), (3, 1)]


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
        ("Pool, patience: token - 2", [("acquire", [[0, 2], [0, 1]]), ("release", [])],
         "'token - 2' gives -1, but a patience must be a time >= 0 s, or inf"),
        ("Pool, patience: token", [("acquire", [[0, 2], [0, "long"]]), ("release", [])],
         "'token' gives 'long', but a patience must be a time >= 0 s, or inf"),
        ("Pools, capacity: {a: 1, b: 2}, amount: {b: token}", [("acquire", [[0, 3]]), ("release", [])],
         "3 requests 3 of 2 units of b and would wait for ever"),
        ("Pools, capacity: {a: 1, b: 2}, amount: {a: token, b: 0}", [("acquire", [[0, 0]]), ("release", [])],
         "0 requests nothing from any of a, b"),
        ("Pools, capacity: {a: 1, b: 2}, amount: {b: token}", [("acquire", [[0, 0.5]]), ("release", [])],
         "'token' gives 0.5, but an amount must be a whole number >= 0"),
        ("Pools, capacity: {a: 1}", [("acquire", []), ("a_capacity", [[1, -1]]), ("release", [])],
         "it.a_capacity got -1, but a number of units must be >= 0"),
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


@pytest.mark.parametrize(
    ("actor", "message"),
    [
        ("Pool, patience: {type: Bernoulli}", "it: patience: Bernoulli gives values other than numbers"),
        ("Pool, patience: 2 m", "it.patience: '2 m' is a length, expected a time in s"),
        ("Pool, patience: -2 s", "it.patience: -2 is out of bounds, expected a number in s >= 0"),
        ("Pool, patience: [1]", "it.patience: [1] is not a number in s >= 0"),
        ("Pool, patience: 2 *", "it.patience: '2 *' has an unreadable unit '*': a unit is missing before '*'"),
        (
            "Pool, patience: due -",
            "it.patience: 'due -' is not an expression: invalid syntax",
        ),
        ("Pools, capacity: {}", "it: capacity: there is no pool; name at least one, as in {doctor: 3, room: 4}"),
        ("Pools, capacity: 3", "it.capacity: 3 is not a mapping of names to integer"),
        ("Pools, capacity: {a: -1}", "it.capacity: a: -1 is out of bounds, expected an integer >= 0"),
        (
            "Pools, capacity: {big room: 1}",
            "it: 'big room_capacity' cannot be the name of a port: use letters, digits and _, and no digit first",
        ),
        (
            "Pools, capacity: {doctor: 1, room: 2}, amount: {docter: 1}",
            "it: amount: there is no pool 'docter', did you mean 'doctor'? valid names: doctor, room",
        ),
        ("Pools, capacity: {doctor: 1, room: 2}, amount: 2", "it.amount: 2 is not a mapping of names to expression"),
    ],
)
def test_what_is_wrong_before_it_runs(actor: str, message: str) -> None:
    assert problem(f"{{type: {actor}}}", ASKS[:1]) == message


# -- crashes, snapshots, traces -------------------------------------------------------------------------------------

BUSY = """
actors:
  customers: {type: PoissonClock, mean_interval: 0.5 s}
  crew: {type: Pool, capacity: 2, patience: {type: Exponential, mean: 3 s}, balking: waiting / 9, discipline: random}
  ward: {type: Pools, capacity: {doctor: 2, room: 1}, amount: {doctor: 1, room: token % 2}, patience: token % 3}
  work: {type: Server, servers: null, distribution: {type: Exponential, mean: 1.2 s}}
  care: {type: Server, servers: null, distribution: {type: Exponential, mean: 1.2 s}}
  line: {type: WaitingLine, credits: 1, patience: {type: Exponential, mean: 3 s}}
  desk: {type: Server, service_time: 0.8 s}
  entity: {type: SetFields, draw: {size: {type: Exponential, mean: 400}}, set: {port: token % 2, key: token}}
  switch: {type: NetworkSwitch, rate: 1 kbit/s, size: size, port: port, buffer: 800 bit}
  link: {type: Link, count: 2, rate: 1 kbit/s, size: size, delay: 10 ms, loss: 0.1}
  sender: {type: ArqSender, window: 4, timeout: 5 s, tries: 2, lifetime: 20 s}
  wire: {type: Link, rate: 1 bit/s, delay: 1 s, loss: 0.2}
  receiver: {type: ArqReceiver}
  batch: {type: Batch, number: 3, after: 4 s}
  match: {type: Match, key: key}
connections:
  - customers.output -> crew.acquire, entity.input, ward.acquire
  - ward.granted -> care.input
  - care.output -> ward.release
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
  crash: {type: CrashRestart, at: [crew, ward, line, switch, "link[0]", batch, match], mtbf: 10 s, repair: 1 s}
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
