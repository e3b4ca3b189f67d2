"""Pools, waiting lines, routers, links and ARQ obey queueing theory, within the intervals of one long run each."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import integrate

from epicycle.runner import Simulation, load_model
from epicycle.runner.execution.engine import Results

pytestmark = pytest.mark.slow


def results_of(text: str, folder: Path) -> Results:
    path = folder / "m.yaml"
    path.write_text("model: m\n" + text, encoding="utf-8")
    return Simulation(load_model(path)).run()


def assert_about(results: Results, metric: str, truth: float, sharpness: float) -> None:
    """The truth lies in the interval, which is narrow enough for that to mean something."""
    found = results.intervals[metric]
    assert found.low <= truth <= found.high, (metric, truth, found)
    assert found.half < sharpness * truth, (metric, truth, found)


def stationary(rates: np.ndarray) -> np.ndarray:
    """The distribution of a Markov chain with these rates from row to column."""
    generator = rates - np.diag(rates.sum(axis=1))
    generator[:, 0] = 1.0
    right = np.zeros(len(rates))
    right[0] = 1.0
    return np.linalg.solve(generator.T, right)


def birth_and_death(births: list[float], deaths: list[float]) -> np.ndarray:
    weights = np.cumprod([1.0, *(birth / death for birth, death in zip(births, deaths, strict=True))])
    return weights / weights.sum()


# -- pools ----------------------------------------------------------------------------------------------------------

POOL = """
actors:
  customers: {{type: PoissonClock, mean_interval: 0.4 s, fire_at_start: false}}
  crew: {{type: Pool, capacity: 3{more}}}
  work: {{type: Server, servers: null, distribution: {{type: Exponential, mean: 1 s}}}}
  coming: {{type: Counter}}
  lost: {{type: Counter}}
connections:
  - customers.output -> crew.acquire, coming.increment
  - crew.granted -> work.input
  - crew.rejected, crew.balked, crew.reneged -> lost.increment
  - work.output -> crew.release
run: {{stop: 10000 s, seed: 4}}
metrics:
  waiting: {{of: crew.waiting, take: time_mean, initial: 0, after: 200 s, interval: 0.99}}
  in_use: {{of: crew.in_use, take: time_mean, initial: 0, after: 200 s, interval: 0.99}}
  served: {{of: work.output, take: rate, after: 200 s, interval: 0.99}}
"""


def test_a_pool_makes_a_queue_as_erlang_says(tmp_path: Path) -> None:
    load, servers = 2.5, 3
    results = results_of(POOL.format(more=""), tmp_path)
    states = [load**n / math.factorial(n) for n in range(servers)]
    all_busy = load**servers / math.factorial(servers) / (1 - load / servers)
    delayed = all_busy / (sum(states) + all_busy)  # Erlang C
    assert_about(results, "waiting", delayed * load / (servers - load), 0.35)
    assert_about(results, "in_use", load, 0.05)


def test_a_pool_without_room_loses_what_erlang_says(tmp_path: Path) -> None:
    states = [2.5**n / math.factorial(n) for n in range(4)]
    lost = states[-1] / sum(states)  # Erlang B
    results = results_of(POOL.format(more=", room: 0"), tmp_path)
    assert_about(results, "in_use", 2.5 * (1 - lost), 0.05)
    assert_about(results, "served", 2.5 * (1 - lost), 0.05)


@pytest.mark.parametrize(
    ("more", "joins", "leaves"),
    [
        (", patience: {type: Exponential, mean: 2 s}", lambda waiting: 1.0, lambda waiting: waiting / 2),
        (", balking: waiting / (waiting + 1)", lambda waiting: 1 / (waiting + 1), lambda waiting: 0.0),
        (", room: 4", lambda waiting: float(waiting < 4), lambda waiting: 0.0),
    ],
)
def test_those_who_do_not_wait(more: str, joins: object, leaves: object, tmp_path: Path) -> None:
    """M/M/3 as a birth and death process: with reneging M/M/3+M (Palm), discouraged arrivals, and M/M/3/7."""
    assert callable(joins)
    assert callable(leaves)
    births = [2.5 if n < 3 else 2.5 * joins(n - 3) for n in range(60)]
    deaths = [min(n, 3) + (leaves(n - 3) if n > 3 else 0.0) for n in range(1, 61)]
    chances = birth_and_death(births, deaths)
    results = results_of(POOL.format(more=more), tmp_path)
    assert_about(results, "waiting", sum(max(n - 3, 0) * p for n, p in enumerate(chances)), 0.15)
    assert_about(results, "served", sum(min(n, 3) * p for n, p in enumerate(chances)), 0.05)


def test_patience_that_a_token_brings_is_that_of_palm(tmp_path: Path) -> None:
    text = POOL.format(more=", patience: patience").replace(
        "  crew:", "  customer: {type: SetFields, draw: {patience: {type: Exponential, mean: 2 s}}}\n  crew:"
    )
    text = text.replace("customers.output -> crew.acquire", "customers.output -> customer.input")
    text = text.replace("connections:", "connections:\n  - customer.output -> crew.acquire")
    chances = birth_and_death([2.5] * 60, [min(n, 3) + max(n - 3, 0) / 2 for n in range(1, 61)])
    results = results_of(text, tmp_path)
    assert_about(results, "waiting", sum(max(n - 3, 0) * p for n, p in enumerate(chances)), 0.15)
    assert_about(results, "served", sum(min(n, 3) * p for n, p in enumerate(chances)), 0.05)


LOSSES = """
actors:
  comes: {type: PoissonClock, mean_interval: 0.4 s, fire_at_start: false}
  patient: {type: SetFields, draw: {lies: {type: Bernoulli, probability: 0.5}}, set: {number: token}}
  ward:
    type: Pools
    capacity: {doctor: 3, room: 2}
    amount: {doctor: 1, room: 1 if lies else 0}
    room: 0
    key: number
  work: {type: Server, servers: null, distribution: {type: Exponential, mean: 1 s}}
connections:
  - comes.output -> patient.input
  - patient.output -> ward.acquire
  - ward.granted -> work.input
  - work.output -> ward.release
run: {stop: 10000 s, seed: 4}
metrics:
  doctors: {of: ward.doctor_in_use, take: time_mean, initial: 0, after: 200 s, interval: 0.99}
  rooms: {of: ward.room_in_use, take: time_mean, initial: 0, after: 200 s, interval: 0.99}
"""


def test_several_pools_at_once_lose_what_kelly_says(tmp_path: Path) -> None:
    """A loss network: independent Poisson numbers of either class, given that they fit (Kelly 1991)."""
    weights = {
        (sitting, lying): 1.25 ** (sitting + lying) / math.factorial(sitting) / math.factorial(lying)
        for sitting in range(4)
        for lying in range(3)
        if sitting + lying <= 3
    }
    whole = sum(weights.values())
    results = results_of(LOSSES, tmp_path)
    assert_about(results, "doctors", sum((one + two) * weight for (one, two), weight in weights.items()) / whole, 0.05)
    assert_about(results, "rooms", sum(two * weight for (_, two), weight in weights.items()) / whole, 0.05)


CLASSES = """
actors:
  urgent: {{type: PoissonClock, mean_interval: 4 s, values: [0], fire_at_start: false}}
  usual: {{type: PoissonClock, mean_interval: 2 s, values: [1], fire_at_start: false}}
  comes: {{type: Merge}}
  job: {{type: SetFields, draw: {{work: {{type: Exponential, mean: 1 s}}}}, set: {{rank: token, came: time}}}}
  {queue}
  split: {{type: Router, policy: expression, channel: rank}}
  wait: {{type: Expression, expression: "time - job['came']", count: 2}}
  work: {{type: RecordDisassembler, fields: [work]}}
connections:
  - urgent.output, usual.output -> comes.input
  - comes.output -> job.input
  {wires}
  - split.output -> wait[0].job, wait[1].job
run: {{stop: 24000 s, seed: 6}}
metrics:
  urgent: {{of: "wait[0].output", take: mean, after: 400 s, interval: 0.99}}
  usual: {{of: "wait[1].output", take: mean, after: 400 s, interval: 0.99}}
  all: {{of: "wait[*].output", take: mean, after: 400 s}}
"""
WIRES = """- job.output -> {entrance}
  - {exit} -> work.input, split.input, server.input
  - work.work -> server.service_time
  - server.output -> {back}"""
BY_POOL = (
    "desk: {type: Pool, order: rank}\n  server: {type: Server, servers: null}",
    WIRES.format(entrance="desk.acquire", exit="desk.granted", back="desk.release"),
)
BY_LINE = (
    "line: {type: WaitingLine, order: ORDER, credits: 1}\n  server: {type: Server}",
    WIRES.format(entrance="line.input", exit="line.output", back="line.trigger"),
)


@pytest.mark.parametrize("queue", [BY_POOL, BY_LINE])
def test_priorities_are_what_cobham_says(queue: tuple[str, str], tmp_path: Path) -> None:
    actors, wires = queue
    results = results_of(CLASSES.format(queue=actors.replace("ORDER", "rank"), wires=wires), tmp_path)
    residual = 0.75 * 2 / 2
    assert_about(results, "urgent", residual / (1 - 0.25), 0.1)
    assert_about(results, "usual", residual / ((1 - 0.25) * (1 - 0.75)), 0.25)


def test_the_shortest_job_first_waits_as_phipps_says(tmp_path: Path) -> None:
    actors, wires = BY_LINE
    results = results_of(CLASSES.format(queue=actors.replace("ORDER", "work"), wires=wires), tmp_path)

    def wait(work: float) -> float:
        load = 0.75 * (1 - (1 + work) * math.exp(-work))  # of all that are shorter
        return math.exp(-work) * 0.75 / (1 - load) ** 2

    truth = integrate.quad(wait, 0, math.inf)[0]
    assert results.metrics["all"] == pytest.approx(truth, rel=0.06)
    assert truth < 0.55 * 0.75 / (1 - 0.75)  # first come, first served


PREEMPTION = """
composites:
  Class:
    parameters: {rank: {value: 0}, interval: {value: 4, unit: s}}
    inputs: [granted, preempted]
    outputs: [ask, done, stay]
    actors:
      arrivals: {type: PoissonClock, mean_interval: "${interval}", fire_at_start: false}
      job: {type: SetFields, draw: {work: {type: Exponential, mean: 1 s}}, set: {came: time}}
      line: {type: WaitingLine, credits: 1}
      worker:
        type: StateMachine
        variables: {left: 0, began: 0, came: 0}
        modes: [idle, asking, working]
        transitions:
          - "idle -> asking on job do left = job['work']; came = job['came']; ask = ${rank}"
          - asking -> working on granted do began = time
          - working -> asking on preempted do left = left - (time - began)
          - working -> idle after left do done = true; stay = time - came
    connections:
      - arrivals.output -> job.input
      - job.output -> line.input
      - line.output -> worker.job
      - granted -> worker.granted
      - preempted -> worker.preempted
      - worker.done -> done, line.trigger
      - worker.ask -> ask
      - worker.stay -> stay
actors:
  urgent: {type: Class, rank: 0, interval: 4 s}
  usual: {type: Class, rank: 1, interval: 2.5 s}
  desk: {type: Pool, order: token, preemptive: true}
connections:
  - urgent.ask, usual.ask -> desk.acquire
  - desk.granted -> urgent.granted, usual.granted
  - desk.preempted -> urgent.preempted, usual.preempted
  - urgent.done, usual.done -> desk.release
run: {stop: 16000 s, seed: 8}
metrics:
  urgent: {of: urgent.stay, take: mean, after: 400 s, interval: 0.99}
  usual: {of: usual.stay, take: mean, after: 400 s, interval: 0.99}
"""


def test_preemptive_priorities(tmp_path: Path) -> None:
    """M/M/1 with preemption that resumes: the urgent ones know of nobody else (Kleinrock, Queueing Systems II, 3.4)."""
    results = results_of(PREEMPTION, tmp_path)
    first, both = 0.25, 0.25 + 0.4
    assert_about(results, "urgent", 1 / (1 - first), 0.1)
    assert_about(results, "usual", (1 / (1 - first)) * (1 + both / (1 - both)), 0.25)


# -- routing --------------------------------------------------------------------------------------------------------

ROUTER = """
actors:
  customers: {{type: PoissonClock, mean_interval: 0.625 s, fire_at_start: false}}
  router: {{type: Router, {policy}}}
  desk: {{type: Server, count: 2, distribution: {{type: Exponential, mean: 1 s}}}}
  number: {{type: Counter}}
connections:
  - customers.output -> router.input, number.increment
  - router.output -> desk[*].input
  - desk[*].output => number.decrement
  {wires}
run: {{stop: 30000 s, seed: 2}}
metrics:
  number: {{of: number.output, take: time_mean, initial: 0, after: 300 s, interval: 0.99}}
  first: {{of: "desk[0].output", take: rate, interval: 0.99}}
"""


def test_the_shortest_queue_is_as_short_as_its_markov_chain_says(tmp_path: Path) -> None:
    size, rate = 40, 1.6
    rates = np.zeros((size * size, size * size))
    for one in range(size):
        for other in range(size):
            here = one * size + other
            for share, to in ((1 if one < other else 0.5 * (one == other), (one + 1, other)),
                              (1 if other < one else 0.5 * (one == other), (one, other + 1))):  # fmt: skip
                if max(to) < size:
                    rates[here, to[0] * size + to[1]] += rate * share
            if one:
                rates[here, here - size] += 1
            if other:
                rates[here, here - 1] += 1
    chances = stationary(rates).reshape(size, size)
    counts = np.arange(size)
    truth = float((chances * (counts[:, None] + counts[None, :])).sum())
    assert truth == pytest.approx(4.73, abs=0.1)  # between M/M/2 with 4.44 and two M/M/1 with 8
    results = results_of(
        ROUTER.format(policy="policy: shortest queue", wires="- desk[*].size -> router.load"), tmp_path
    )
    assert_about(results, "number", truth, 0.2)


def test_weights_share_the_load(tmp_path: Path) -> None:
    policy = "policy: random, weights: [0.45, 0.55]"
    results = results_of(ROUTER.format(policy=policy, wires="").replace("0.625", "0.8"), tmp_path)
    loads = 1.25 * 0.45, 1.25 * 0.55
    assert_about(results, "number", sum(load / (1 - load) for load in loads), 0.25)
    assert_about(results, "first", loads[0], 0.05)


# -- links ----------------------------------------------------------------------------------------------------------

LINK = """
actors:
  frames: {{type: PoissonClock, mean_interval: 2 s, fire_at_start: false}}
  urgent: {{type: SetFields, draw: {{rank: {{type: RandomInteger}}}}, set: {{came: time, port: 0}}}}
  link: {{{link}}}
  stay: {{type: Expression, expression: "time - frame['came']", count: 2}}
  split: {{type: Router, policy: expression, channel: rank}}
connections:
  - frames.output -> urgent.input
  - urgent.output -> link.input
  - link.output -> split.input
  - split.output -> stay[*].frame
run: {{stop: 30000 s, seed: 3}}
metrics:
  waiting: {{of: link.waiting, take: time_mean, initial: 0, after: 300 s, interval: 0.99}}
  first: {{of: "stay[0].output", take: mean, after: 300 s, interval: 0.99}}
  last: {{of: "stay[1].output", take: mean, after: 300 s, interval: 0.99}}
"""


@pytest.mark.parametrize(
    ("link", "delay"),
    [
        ("type: Link, rate: 1 kbit/s, size: 1000, delay: 3 s, order: rank", 3.0),
        ("type: NetworkSwitch, rate: 1 kbit/s, size: 1000, port: port, order: rank, latency: 1 s", 1.0),
    ],
)
def test_links_and_switches_are_m_d_1_with_priorities(link: str, delay: float, tmp_path: Path) -> None:
    results = results_of(LINK.format(link=link), tmp_path)
    residual = 0.5 / 2
    assert_about(results, "waiting", 0.5 * residual / (1 - 0.5), 0.12)
    assert_about(results, "first", delay + 1 + residual / (1 - 0.25), 0.05)
    assert_about(results, "last", delay + 1 + residual / ((1 - 0.25) * (1 - 0.5)), 0.05)


ARQ = """
actors:
  source: {{type: SingleEvent}}
  many: {{type: Repeat, times: 20000}}
  sender: {{type: ArqSender, window: {window}, timeout: {timeout}, repeat: {repeat}, spacing: 1 s}}
  there: {{type: Link, rate: 1 kbit/s, size: 1000, delay: 3 s, loss: 0.2}}
  receiver: {{type: ArqReceiver, repeat: {repeat}}}
  back: {{type: Link, delay: 3 s}}
connections:
  - source.output -> many.input
  - many.output -> sender.input
  - sender.output -> there.input
  - there.output -> receiver.input
  - receiver.ack -> back.input
  - back.output -> sender.ack
run: {{stop: {stop}, seed: 1}}
metrics:
  throughput: {{of: receiver.output, take: rate, after: 100 s, interval: 0.99}}
"""


@pytest.mark.parametrize(
    ("window", "timeout", "repeat", "truth"),
    [
        # A frame takes 1 s, an acknowledgement comes after 7 s: a = 3.  One try in five fails and takes the timeout.
        (1, "9 s", "all", 1 / (7 + 0.25 * 9)),
        (1, "7.001 s", "all", 0.8 / 7.001),  # (1 - p) / (1 + 2 a)
        # The window is just open all the time, and who is lost has let the window pass in vain.
        (7, "7.001 s", "all", 0.8 / (0.8 + 0.2 * 7.001)),  # (1 - p) / (1 - p + N p)
    ],
)
def test_arq_delivers_as_much_as_the_formulas_say(
    window: int, timeout: str, repeat: str, truth: float, tmp_path: Path
) -> None:
    text = ARQ.format(window=window, timeout=timeout, repeat=repeat, stop="15000 s")
    assert_about(results_of(text, tmp_path), "throughput", truth, 0.06)


def test_arq_with_a_limit_abandons_what_fails_as_often(tmp_path: Path) -> None:
    text = ARQ.format(window=1, timeout="9 s, tries: 2", repeat="all", stop="40000 s")
    text += "  abandoned: {of: sender.abandoned, take: rate, after: 100 s, interval: 0.99}\n"
    results = results_of(text, tmp_path)
    time = 0.8 * 7 + 0.16 * (9 + 7) + 0.04 * 18  # of a token
    assert_about(results, "throughput", 0.96 / time, 0.06)
    assert_about(results, "abandoned", 0.04 / time, 0.25)


def test_selective_repeat_sends_nothing_twice_that_has_arrived(tmp_path: Path) -> None:
    # A window that is never closed: (1 - p).
    text = ARQ.format(window=200, timeout="7.001 s", repeat="one", stop="15000 s")
    assert_about(results_of(text, tmp_path), "throughput", 0.8, 0.06)
