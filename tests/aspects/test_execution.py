"""Aspects at actors: what a firing that is put off sees, whom they stand at, and what firings cost."""

from __future__ import annotations

import csv
from collections.abc import Generator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from scipy.stats import binom, kstest

from epicycle.actors import Actor, Clock, EpicycleError, InputPort, OutputPort, PortParameter
from epicycle.aspects import CommunicationAspect, ExecutionAspect, ExecutionTime, Job, PacketLoss
from epicycle.aspects.execution import ActorPoint
from epicycle.runner import ActorError, Model, ModelError, Simulation, load_model
from epicycle.runner.engine import Results, Tracer
from epicycle.runner.show.graph.outline import outline
from tests.aspects.strengths import AT_ZERO
from tests.engine.engine_parts import TYPES, Plan, Scale, Script, load, seen, sends, simulate

CHAIN = """
actors:
  t: {{type: Ticker, period: 1 s}}
  a: {{type: Scale}}
  probe: {{type: Probe}}
connections: [t.output -> a.input, a.output -> probe.input]
aspects:
  it: {{{}}}
run: {{stop: 5 s}}
"""


def chain(aspect: str, **options: Any) -> tuple[Model, Results]:
    return simulate(CHAIN.format(aspect), **options)


def sent(results: Results, actor: str = "a") -> list[tuple[float, Any]]:
    return [(time, value) for time, _, _, value in sends(results, actor)]


def acts(results: Results) -> list[tuple[float, str, str, Any]]:
    return [(r.tag.seconds, r.event, r.actor, r.value) for r in results.log.records if r.event != "send"]


# -- time -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("aspect", "expected", "delays"),
    [
        ("time: 0.4 s", [(n + 0.4, n) for n in range(5)], [0.4] * 6),
        ("time: 0.2 s, scale: 2", [(n + 0.4, n) for n in range(5)], [0.4] * 6),
        (
            "time: 1.4 s",
            [(1.4, 0), (2.8, 1), (4.2, 2)],
            [1.4, 1.8, 2.2, 2.6, 3.0, 3.4],
        ),  # each waits for the one before
        ("time: 1.4 s, busy: skip", [(1.4, 0), (3.4, 2)], [1.4, "s", 1.4, "s", 1.4, "s"]),
        ("time: 1 s", [(n + 1.0, n) for n in range(5)], [1.0] * 6),  # over just when the next one comes
        ("time: 1 s, busy: skip", [(n + 1.0, n) for n in range(5)], [1.0] * 6),
        ("time: 0.4 s, from: 1 s, until: 3 s", [(0, 0), (1.4, 1), (2.4, 2), (3, 3), (4, 4), (5, 5)], [0.4] * 2),
        # What comes when the aspect is no longer active takes no time, and waits for its turn all the same.
        ("time: 1.8 s, until: 2 s", [(1.8, 0), (3.6, 1), (3.6, 2), (3.6, 3), (4, 4), (5, 5)], [1.8, 2.6, 1.6, 0.6]),
        ("time: 0.4 s, when: t.output > 2", [(0, 0), (1, 1), (2, 2), (3.4, 3), (4.4, 4)], [0.4] * 3),
    ],
)
def test_a_firing_takes_time(aspect: str, expected: list[tuple[float, int]], delays: list[Any]) -> None:
    model, results = chain(f"type: ExecutionTime, at: a, {aspect}")
    assert sent(results) == expected
    assert [entry[3] if entry[1] == "delayed" else "s" for entry in acts(results)] == pytest.approx(delays)
    assert results.aspects["it"] == {"delayed": sum(d != "s" for d in delays), "skipped": delays.count("s")}
    # What it sends is received within the tag, and that is the first one of its instant.
    assert {(time, microstep) for time, microstep, _ in seen(model)} == {(time, 1) for time, _ in expected}


def test_lindley() -> None:
    """Random times on a server without a queue's limit: d[n] = max(a[n], d[n-1]) + s[n], in whole nanoseconds."""
    text = CHAIN.format("type: ExecutionTime, time: {type: Exponential, mean: 6 ms}, at: a")
    _, results = simulate(text.replace("1 s", "10 ms").replace("5 s", "30 s"), seed=3)
    done = [tag.time for tag in (r.tag for r in results.log.records if r.event == "send" and r.actor == "a")]
    came = [10_000_000 * n for n in range(len(done))]
    service = [
        done[0] - came[0],
        *(d - max(a, before) for a, (before, d) in zip(came[1:], pairwise(done), strict=True)),
    ]
    assert kstest([s / 1e9 for s in service], "expon", (0, 0.006)).pvalue > 0.001
    waits = [d - a for a, d in zip(came, done, strict=True)]
    told = [value for _, _, _, value in acts(results)]
    assert told[: len(waits)] == pytest.approx([wait / 1e9 for wait in waits], abs=1e-12)


def test_a_source_is_late_by_its_own_time() -> None:
    """It asks for its next wake-up when it fires."""
    _, results = chain("type: ExecutionTime, time: 0.4 s, at: t")
    assert sent(results, "t") == sent(results) == [(0.4, 0), (1.8, 1), (3.2, 2), (4.6, 3)]


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


def test_time_of_a_composite_with_a_clock() -> None:
    text = """
composites:
  Fast: {inputs: [go], outputs: [gone], director: {drift: 2}, actors: {a: {type: Scale}},
         connections: [go -> a.input, a.output -> gone]}
actors: {t: {type: Ticker, period: 1 s}, fast: {type: Fast}, probe: {type: Probe}}
connections: [t.output -> fast.go, fast.gone -> probe.input]
aspects: {slow: {type: ExecutionTime, time: 0.4 s, at: fast}}
run: {stop: 3 s}
"""
    simulation, results = simulate(text)
    assert [(time, tokens) for time, _, tokens in seen(simulation)] == [(n + 0.2, (n,)) for n in range(3)]
    assert {act[3] for act in acts(results)} == {0.4}


def test_order_of_aspects() -> None:
    skip = "skip: {{type: SkipFiring, probability: 0.5, at: a}}"
    slow = "slow: {{type: ExecutionTime, time: 1.5 s, at: a}}"

    def run(first: str, second: str) -> Results:
        text = CHAIN.replace("  it: {{{}}}\n", f"  {first}\n  {second}\n").replace("5 s", "40 s")
        return simulate(text.format(), seed=2)[1]

    before, after = run(skip, slow), run(slow, skip)
    assert before.aspects["slow"]["delayed"] == 41 - before.aspects["skip"]["skipped"]  # what is skipped takes no time
    assert after.aspects["slow"]["delayed"] == 41
    assert len(sent(after)) < len(sent(before))


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


# -- what leaves no trace -------------------------------------------------------------------------------------------

ZEROS = [aspect for aspect in AT_ZERO if isinstance(aspect, ExecutionAspect)]
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
    assert run(None, *ZEROS) == bare
    assert run(Tracer(load_model(name, **options).graph.actors, lambda _: None), *ZEROS) == bare


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


# -- skipping -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("probability", [0.0, 0.1, 0.5, 1.0])
def test_skipping(probability: float) -> None:
    text = CHAIN.format(f"type: SkipFiring, probability: {probability}, at: '**'").replace("1 s", "1 ms")
    _, results = simulate(text, seed=5)
    skipped = {actor: [time for time, event, who, _ in acts(results) if who == actor] for actor in ("t", "a", "probe")}
    low, high = binom.interval(0.999, 5001, probability)
    assert low <= len(skipped["a"]) <= high
    after = len({round(time * 1000) for time in skipped["a"]} & {round(time * 1000) + 1 for time in skipped["a"]})
    low, high = binom.interval(0.999, 5000, probability**2)
    assert low <= after <= high
    assert skipped["t"] == []  # it wakes itself
    assert len(sent(results)) == 5001 - len(skipped["a"])
    low, high = binom.interval(0.999, len(sent(results)), probability)
    assert low <= len(skipped["probe"]) <= high


def test_skipping_wake_ups_ends_a_source() -> None:
    _, results = chain("type: SkipFiring, probability: 1, wakes: true, at: t, from: 2.5 s")
    assert sent(results, "t") == [(0, 0), (1, 1), (2, 2)]
    assert acts(results) == [(3.0, "skipped", "t", None)]


# -- measured times -------------------------------------------------------------------------------------------------


class Busy(Actor):
    """Computes for some time."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        sum(range(5_000 * (self.input.value % 3)))
        self.output.send(self.input.value)


def test_measured_once_and_replayed(tmp_path: Path) -> None:
    text = CHAIN.replace("Scale", "Busy").replace("1 s", "1 ms").replace("5 s", "40 ms")
    bare = simulate(text.format("type: ExecutionTime, at: a"), types=[Busy])[1]
    results = simulate(text.format("type: ExecutionTime, measure: true, at: a"), types=[Busy])[1]
    assert results.digest == bare.digest
    times = results["it@a"].tokens
    assert len(times) == 41
    assert sorted(times[2::3])[6] > sorted(times[0::3])[6] > 0  # medians: it was measured, and not made up

    from epicycle.runner.show import write_folder

    write_folder(tmp_path, results, [])
    model = text.format("type: ExecutionTime, times: signals.parquet, at: a")
    (tmp_path / "m.yaml").write_text(f"model: m\n{model}", encoding="utf-8")
    runs = [
        Simulation(load_model(tmp_path / "m.yaml", types=[Script, Busy, *TYPES]), keep_log=True).run() for _ in "ab"
    ]
    assert runs[0].digest == runs[1].digest != bare.digest
    free, expected = 0, []
    for tick, time in enumerate(times):
        free = max(free, tick * 1_000_000) + round(time * 1e9)
        expected += [free / 1e9] if free <= 40_000_000 else []  # on a busy machine, not all is over in time
    assert expected
    assert [time for time, _ in sent(runs[0])] == pytest.approx(expected, abs=1e-12)


def test_times_for_all_actors_over_and_over(tmp_path: Path) -> None:
    with (tmp_path / "times.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["value"], [0.1], [0.3]])
    model = CHAIN.format("type: ExecutionTime, times: times.csv, scale: 2, at: [a, probe]")
    (tmp_path / "m.yaml").write_text(f"model: m\n{model}", encoding="utf-8")
    model_ = load_model(tmp_path / "m.yaml", types=TYPES)
    simulation = Simulation(model_, keep_log=True)
    results = simulation.run()
    assert [time for time, _ in sent(results)] == pytest.approx([0.2, 1.6, 2.2, 3.6, 4.2])
    assert [row[0] for row in seen(simulation)] == pytest.approx([0.4, 2.2, 2.4, 4.2, 4.4])


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        (["signal,value", "slow@b,1"], "it has no times of a; it has those of b"),
        (["signal,value", "robot.state,1"], "it has no times of a; it has those of no actor"),
        (["signal,values", "slow@a,1"], "there is no column 'value'; columns: signal, values"),
        (["signal,value", "slow@a,-1"], "row 1: -1 is not a time in s from 0 on"),
        (["value"], "it has no rows"),
    ],
)
def test_files_that_tell_no_times(rows: list[str], reason: str, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (tmp_path / "m.yaml").write_text("model: m\n" + CHAIN.format("type: ExecutionTime, times: t.csv, at: a"))
    with pytest.raises(ActorError) as caught:
        Simulation(load_model(tmp_path / "m.yaml", types=TYPES)).run()
    assert str(caught.value).partition("\n")[0] == (
        f"aspect it failed in pass_token() at a at (0 s, 1): the execution times in {tmp_path}/t.csv cannot be used: "
        f"{reason}"
    )


# -- where they stand -----------------------------------------------------------------------------------------------

PARTS = """
composites:
  Pair:
    inputs: [go]
    outputs: [gone]
    actors: {{one: {{type: Scale}}, two: {{type: Scale, tags: [slow]}}}}
    connections: [go -> one.input, one.output -> two.input, two.output -> gone]
actors:
  t: {{type: Ticker, period: 1 ms}}
  a: {{type: Scale, tags: slow}}
  pair: {{type: Pair, count: 2}}
  none: {{type: Pair, count: 0}}
connections: [t.output -> a.input, "t.output -> pair[*].go"]
aspects:
  it: {{{}}}
run: {{stop: 9 ms}}
"""
WITHIN = {f"pair[{i}].{part}": f"pair[{i}]" for i in (0, 1) for part in ("one", "two")}


@pytest.mark.parametrize(
    ("at", "actors"),
    [
        ("a", {"a": "a"}),
        ('["pair[*]"]', WITHIN),
        ('"pair[*].*"', {actor: actor for actor in WITHIN}),
        ('"**"', {"t": "t", "a": "a", **WITHIN}),
        ('["**", "!t", "!pair[0]"]', {"a": "a", "pair[1].one": "pair[1]", "pair[1].two": "pair[1]"}),
        ('["pair[*]", "!pair[*].one"]', {"pair[0].two": "pair[0]", "pair[1].two": "pair[1]"}),
        ("{type: Scale}", {"a": "a", **{actor: actor for actor in WITHIN}}),
        ("{type: Pair}", WITHIN),
        ("{tag: slow}", {"a": "a", "pair[0].two": "pair[0].two", "pair[1].two": "pair[1].two"}),
        ('["none[*]"]', {}),
    ],
)
def test_pointcuts(at: str, actors: dict[str, str]) -> None:
    (woven,) = load(PARTS.format(f"type: SkipFiring, probability: 0, at: {at}")).aspects
    assert (woven.actors, woven.ports, woven.connections) == (actors, [], [])


@pytest.mark.parametrize(
    ("aspect", "message"),
    [
        (
            "type: SkipFiring, probability: 1, at: a.input",
            "SkipFiring stands at actors, but a.input is a port\n   help: write 'a', without the port",
        ),
        (
            "type: SkipFiring, probability: 1, at: 'pair[*].*.output'",
            (
                "SkipFiring stands at actors, but pair[0].one.output is a port\n"
                "   help: write 'pair[*].*', without the port"
            ),
        ),
        (
            "type: SkipFiring, probability: 1, at: t.output -> a.input",
            (
                "SkipFiring stands at actors, not on connections\n"
                "   help: write 'a' for the one that receives"
            ),
        ),
        (
            "type: SkipFiring, probability: 1, at: {type: Scale, port: input}",
            "SkipFiring stands at actors, not at their ports\n   help: leave 'port' out",
        ),
        (
            "type: SkipFiring, probability: 1, at: b",
            (
                "'b' matches no actor\n"
                "   help: actors and composites at this depth: a, pair[0], pair[1], t"
            ),
        ),
        (
            "type: SkipFiring, probability: 1, at: 'pair[0].tow'",
            (
                "'pair[0].tow' matches no actor, did you mean 'pair[0].two'?\n"
                "   help: actors and composites at this depth: "
                "pair[0].one, pair[0].two, pair[1].one, pair[1].two"
            ),
        ),
        (
            "type: SkipFiring, probability: 1, at: a..b",
            "'a..b' is no pointcut: '' is not a name, a name with an index, '*' or '**'",
        ),
        (
            "type: SkipFiring, probability: 1, at: {type: Scael}",
            "there is no actor of type 'Scael', did you mean 'Scale'?\n   help: types in it: Pair, Scale, Ticker",
        ),
        (
            "type: PacketLoss, probability: 1, at: a",
            (
                "'a' matches no port\n"
                "   help: that is an actor, not a port: write a.input"
            ),
        ),
    ],
)  # fmt: skip
def test_pointcuts_that_are_wrong(aspect: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        load(PARTS.format(aspect))
    (problem,) = caught.value.problems
    assert problem.message + "".join(f"\n   help: {hint}" for hint in problem.help) == f"aspect it: {message}"


def test_parameters_that_do_not_fit() -> None:
    with pytest.raises(EpicycleError) as caught:
        ExecutionTime(measure=True, time=1)
    assert str(caught.value) == ("it cannot measure execution times where they are given: leave one or the other out")
    with pytest.raises(EpicycleError) as caught:
        ExecutionTime(times="times.txt")
    assert str(caught.value) == "times: 'times.txt' ends neither in .csv nor in .parquet"


def test_weaving_in_python() -> None:
    model = Model("m", stop=3)
    clock, scale = model.add(Clock("clock", period=1)), model.add(Scale("scale"))
    model.connect(clock.output, scale.inputs["input"])
    woven = model.weave("slow", ExecutionTime(time=0.5), at=scale)
    assert woven.actors == {"scale": "scale"}
    assert sent(Simulation(model, keep_log=True).run(), "scale") == [(0.5, 0), (1.5, 1), (2.5, 2)]
    for wrong, message in [
        (Scale("scale"), "scale is not part of this model"),
        (scale.outputs["output"], "aspect more: ExecutionTime stands at actors, but scale.output is a port"),
    ]:
        with pytest.raises(ModelError) as caught:
            model.weave("more", ExecutionTime(time=0.5), at=wrong)
        assert [problem.message for problem in caught.value.problems] == [message]
    with pytest.raises(ModelError) as caught:
        model.weave("loss", PacketLoss(probability=1), at=scale)  # type: ignore[arg-type]
    assert [problem.message for problem in caught.value.problems] == ["scale is an actor, not a port"]
    model.remove("scale")
    assert [each.actors for each in model.aspects] == [{}]


def test_an_error_in_an_aspect_names_it() -> None:
    class Wrong(ExecutionAspect):
        def schedule(self, job: Job, point: ActorPoint) -> None:
            raise KeyError("x")

    with pytest.raises(ActorError) as caught:
        chain("type: Wrong, at: a", types=[Wrong])
    assert str(caught.value).partition("\n")[0] == "aspect it failed in pass_token() at a at (0 s, 1): KeyError: 'x'"


def test_a_class_that_does_without_an_actor_does_without_its_aspect() -> None:
    text = """
composites:
  Pair:
    inputs: [go]
    actors: {one: {type: Scale}, two: {type: Scale}}
    connections: [go -> one.input, go -> two.input]
    aspects: {slow: {type: ExecutionTime, time: 1 s, at: [one, two]}, lazy: {type: SkipFiring, probability: 1, at: two}}
  Single: {extends: Pair, actors: {two: null}}
actors: {t: {type: Ticker}, single: {type: Single}}
connections: [t.output -> single.go]
run: {stop: 3 s}
"""
    simulation, results = simulate(text)
    aspects = simulation.model.aspects
    assert {woven.name: woven.actors for woven in aspects} == {"single.slow": {"single.one": "single.one"}}
    assert [time for time, _ in sent(results, "single.one")] == [1, 2, 3]


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


def test_streams_belong_to_actors() -> None:
    both = PARTS.format('type: SkipFiring, probability: 0.5, at: "**"').replace("9 ms", "99 ms")
    one = both.replace('"**"', '"pair[1].one"')

    def skips(text: str) -> list[float]:
        return [time for time, _, actor, _ in acts(simulate(text)[1]) if actor == "pair[1].one"]

    assert skips(both) == skips(one) != []


def test_drawings_mark_actors() -> None:
    model = load(PARTS.format('type: SkipFiring, probability: 0, at: ["a", "pair[1].two"]'))
    for depth, marked in [
        (1, {"a": ("it",), "pair[1]": (), "pair[1].two": ("it",)}),
        (0, {"a": ("it",), "pair[1]": ("it",)}),
    ]:
        boxes = {box.path: box.aspects for box in outline(model, depth).root.walk()}
        assert marked.items() <= boxes.items()
        assert not any(aspects for path, aspects in boxes.items() if path not in marked)


class Named(ExecutionAspect):
    """Notes whose firings it puts off."""

    def schedule(self, job: Job, point: ActorPoint) -> None:
        point.act("seen", (point.owner, point.unit.owner))
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
