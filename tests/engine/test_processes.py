"""Actors written as SimPy generators."""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Generator
from typing import Any

import pytest
import simpy

from epicycle.runner.execution.engine import ActorError, Results
from tests.engine.engine_parts import Script, seen, sends, simulate

Behaviour = Callable[[Script], Generator[Any, Any, None]]
ALONE = "actors: {a: {type: Script}, probe: {type: Probe}}\nconnections: [a.output -> probe.input]\n"
FED = "actors: {t: {type: Ticker}, a: {type: Script}}\nconnections: [t.output -> a.input]\n"


@pytest.fixture
def behave(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Results]:
    def run(behaviour: Behaviour, text: str = ALONE, until: float = 5) -> Results:
        monkeypatch.setattr(Script, "behaviour", staticmethod(behaviour))
        return simulate(text, until=until)[1]

    return run


def test_a_clock_and_a_gain_send_as_reactive_ones_do(monkeypatch: pytest.MonkeyPatch) -> None:
    class Tick(Script):
        def run(self) -> Generator[Any, Any, None]:
            count = 0
            while True:
                self.output.send(count)
                count += 1
                yield self.wait(0.1)

    class Twice(Script):
        def run(self) -> Generator[Any, Any, None]:
            while True:
                token = yield self.read(self.input)
                self.output.send(2.0 * token)

    text = """
actors: {{t: {{type: {}, {}}}, g: {{type: {}, {}}}, slow: {{type: {}, {}}}, probe: {{type: Probe}}}}
connections:
  - t.output -> g.input
  - {{from: t.output, to: slow.input, delay: 0.25 s}}
  - {{from: g.output, to: probe.input, delay: 0}}
  - slow.output -> probe.input
"""
    reactive = simulate(text.format("Ticker", "period: 0.1", "Scale", "factor: 2", "Scale", "factor: 2"), until=2)
    process = simulate(
        text.format("Tick", "", "Twice", "", "Twice", "").replace(", }", "}"), until=2, types=[Tick, Twice]
    )
    assert sends(reactive[1]) == sends(process[1])
    assert seen(reactive[0]) == seen(process[0])
    assert reactive[1].digest == process[1].digest


def test_wait_zero_is_the_next_microstep(behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        for item in "abc":
            self.output.send(item)
            yield self.wait(0)

    assert [row[:2] + row[3:] for row in sends(behave(behaviour))] == [(0.0, 1, "a"), (0.0, 2, "b"), (0.0, 3, "c")]


def test_tokens_queue_up_until_they_are_read(behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        yield self.wait(2.5)
        while True:
            token = yield self.read(self.input)
            self.output.send(token)

    results = behave(behaviour, FED, 4)
    assert [(t, m, v) for t, m, _, v in sends(results, "a")] == [
        (2.5, 1, 0), (2.5, 1, 1), (2.5, 1, 2), (3.0, 1, 3), (4.0, 1, 4)
    ]  # fmt: skip


def test_a_read_that_lost_a_race_takes_no_token(behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        yield self.read(self.input)  # the token of 0 s
        read = self.read(self.input)
        done = yield read | self.wait(0.5)
        assert read not in done
        yield self.wait(2)  # meanwhile two tokens come
        for _ in range(2):
            self.output.send((yield self.read(self.input)))

    assert [row[3] for row in sends(behave(behaviour, FED), "a")] == [1, 2]


def test_a_read_made_early_gets_its_token(behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        read = self.read(self.input)
        yield self.wait(2.5)
        self.output.send((yield read))
        self.output.send((yield self.read(self.input)))

    assert [row[3] for row in sends(behave(behaviour, FED), "a")] == [0, 1]


def test_simpy_resources_conditions_and_interrupts(behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        environment = self.environment
        desk = simpy.Resource(environment, capacity=1)

        def customer(name: str, stay: int) -> Generator[Any, Any, None]:
            with desk.request() as request:
                yield request
                yield environment.timeout(stay)
                self.output.send(f"{name} leaves")

        yield environment.process(customer("a", 1)) & environment.process(customer("b", 1))
        self.output.send("both")

        def sleeper() -> Generator[Any, Any, None]:
            try:
                yield environment.timeout(1000)
            except simpy.Interrupt as interrupt:
                self.output.send(interrupt.cause)

        asleep = environment.process(sleeper())
        yield self.wait(1)
        asleep.interrupt("woken")
        yield asleep
        yield self.wait(0.5) | self.wait(7)
        self.output.send("end")

    results = behave(behaviour)
    assert [(t, m, v) for t, m, _, v in sends(results)] == [
        (1.0, 1, "a leaves"),
        (2.0, 1, "b leaves"),
        (2.0, 1, "both"),
        (3.0, 2, "woken"),  # SimPy interrupts after the firing at (3 s, 1)
        (3.5, 2, "end"),  # a condition is SimPy's, too
    ]


def test_what_simpy_resumed_sends_at_the_first_open_microstep(behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        yield self.environment.timeout(1)
        self.output.send("timeout")  # before the director has handled anything at 1 s
        yield self.wait(0)
        yield self.environment.timeout(0)
        self.output.send("again")  # after it has

    model, results = simulate_with(behave, behaviour)
    assert [row[:2] for row in sends(results)] == [(1.0, 1), (1.0, 2)]
    assert [row[:2] for row in seen(model)] == [(1.0, 1), (1.0, 2)]


def simulate_with(behave: Callable[..., Results], behaviour: Behaviour) -> Any:
    behave(behaviour)  # leaves the behaviour in place
    return simulate(ALONE, until=5)


@pytest.mark.parametrize(
    ("delay", "nanoseconds"),
    [(1, 10**9), (0.1, 10**8), (1e-9, 1), (0.4e-9, 0), (0.5e-9, 0), (1.5e-9, 2), (1.6e-9, 2), (True, 10**9)],
)
def test_delays_are_rounded_to_nanoseconds(delay: float, nanoseconds: int, behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        before = self.environment.now
        yield self.environment.timeout(delay)
        self.output.send(self.environment.now - before)

    (record,) = behave(behaviour).log.records
    assert (record.tag.time, record.value) == (nanoseconds, nanoseconds / 1e9)


@pytest.mark.parametrize(
    ("delay", "reason"),
    [
        (-1, "ValueError: Negative delay -1"),
        (math.nan, "ValueError: nan is not a time"),
        (1e12, "ValueError: 1e+12 s is out of range; the latest time is 4.61169e+09 s"),
    ],
)
def test_what_is_no_delay(delay: float, reason: str, behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        yield self.wait(2)
        yield self.environment.timeout(delay)

    with pytest.raises(ActorError) as caught:
        behave(behaviour)
    assert str(caught.value).splitlines()[0] == f"a failed in run() at (2 s, 1): {reason}"


def test_a_timeout_without_an_end_never_happens(behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        yield self.environment.timeout(3)
        yield self.environment.timeout(math.inf) | self.environment.timeout(0.5)
        self.output.send(self.environment.peek())
        yield self.environment.timeout(math.inf)
        self.output.send("never")

    assert [(time, token) for time, _, _, token in sends(behave(behaviour))] == [(3.5, math.inf)]


@pytest.mark.parametrize("call", ["run", "step"])
def test_time_is_let_pass_by_the_director_alone(call: str, behave: Callable[..., Results]) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        yield self.wait(1)
        getattr(self.environment, call)()

    with pytest.raises(ActorError) as caught:
        behave(behaviour)
    assert str(caught.value).splitlines()[0] == (
        "a failed in run() at (1 s, 1): RuntimeError: the director lets time pass: yield events, and give the model a "
        f"stop time instead of {call}()"
    )


def shop(environment: Any, say: Callable[[str], None]) -> Generator[Any, Any, None]:
    """All that SimPy has, in one program."""
    desk, machine = simpy.Resource(environment, 1), simpy.PreemptiveResource(environment, 1)
    line, tank = simpy.PriorityResource(environment, 1), simpy.Container(environment, 10, init=0)
    box, shelf = simpy.Store(environment, 1), simpy.FilterStore(environment)
    heap = simpy.PriorityStore(environment)

    def customer(number: int, patience: float) -> Generator[Any, Any, None]:
        yield environment.timeout(0.25 * number)
        with desk.request() as request:
            found = yield request | environment.timeout(patience)
            if request in found:
                yield environment.timeout(0.7)
            say(f"customer {number} {'served' if request in found else 'gone'} {environment.now:.9g}")

    def job(name: str, start: float, priority: int) -> Generator[Any, Any, None]:
        yield environment.timeout(start)
        left = 2.5
        while left > 0:
            with machine.request(priority=priority) as request:
                yield request
                begun = environment.now
                try:
                    yield environment.timeout(left)
                    left = 0.0
                except simpy.Interrupt as interrupt:
                    left -= environment.now - begun
                    say(f"{name} preempted, in use since {interrupt.cause.usage_since:.9g}, {left:.9g} left")
        say(f"{name} done {environment.now:.9g}")

    def guest(number: int) -> Generator[Any, Any, None]:
        with line.request(priority=-number) as request:
            yield request
            yield environment.timeout(0.125)
            say(f"guest {number} {environment.now:.9g}")

    def maker() -> Generator[Any, Any, None]:
        for number in range(3):
            yield environment.timeout(0.3)
            yield box.put(number)
            yield tank.put(2.5)
            yield shelf.put(number)
            yield heap.put(simpy.PriorityItem(-number, f"item {number}"))

    def taker() -> Generator[Any, Any, None]:
        first = yield box.get()
        yield tank.get(5)
        say(f"tank {tank.level} {environment.now:.9g}")
        odd = yield shelf.get(lambda each: each % 2 == 1)
        say(f"took {odd} and {first} {environment.now:.9g}")
        second = yield box.get()
        urgent = yield heap.get()
        say(f"{second} {urgent.item} {environment.now:.9g}")

    parts = [environment.process(customer(number, 0.6)) for number in range(4)]
    parts += [environment.process(job("slow", 0, 1)), environment.process(job("urgent", 1.1, 0))]
    parts += [environment.process(guest(number)) for number in range(3)]
    parts += [environment.process(maker()), environment.process(taker())]
    signal = environment.event()

    def alarm() -> Generator[Any, Any, None]:
        yield environment.timeout(0.9)
        signal.succeed("now")

    environment.process(alarm())
    say(f"{(yield signal)} {environment.now:.9g}")
    try:
        failed = environment.event().fail(KeyError("k"))
        yield failed
    except KeyError as error:
        say(f"{error!r} {environment.active_process is not None}")
    yield environment.all_of(parts)
    yield environment.any_of([environment.timeout(1, "a"), environment.timeout(2, "b")])
    say(f"end {environment.now:.9g}")


def test_a_program_does_what_it_does_in_simpy_alone(behave: Callable[..., Results]) -> None:
    """All delays are multiples of a nanosecond, so that rounding changes no event."""
    alone, inside = list[str](), list[str]()
    environment = simpy.Environment()
    environment.process(shop(environment, alone.append))
    environment.run()
    behave(lambda self: shop(self.environment, inside.append), until=60)
    assert inside == alone
    assert alone[-1].startswith("end")


def test_stop_when_from_a_process_finishes_the_tag(behave: Callable[..., Results], monkeypatch: Any) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        yield self.environment.timeout(1)
        self.output.send(1)
        yield self.wait(1)
        self.output.send(2)

    monkeypatch.setattr(Script, "behaviour", staticmethod(behaviour))
    simulation, results = simulate(ALONE + "run: {stop_when: a.output}\n")
    assert (results.stopped, results.end) == ("stop_when", 1.0)
    assert seen(simulation) == [(1.0, 1, (1,))]


def test_a_process_is_halted_in_the_step_in_which_what_it_waits_for_happens(behave: Callable[..., Results]) -> None:
    """Two wait for the same event; the first one that goes on ends the other."""
    both: list[Script] = []

    def behaviour(actor: Script) -> Generator[Any, Any, None]:
        if not both:
            shared.append(actor.environment.timeout(5))
        both.append(actor)
        yield shared[0]
        [other] = [each for each in both if each is not actor]
        other.halt()
        other.halt()  # it is over
        actor.output.send(actor.path)

    shared: list[Any] = []
    results = behave(behaviour, "actors: {a: {type: Script}, b: {type: Script}}")
    assert [token for *_, token in sends(results)] == ["a"]


@pytest.mark.slow
def test_a_process_that_nobody_else_knows_goes_on_waiting_for_a_token(behave: Callable[..., Results]) -> None:
    def behaviour(actor: Script) -> Generator[Any, Any, None]:
        actor.environment.process(hear(actor))
        for _ in range(4):
            yield actor.wait(0.3)
            gc.collect()  # a process of SimPy's and the event it waits for hold each other alone

    def hear(actor: Script) -> Generator[Any, Any, None]:
        while True:
            token = yield actor.read(actor.input)
            actor.output.send(token)

    results = behave(
        behaviour, FED.replace("}}", "}, probe: {type: Probe}}").replace("input]", "input, a.output -> probe.input]")
    )
    assert len(sends(results, "a")) == len(sends(results, "t")) > 3


def test_time_goes_on_from_a_tag_at_which_a_process_alone_sends_by_a_delay_of_0(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Nobody fires at the tag at which SimPy resumes the process: its next microstep still comes before any later time.
    def behaviour(actor: Script) -> Generator[Any, Any, None]:
        yield actor.environment.timeout(0.5)
        actor.output.send("x")

    monkeypatch.setattr(Script, "behaviour", staticmethod(behaviour))
    text = (
        "actors: {a: {type: Script}, probe: {type: Probe}, t: {type: Ticker, limit: 2}, late: {type: Probe}}\n"
        "connections: [{from: a.output, to: probe.input, delay: 0 s}, t.output -> late.input]\n"
    )
    simulation, results = simulate(text, until=5)
    assert seen(simulation) == [(0.5, 2, ("x",))]
    assert seen(simulation, "late") == [(0.0, 1, (0,)), (1.0, 1, (1,))]
    tags = [record.tag for record in results.log.records]
    assert tags == sorted(tags)
    assert results.end == 1.0
