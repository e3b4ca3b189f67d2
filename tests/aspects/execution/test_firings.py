"""A firing that is put off: what it sees, whom it is for, and what leaves no trace."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest

from epicycle.actors import Actor, InputPort, OutputPort, PortParameter
from epicycle.aspects import CommunicationAspect, ExecutionAspect, Job
from epicycle.aspects.execution import ActorPoint
from epicycle.runner import ActorError, Simulation, load_model
from epicycle.runner.execution.engine import Tracer
from tests.aspects.execution.execution_parts import CHAIN, acts, chain, sent
from tests.aspects.strengths import AT_ZERO
from tests.engine.engine_parts import TYPES, Plan, Script, load, seen, simulate


def test_an_actor_sees_the_tokens_of_then_and_the_time_of_now(monkeypatch: pytest.MonkeyPatch) -> None:
    fired: list[tuple[float, tuple[Any, ...], list[bool]]] = []

    def begin(self: Plan) -> None:
        self.wakes = [self.wake_at(time) for time in (0.5, 1.0, 2.5, 2.6)]

    def act(self: Plan) -> None:
        fired.append((round(self.now, 9), self.input.tokens, [wake.due for wake in self.wakes]))
        if len(fired) == 4:
            self.wakes[2].cancel()

    monkeypatch.setattr(Plan, "begin", begin)
    monkeypatch.setattr(Plan, "act", act)
    simulate(
        """
        actors: {t: {type: Ticker}, plan: {type: Plan}}
        connections: [t.output -> plan.input]
        aspects: {slow: {type: ExecutionTime, time: 0.8 s, at: plan}}
        run: {stop: 6 s}
        """.replace("        ", "")
    )
    no, yes = False, True
    assert fired == [
        (0.8, (0,), [no, no, no, no]),  # its own wake-up of 0.5 s is due for it later, though that time has passed
        (1.6, (), [yes, no, no, no]),
        (2.4, (1,), [yes, yes, no, no]),  # a wake-up and a token of one tag are one firing
        (3.2, (2,), [yes, yes, no, no]),
        (4.8, (), [yes, yes, no, yes]),  # that of 2.5 s was taken back while it waited, after it had got its time
        (5.6, (3,), [yes, yes, no, yes]),
    ]


class Delta(Actor):
    """Sends what came less a parameter that has a port."""

    input = InputPort(float)
    output = OutputPort(float)
    less = PortParameter(float, 0.0)

    def fire(self) -> None:
        for token in self.input.tokens:
            self.output.send(token - self.less)


def test_a_parameter_changes_when_the_actor_fires() -> None:
    text = """
actors: {t: {type: Ticker}, same: {type: Ticker}, delta: {type: Delta}}
connections: [t.output -> delta.input, same.output -> delta.less]
aspects: {slow: {type: ExecutionTime, time: 2.5 s, at: delta}}
run: {stop: 20 s}
"""
    _, results = simulate(text, types=[Delta])
    assert sent(results, "delta") == [(2.5 * (n + 1), 0.0) for n in range(8)]


def test_turns_of_one_actor_stay_apart() -> None:
    """A TimeDelay sends at one rank and takes its input at another: in its loop, both are put off."""
    text = """
actors: {t: {type: Ticker, limit: 1}, delay: {type: TimeDelay, delay: 1 s}, merge: {type: Merge}}
connections: [t.output -> merge.input, merge.output -> delay.input, delay.output -> merge.input]
aspects: {slow: {type: ExecutionTime, time: 0.25 s, at: delay}}
run: {stop: 6 s}
"""
    _, results = simulate(text)
    assert sent(results, "merge") == [(0, 0), (1.5, 0), (3.0, 0), (4.5, 0), (6.0, 0)]


def test_processes_are_resumed_later(monkeypatch: pytest.MonkeyPatch) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        while True:
            token = yield self.read(self.input)
            yield self.wait(0.5)
            self.output.send(token)

    monkeypatch.setattr(Script, "behaviour", behaviour)
    text = """
actors: {t: {type: Ticker, period: 10 s}, script: {type: Script}}
connections: [t.output -> script.input]
aspects: {slow: {type: ExecutionTime, time: 1 s, at: script}}
run: {stop: 40 s}
"""
    _, results = simulate(text)
    # A second for the start, which takes the first token's with it, then one for each read and for each wait.
    assert sent(results, "script") == [(2.5, 0), (12.5, 1), (22.5, 2), (32.5, 3)]


def test_a_job_may_be_let_go_from_anywhere() -> None:
    """At a port of another actor, in the middle of a firing: it is executed in the next turn that it can have."""
    held: list[tuple[Job, ActorPoint]] = []

    class Hold(ExecutionAspect):
        def schedule(self, job: Job, point: ActorPoint) -> None:
            assert job.tokens == {"input": (len(held),)}
            held.append((job, point))

    class Free(CommunicationAspect):
        def pass_token(self, token: Any, point: Any) -> None:
            if held:
                job, where = held[-1]
                where.forward(job)
            point.forward(token)

    text = """
actors: {t: {type: Ticker}, first: {type: Scale}, a: {type: Scale}, last: {type: Scale}, probe: {type: Probe}}
connections: [t.output -> first.input, t.output -> a.input, a.output -> last.input, last.output -> probe.input]
aspects: {hold: {type: Hold, at: a}, free: {type: Free, at: first.input}}
run: {stop: 3 s}
"""
    simulation, _ = simulate(text, types=[Hold, Free])
    assert seen(simulation) == [(n + 1.0, 1, (n,)) for n in range(3)]  # while t fires, the turn of a is still to come
    held.clear()
    # While b fires, which comes after a, it is over: so it is the next microstep.
    later = text.replace("last: {type: Scale}", "last: {type: Scale}, b: {type: Scale}, c: {type: Scale}")
    later = later.replace(
        "t.output -> first.input", "t.output -> b.input, b.output -> c.input, t.output -> first.input"
    )
    simulation, _ = simulate(later.replace("at: first.input", "at: c.input"), types=[Hold, Free])
    assert seen(simulation) == [(n + 0.0, 2, (n,)) for n in range(4)]


ZEROS = [aspect for aspect in AT_ZERO if isinstance(aspect, ExecutionAspect)]
PROCESSORS = [aspect for aspect in ZEROS if aspect.is_processor]  # of which an actor has one
OTHERS = [aspect for aspect in ZEROS if not aspect.is_processor]


MODELS: dict[str, dict[str, Any]] = {
    "collision_avoidance": {"set": ["observers=1"], "until": 0.3},
    "mm1": {"until": 200},
    "bouncing_ball": {"until": 3},
    "car_wash": {"until": None},
    "machine_shop": {"until": 1000},
    "feedback": {"until": None},
}


@pytest.mark.parametrize("name", MODELS)
def test_strength_zero_changes_no_bit(name: str) -> None:
    options = dict(MODELS[name])
    until = options.pop("until")

    def run(tracer: Tracer | None = None, *aspects: ExecutionAspect) -> str:
        model = load_model(name, **options)
        for number, aspect in enumerate(aspects):
            model.weave(f"zero_{number}", aspect, at="**")
        return Simulation(model, seed=4, tracer=tracer).run(until=until).digest

    bare = run()
    for processor in PROCESSORS:
        assert run(None, *OTHERS, processor) == bare
    tracer = Tracer(load_model(name, **options).graph.actors, lambda _: None)
    assert run(tracer, *OTHERS, PROCESSORS[0]) == bare


def test_a_trace_tells_what_a_firing_that_was_put_off_is_for() -> None:
    model = load(CHAIN.format("type: ExecutionTime, time: 1.4 s, at: a"))
    firings: list[tuple[float, str, list[tuple[Any, float]], int]] = []

    def report(firing: Any) -> None:
        arrivals = [(arrival.token, arrival.sent.seconds) for arrival in firing.arrivals]
        firings.append((firing.tag.seconds, firing.actor, arrivals, len(firing.wakes)))

    Simulation(model, seed=0, tracer=Tracer({path: model.graph.actors[path] for path in ("a", "t")}, report)).run()
    assert [row for row in firings if row[1] == "a"] == [
        (1.4, "a", [(0, 0.0)], 0), (2.8, "a", [(1, 1.0)], 0), (4.2, "a", [(2, 2.0)], 0)
    ]  # fmt: skip
    assert [row[3] for row in firings if row[1] == "t"] == [1] * 6


def test_an_error_in_an_aspect_names_it() -> None:
    class Wrong(ExecutionAspect):
        def schedule(self, job: Job, point: ActorPoint) -> None:
            raise KeyError("x")

    with pytest.raises(ActorError) as caught:
        chain("type: Wrong, at: a", types=[Wrong])
    assert str(caught.value).partition("\n")[0] == "aspect it failed in schedule() at a at (0 s, 1): KeyError: 'x'"


def test_wake_ups_that_are_taken_back_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    """A timer that every token winds up anew."""

    def act(self: Plan) -> None:
        if self.input.present:
            if self.input.value:
                self.wake.cancel()
            self.wake = self.wake_in(1.5)
        else:
            self.output.send("over")

    monkeypatch.setattr(Plan, "act", act)
    text = """
actors: {t: {type: Ticker, limit: 200}, plan: {type: Plan}}
connections: [t.output -> plan.input]
aspects: {it: {type: SkipFiring, probability: 0, at: plan}}
run: {stop: 300 s}
"""
    model = load(text)
    simulation = Simulation(model, keep_log=True)
    results = simulation.run()
    assert sent(results, "plan") == [(200.5, "over")]
    assert len(simulation._run._ways._executions["plan"]._asked) < 3


class Named(ExecutionAspect):
    """Notes whose firings it puts off."""

    def schedule(self, job: Job, point: ActorPoint) -> None:
        point.act("seen", (point.owner, point.target.owner))
        point.forward(job)


def test_a_point_says_whose_firing_it_is() -> None:
    text = CHAIN.format("type: Named, at: t").replace("period: 1 s", "limit: 1")
    composite = (
        "composites: {C: {outputs: [out], actors: {t: {type: Ticker, limit: 1}}, connections: [t.output -> out]}}"
    )
    _, results = simulate(text, types=[*TYPES, Named])
    assert [value for *_, value in acts(results)] == [("t", "t")]
    text = f"{composite}\nactors: {{c: {{type: C}}, p: {{type: Probe}}}}\nconnections: [c.out -> p.input]\n"
    _, results = simulate(text + "aspects: {it: {type: Named, at: c}}", types=[*TYPES, Named])
    assert [value for *_, value in acts(results)] == [("c.t", "c")]


def test_what_an_actor_is_to_take_later_is_there_when_it_has_answered_a_wake_up() -> None:
    """A ``TimeDelay`` sends what is due, and takes what comes, in two firings of one tag, also behind an aspect."""
    text = """
actors:
  clock: {type: Clock, period: 1 s}
  delay: {type: TimeDelay, delay: 1 s}
connections: [clock.output -> delay.input]
aspects: {skip: {type: SkipFiring, probability: 0, at: delay}}
run: {stop: 6 s, record: [delay.output]}
"""
    signal = Simulation(load(text)).run().signals["delay.output"]
    assert [signal.times.tolist(), signal.values.tolist()] == [[1, 2, 3, 4, 5, 6], [0, 1, 2, 3, 4, 5]]
