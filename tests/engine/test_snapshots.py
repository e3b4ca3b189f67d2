"""Runs that are stepped, saved, restored and forked: they continue exactly as an undisturbed run."""

from __future__ import annotations

import random  # noqa: TID251 (where to look, and not what a model draws)
import threading
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import Recorder
from epicycle.aspects import Aspect
from epicycle.runner import Model, Simulation, load_model
from epicycle.runner.execution.engine import ActorError
from epicycle.runner.model.catalogue.packaged import packaged_disturbances, packaged_models
from tests.aspects.strengths import AT_WORK
from tests.aspects.testing.test_non_interference import GRID, at_home
from tests.conformance.conformance_parts import TYPES
from tests.demo_models import DURATIONS
from tests.engine.engine_parts import Plan, load

CONFORMANCE = sorted((Path(__file__).parents[1] / "conformance" / "models").glob("*.yaml"))
CONFORMANCE = [path for path in CONFORMANCE if path.stem != "DEFixedPointLimitation"]  # which we refuse
FEATURES = """
parameters: {period: 100 ms}
composites:
  Late:
    inputs: [in]
    outputs: [out]
    director: {start: 1, drift: 1.5}
    actors: {hold: {type: TimeDelay, delay: 150 ms}, twice: {type: Scale, factor: 2}}
    connections: [in -> hold.input, hold.output -> twice.input, twice.output -> out]
  Line:
    inputs: [in]
    outputs: [out]
    actors: {hold: {type: TimeDelay, delay: 30 ms}}
    connections: [in -> hold.input, hold.output -> out]
actors:
  tick: {type: PoissonClock, mean_interval: "${period}"}
  walk: {type: Random, distribution: {type: Normal}}
  late: {type: Late, count: 2}
  join: {type: Join}
  server: {type: Server, distribution: {type: Exponential, mean: 90 ms}}
  seen: {type: Recorder}
connections:
  - tick.output -> walk.trigger, server.input
  - {from: walk.output, to: "late[*].in", delay: 10 ms}
  - late[*].out -> join.input
  - join.output, server.output -> seen.input
  - walk.output -> seen.input
aspects:
  noise: {type: Noise, at: "late[0].twice.factor", deviation: 0.1}
  line: {type: Line, at: server.input}
  slow: {type: ExecutionTime, at: join, time: 20 ms}
  crash: {type: CrashRestart, at: "late[1]", mtbf: 1 s, repair: 200 ms}
  drift: {type: ClockDrift, at: server, deviation: 0.01}
  loss: {type: GilbertElliott, at: "late[*].in", p: 0.2, r: 0.5}
  bus: {type: Bus, at: seen.input, factor: 5 ms}
  watch: {type: Probe, at: seen.input, when: walk.output > 0, until: 5 s}
run: {stop: 8 s, seed: 3, record: ["late[*].out", server.output]}
metrics:
  mean: {of: walk.output, take: mean, interval: 0.9}
  waiting: {of: walk.output, take: time_mean, initial: 0}
  rate: {of: server.output, take: rate}
  settled: {of: walk.output, take: quantile, p: 0.9, after: mser5}
"""


def told(simulation: Simulation) -> tuple[Any, ...]:
    """The final results of a run."""
    results = simulation.run()
    signals = {name: (signal.tags, list(map(repr, signal.tokens))) for name, signal in results.signals.items()}
    return (
        results.digest, results.events, results.outcomes, results.aspects, signals, results.end, results.stopped,
        results.firings, [record.encoded() for record in simulation.log.records],
    )  # fmt: skip


def steps_of(model: Model, until: int = 1_000_000) -> int:
    simulation, steps = Simulation(model), 0
    while steps < until and simulation.step():
        steps += 1
    return steps


def assert_goes_on(model: Model, number: int, seed: int = 0, keep_log: bool = True) -> None:
    """Snapshots at random tags, and forks at some of them, continue as the run did."""
    expected = told(Simulation(model, keep_log=keep_log))
    steps = steps_of(model)
    places = sorted(random.Random(seed).sample(range(steps + 1), min(number, steps + 1)))
    simulation, snapshots, forks, done = Simulation(model, keep_log=keep_log), [], [], 0
    for place in places:
        while done < place:
            assert simulation.step()
            done += 1
        snapshots.append(simulation.snapshot())
        if len(forks) < 2:
            forks.append(simulation.fork())
        assert snapshots[-1].tag == simulation.tag
    assert told(simulation) == expected
    for snapshot in reversed(snapshots):
        simulation.restore(snapshot)
        assert simulation.tag == snapshot.tag
        assert told(simulation) == expected
    assert [told(fork) for fork in forks] == [expected] * len(forks)


# -- every model, every aspect ----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", packaged_models())
def test_snapshots_of_packaged_models(name: str) -> None:
    short = ["observers=1", "disturbance=0.5"] if name == "collision_avoidance" else []
    model = load_model(name, set=short)
    model.stop = min(model.stop or 100.0, DURATIONS.get(name, 300.0)) / 4.0
    assert_goes_on(model, 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", packaged_models())
def test_a_hundred_snapshots_of_packaged_models(name: str) -> None:
    assert_goes_on(load_model(name), 100, keep_log=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", packaged_disturbances())
def test_snapshots_of_packaged_disturbances(name: str) -> None:
    assert_goes_on(load_model("collision_avoidance", disturb=name, set=["observers=2"]), 10)


@pytest.mark.parametrize("path", CONFORMANCE, ids=lambda path: path.stem)
def test_snapshots_of_conformance_models(path: Path) -> None:
    assert_goes_on(load_model(path, types=TYPES), 4)


@pytest.mark.parametrize("aspect", AT_WORK, ids=repr)
def test_snapshots_with_aspects(aspect: Aspect) -> None:
    model = load(GRID.format(2, 40))
    woven = at_home(aspect, "grid", "first[*]" if "actor" in aspect.stands_at else "first[*].*")
    assert woven is not None
    model.weave(woven.name, woven.aspect, at=woven.at)
    model.connect("second[*].output -> third.input", delay="3 ms") if model.add(Recorder("third")) else None
    assert_goes_on(model, 6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_snapshots_of_all_there_is(seed: int) -> None:
    model = load(FEATURES, set=[f"period={100 + seed} ms"])
    assert_goes_on(model, 12, seed)


# -- any number of simulations of one model ---------------------------------------------------------------------------


def parts_of(model: Model) -> dict[str, Any]:
    """What a model holds, down to the tokens in its ports; what cannot change by its identity."""
    found: dict[str, Any] = {}
    for path, actor in model.graph.actors.items():
        found |= {f"{path}.{name}": value for name, value in vars(actor).items() if name not in ("inputs", "outputs")}
        for name, port in {**actor.inputs, **actor.outputs}.items():
            slots = {each for base in type(port).__mro__ for each in getattr(base, "__slots__", ())}
            found |= {f"{path}.{name}.{each}": getattr(port, each) for each in slots}
    for woven in model.aspects:
        found |= {f"{woven.name}.{name}": value for name, value in vars(woven.aspect).items()}
        found |= {f"{woven.name}: {name}": value for name, value in vars(woven).items()}
    return {name: (id(value), repr(value)) for name, value in found.items()}


@pytest.mark.parametrize("name", ["bouncing_ball", "car_wash", "all there is"])
def test_a_run_does_not_touch_its_model(name: str) -> None:
    model = load(FEATURES) if name == "all there is" else load_model(name)
    model.check()
    before = parts_of(model)
    simulation = Simulation(model)
    simulation.run()
    assert parts_of(model) == before
    assert simulation.actors.keys() == model.graph.actors.keys()


@pytest.mark.parametrize("name", ["mm1", "machine_shop", "inspection_paradox", "all there is"])
def test_simulations_take_turns(name: str) -> None:
    model = load(FEATURES) if name == "all there is" else load_model(name)
    model.stop = min(model.stop or 500.0, 20_000.0 if name == "machine_shop" else 500.0)
    seeds = (1, 2, 1)
    alone = [told(Simulation(model, seed=seed, keep_log=True)) for seed in seeds]
    together = [Simulation(model, seed=seed, keep_log=True) for seed in seeds]
    going = list(together)
    while going:
        going = [simulation for simulation in going if simulation.step()]
    assert [told(simulation) for simulation in together] == alone
    assert alone[0] == alone[2] != alone[1]


@pytest.mark.slow
def test_simulations_in_threads() -> None:
    model = load(FEATURES)
    alone = [told(Simulation(model, seed=seed, keep_log=True)) for seed in range(4)]
    found: dict[int, Any] = {}

    def work(seed: int) -> None:
        found[seed] = told(Simulation(model, seed=seed, keep_log=True))

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [found[seed] for seed in range(4)] == alone


@pytest.mark.parametrize("more", ["", "run: {stop_when: [t.output]}"])
def test_when_a_run_is_over_there_is_no_more_to_come(more: str) -> None:
    assert not Simulation(load(f"actors: {{t: {{type: Ticker, limit: 3}}}}\n{more}")).advance(5.0)


def test_a_run_in_pieces() -> None:
    model = load("actors: {t: {type: Ticker}, probe: {type: Probe}}\nconnections: [t.output -> probe.input]\n")
    model.stop = 5
    expected = told(Simulation(model, keep_log=True))
    simulation = Simulation(model, keep_log=True)
    assert simulation.tag == (0, 0)
    assert [simulation.step(), simulation.advance(0.5), simulation.advance(2.5)] == [True, True, True]
    assert (simulation.tag.seconds, len(simulation["probe"].seen)) == (2.0, 3)  # type: ignore[attr-defined]
    assert simulation.advance(2.0)  # that is past
    assert simulation.results("looked at").events == 3
    assert not simulation.advance(5.0)
    assert not simulation.step()
    assert not simulation.advance(7.0)
    assert told(simulation) == expected
    over = "a Simulation runs once: make another one for another run"
    for again in (simulation.run, simulation.step, simulation.finish, lambda: simulation.advance(9)):
        with pytest.raises(RuntimeError) as caught:
            again()
        assert str(caught.value) == over


def test_a_run_that_is_ended_early() -> None:
    model = load("actors: {t: {type: Ticker}, probe: {type: Probe}}\nconnections: [t.output -> probe.input]\n")
    model.metric("ticks", of="t.output", take="time_mean")
    simulation = Simulation(model)
    simulation.advance(3.5)
    results = simulation.finish()
    assert (results.stopped, results.end, simulation["probe"].wrapped) == ("stop time", 3.0, 1)  # type: ignore[attr-defined]
    assert results.metrics == Simulation(model).run(until=3.5).metrics == {"ticks": pytest.approx(4.5 / 3.5)}
    simulation = Simulation(model)
    simulation.step()
    assert simulation.finish().stopped == "the program"


def test_what_stands_so_far_does_not_change_what_comes() -> None:
    model = load(FEATURES)
    simulation = Simulation(model, keep_log=True)
    while simulation.step():
        simulation.results("looked at")
    assert told(simulation) == told(Simulation(model, keep_log=True))


def test_a_step_that_fails_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def act(self: Plan) -> None:
        raise ValueError("no")

    monkeypatch.setattr(Plan, "act", act)
    model = load(
        "actors: {t: {type: Ticker}, plan: {type: Plan}, probe: {type: Probe}}\nconnections: [t.output -> plan.input]\n"
    )
    simulation = Simulation(model)
    with pytest.raises(ActorError, match=r"plan failed in fire\(\) at \(0 s, 1\): ValueError: no"):
        simulation.step()
    assert simulation["probe"].wrapped == 1  # type: ignore[attr-defined]
    with pytest.raises(RuntimeError):
        simulation.step()
