"""Processors against a schedule made slot by slot, response-time analysis, the EDF bound and queueing theory."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from epicycle.actors import PoissonClock, Sequence
from epicycle.aspects import ExecutionTime, Processor
from epicycle.runner import Model, ModelError, Simulation
from epicycle.runner.execution.engine import Results
from tests.engine.engine_parts import Scale, Ticker, load, simulate

Task = tuple[int, int]  # period and execution time in ms


def tasks_on(processor: Processor, tasks: list[Task], stop: int) -> Results:
    """A run in which periodic tasks, all released at 0, share a processor; times in ms."""
    model = Model("tasks", stop=stop / 1000)
    for number, (period, _) in enumerate(tasks):
        ticker = model.add(Ticker(f"t{number}", period=period / 1000))
        model.connect(ticker.output, model.add(Scale(f"a{number}")).inputs["input"])
    model.weave("cpu", processor, at=[f"a{number}" for number in range(len(tasks))])
    return Simulation(model, keep_log=True).run()


def responses(results: Results, actor: str) -> list[int]:
    """The response times of an actor, in ms; each must be a whole number."""
    found = [r.value * 1000 for r in results.log.records if r.event == "delayed" and r.actor == actor]
    assert found == pytest.approx([round(each) for each in found], abs=1e-6)
    return [round(each) for each in found]


def completions(results: Results) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for record in results.log.records:
        if record.event == "send" and record.actor.startswith("a"):
            found.setdefault(record.actor, []).append(round(record.tag.time / 1e6))
    return found


def given(tasks: list[Task], **more: Any) -> Processor:
    return Processor(times={f"a{i}": time / 1000 for i, (_, time) in enumerate(tasks)}, **more)


def drawn(seed: int, load: float) -> list[Task]:
    """Periodic tasks with short hyperperiods and about this utilisation."""
    draw = np.random.default_rng(seed)
    periods = draw.choice([4, 5, 6, 8, 10, 12, 15, 20, 24, 30], size=draw.integers(2, 6)).tolist()
    return [(period, max(1, int(load * period / len(periods)))) for period in periods]


# -- against a schedule that is made slot by slot -------------------------------------------------------------------


def by_slots(tasks: list[Task], urgency: list[float] | None, *, edf: bool, preemptive: bool, stop: int) -> Any:
    """When each job is over, by a processor that looks around every millisecond."""
    jobs: list[list[Any]] = []  # [urgency, number, task, left]
    over: dict[str, list[int]] = {}
    running = None
    for now in range(stop):
        for number, (period, time) in enumerate(tasks):
            if now % period == 0:
                key = now + period if edf else 0.0 if urgency is None else urgency[number]
                jobs.append([key, len(over) + now * len(tasks) + number, number, time])
        if running is None or preemptive:
            running = min(jobs, default=None, key=lambda job: (job[0], job[1]))
        if running is not None:
            running[3] -= 1
            if running[3] == 0:
                over.setdefault(f"a{running[2]}", []).append(now + 1)
                jobs.remove(running)
                running = None
    return over


@pytest.mark.parametrize("policy", ["fcfs", "priority", "edf"])
@pytest.mark.parametrize("preemptive", [True, False])
@pytest.mark.parametrize("load", [0.6, 0.95, 1.4])
def test_schedules(policy: str, preemptive: bool, load: float) -> None:
    for seed in range(8):
        tasks = drawn(seed, load)
        urgency = (
            np.random.default_rng(seed).choice([1.0, 2.0, 3.0], len(tasks)).tolist() if policy == "priority" else None
        )
        processor = given(
            tasks,
            policy=policy,
            preemptive=preemptive,
            priorities={f"a{i}": each for i, each in enumerate(urgency or ())},
            deadlines={f"a{i}": period / 1000 for i, (period, _) in enumerate(tasks)},
        )
        # A job that is over when another comes at the same millisecond is over first, so one slot is as good as any.
        expected = by_slots(tasks, urgency, edf=policy == "edf", preemptive=preemptive, stop=239)
        found = completions(tasks_on(processor, tasks, 239))
        assert found == expected, (seed, tasks)


# -- response-time analysis -----------------------------------------------------------------------------------------


def worst(tasks: list[Task], number: int) -> int:
    """The least R = C + sum over the more urgent of ceil(R / T) C, where a smaller number is more urgent."""
    response = 0
    while True:
        longer = tasks[number][1] + sum(math.ceil(response / period) * time for period, time in tasks[:number])
        if longer in (response, 0) or longer > 1000:
            return longer
        response = longer


@pytest.mark.parametrize("seed", range(12))
def test_preemptive_fixed_priorities(seed: int) -> None:
    """All are released at once at 0, which is the worst that can happen to them."""
    tasks = sorted(drawn(seed, 0.9))
    processor = given(tasks, policy="priority", priorities={f"a{i}": i for i in range(len(tasks))})
    results = tasks_on(processor, tasks, 500)
    for number, (period, _) in enumerate(tasks):
        longest = worst(tasks, number)
        found = responses(results, f"a{number}")
        assert found[0] == longest
        if longest <= period:  # the analysis says nothing of later ones otherwise
            assert max(found) == longest


def test_a_textbook_case() -> None:
    """Periods 7, 12, 20 and times 3, 3, 5: responses 3, 6, 20 (Buttazzo, Hard Real-Time Computing Systems)."""
    tasks = [(7, 3), (12, 3), (20, 5)]
    assert [worst(tasks, number) for number in range(3)] == [3, 6, 20]
    processor = given(
        tasks,
        policy="priority",
        priorities={f"a{i}": i for i in range(3)},
        deadlines={f"a{i}": period / 1000 for i, (period, _) in enumerate(tasks)},
    )
    results = tasks_on(processor, tasks, 7 * 60)
    assert [max(responses(results, f"a{number}")) for number in range(3)] == [3, 6, 20]
    assert results.aspects["cpu"]["missed"] == 0
    assert results.aspects["cpu"]["max_response"] == 0.02
    assert results.aspects["cpu"]["utilisation"] == pytest.approx(3 / 7 + 3 / 12 + 5 / 20, abs=1e-12)
    first = [(r.tag.seconds, r.event, r.actor, r.value) for r in results.log.records if r.event != "send"][:7]
    assert first == [
        (0.003, "delayed", "a0", 0.003),
        (0.006, "delayed", "a1", 0.006),
        (0.007, "preempted", "a2", 0.004),
        (0.01, "delayed", "a0", 0.003),
        (0.012, "preempted", "a2", 0.002),
        (0.014, "preempted", "a1", 0.001),
        (0.017, "delayed", "a0", 0.003),
    ]


# -- earliest deadline first ----------------------------------------------------------------------------------------

FULL = [
    [(2, 1), (4, 2)],
    [(3, 1), (4, 1), (12, 5)],
    [(4, 2), (6, 3)],
    [(5, 2), (10, 3), (20, 6)],
    [(2, 1), (3, 1), (6, 1)],
]  # utilisation 1


@pytest.mark.parametrize("tasks", FULL)
def test_edf_misses_nothing_up_to_a_utilisation_of_1(tasks: list[Task]) -> None:
    assert sum(time / period for period, time in tasks) == pytest.approx(1)
    deadlines = {f"a{i}": period / 1000 for i, (period, _) in enumerate(tasks)}
    results = tasks_on(given(tasks, policy="edf", deadlines=deadlines), tasks, 1200)
    assert results.aspects["cpu"]["missed"] == 0
    assert results.aspects["cpu"]["utilisation"] == 1.0
    more = [*tasks[:-1], (tasks[-1][0], tasks[-1][1] + 1)]
    late = tasks_on(given(more, policy="edf", deadlines=deadlines), more, 1200)
    assert late.aspects["cpu"]["missed"] > 0
    lateness = [r.value for r in late.log.records if r.event == "missed"]
    assert min(lateness) >= 0.001


def test_rate_monotonic_misses_where_edf_does_not() -> None:
    tasks = [(4, 2), (6, 3)]
    deadlines = {f"a{i}": period / 1000 for i, (period, _) in enumerate(tasks)}
    results = tasks_on(given(tasks, policy="priority", priorities={"a0": 1}, deadlines=deadlines), tasks, 120)
    assert results.aspects["cpu"]["missed"] > 0


# -- queueing theory ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("time", "squared"),
    [
        (0.7, 0.7**2),  # M/D/1
        ({"type": "Exponential", "mean": "700 ms"}, 2 * 0.7**2),  # M/M/1
    ],
)
def test_one_queue_for_all(time: Any, squared: float) -> None:
    """Pollaczek-Khinchine over two actors that share a processor: R = s + a E[s^2] / (2 (1 - a s)), a = 0.4 + 0.5."""
    means, loads = [], []
    for seed in range(10):
        model = Model("queue", stop=1500, seed=seed)
        for name, interval in (("a", 2.5), ("b", 2.0)):
            clock = model.add(PoissonClock(f"clock_{name}", mean_interval=interval, fire_at_start=False))
            model.connect(clock.output, model.add(Scale(name)).inputs["input"])
        model.weave("cpu", Processor(times={"*": time}), at=["a", "b"])
        figures = Simulation(model).run().aspects["cpu"]
        means.append(figures["mean_response"])
        loads.append(figures["utilisation"])
    for values, mean in ((means, 0.7 + 0.9 * squared / 2 / (1 - 0.63)), (loads, 0.63)):
        error = stats.sem(values) * stats.t.ppf(0.9995, len(values) - 1)
        assert abs(np.mean(values) - mean) < error < 0.2 * mean


# -- the rest -------------------------------------------------------------------------------------------------------


def test_windows_keep_the_order() -> None:
    """What falls due while the processor is not active takes no time, behind the earlier ones of its actor."""
    text = """
actors: {t: {type: Ticker, period: 1 s}, a: {type: Scale}, b: {type: Scale}}
connections: [t.output -> a.input, t.output -> b.input]
aspects: {cpu: {type: Processor, time: 1.2 s, until: 2 s, at: [a, b]}}
run: {stop: 6 s}
"""
    _, results = simulate(text)
    sent = {name: [r.tag.seconds for r in results.log.records if (r.event, r.actor) == ("send", name)] for name in "ab"}
    assert sent == {"a": [1.2, 3.6, 4.8, 4.8, 4.8, 5.0, 6.0], "b": [2.4, 4.8, 4.8, 4.8, 4.8, 5.0, 6.0]}


def test_behind_another_aspect_and_over_arrays() -> None:
    text = """
actors: {t: {type: Ticker, period: 1 s, limit: 1}, a: {type: Scale, count: 3}, none: {type: Scale, count: 0}}
connections: ["t.output -> a[*].input"]
aspects:
  late: {type: ExecutionTime, time: 0.5 s, at: "a[1]"}
  cpu: {type: Processor, times: {"a[*]": 1 s, "a[2]": 250 ms, "none[*]": 1 s}, at: ["a[*]", "none[*]"]}
run: {stop: 6 s}
"""
    _, results = simulate(text)
    sent = [(r.tag.seconds, r.actor) for r in results.log.records if r.event == "send" and r.actor != "t"]
    assert sent == [(1.0, "a[0]"), (1.25, "a[2]"), (2.25, "a[1]")]


PAIR = """
actors: {{t: {{type: Ticker}}, a: {{type: Scale}}, b: {{type: Scale}}}}
connections: [t.output -> a.input, t.output -> b.input]
aspects:
  cpu: {{type: Processor, at: "**"}}
  {}
run: {{stop: 1 s}}
"""


@pytest.mark.parametrize(
    ("aspect", "message"),
    [
        (
            "more: {type: Processor, at: [b, a]}",
            (
                "7:3: error: aspect more: a already runs on the processor 'cpu'\n"
                "   help: an actor has one processor: exclude it here, with '!a', or there"
            ),
        ),
        (
            "more: {type: Processor, at: '!**', times: {c: 1}}",
            "7:46: error: aspect more: times: 'c' matches no actor",
        ),
        (
            "more: {type: Processor, at: a, times: {a: 1 m}}",
            (
                "7:45: error: aspect more.times: a: '1 m' is a length, expected a time in s"
            ),
        ),
        (
            "more: {type: Processor, at: a, times: {a: soon}}",
            "7:45: error: aspect more.times: a: 'soon' is neither a time in s nor a distribution {type: ..., ...}",
        ),
        (
            "more: {type: Processor, at: a, times: {a: -1}}",
            (
                "7:45: error: aspect more.times: a: -1 is out of bounds, expected a time in s >= 0, a distribution, "
                "or a mapping of input ports to these"
            ),
        ),
        (
            "more: {type: Processor, at: a, times: {a: {trigger: 1}}}",
            """7:46: error: aspect more: times: a: no actor that this applies to has an input 'trigger'
   help: their inputs: input""",
        ),
        (
            "more: {type: Processor, at: a, priorities: [1]}",
            "7:46: error: aspect more.priorities: [1] is not a mapping from actors to numbers",
        ),
        (
            "more: {type: Processor, at: a, policy: rr}",
            "7:42: error: aspect more.policy: 'rr' is not one of fcfs, priority, edf",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong(aspect: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        load(PAIR.format(aspect))
    told = [line for line in str(caught.value).splitlines() if "error:" in line or line.strip().startswith("help:")]
    assert message in "\n".join(line[line.index("m.yaml:") + 7 :] if "m.yaml:" in line else line for line in told)


def test_two_processors_in_python() -> None:
    model = Model("m", stop=1)
    model.add(Sequence("s", values=[1]))
    model.weave("one", Processor(time=1), at="s")
    model.weave("slow", ExecutionTime(time=1), at="s")
    model.weave("two", Processor(time=1), at="s")
    with pytest.raises(ModelError) as caught:
        Simulation(model)
    assert "aspect two: s already runs on the processor 'one'" in str(caught.value)


def test_figures_of_a_processor_to_the_nanosecond() -> None:
    text = (
        "actors: {t: {type: Ticker, period: 10 ms}, a: {type: Scale}, b: {type: Scale}}\n"
        "connections: ['t.output -> a.input, b.input']\n"
        "aspects: {cpu: {type: Processor, time: 2 ms, at: [a, b]}}"
    )
    _, results = simulate(text, until=0.02)
    figures = results.aspects["cpu"]
    assert figures["mean_response"] == 0.003  # 2 ms and 4 ms; those of 20 ms are not over
    assert figures["max_response"] == 0.004
    assert figures["utilisation"] == 0.4
    _, results = simulate(text, until=0.015)  # at rest since 14 ms
    assert results.aspects["cpu"]["utilisation"] == 8 / 15


def test_what_is_put_back_before_it_has_begun_is_not_preempted() -> None:
    """Both are released at once: the first one in the order of the model begins, and makes way within the tag."""
    _, results = simulate(
        "actors: {t: {type: Ticker, period: 10 ms}, a: {type: Scale}, b: {type: Scale}}\n"
        "connections: ['t.output -> a.input, b.input']\n"
        "aspects: {cpu: {type: Processor, policy: priority, preemptive: true, time: 2 ms, at: [a, b],"
        " priorities: {a: 2, b: 1}}}",
        until=0.008,
    )
    assert responses(results, "b") == [2]
    assert responses(results, "a") == [4]
    assert results.aspects["cpu"]["preempted"] == 0
