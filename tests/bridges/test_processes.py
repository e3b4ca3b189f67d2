"""SimPy's processes as actors, and runs inside SimPy's environment: the same events as plain SimPy."""

from __future__ import annotations

import math
import sys
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
import simpy

from epicycle.actors import Clock, ParameterError, Recorder
from epicycle.bridges import Environment, Process, process
from epicycle.runner import ActorError, Model, ModelError, Simulation, load_model
from epicycle.runner.model.catalogue.types import types_of_file
from tests.bridges.random_programs import END, TRACE, Shared, play, program

Behaviour = Generator[Any, Any, None]


def traced(run: Any) -> list[tuple[Any, ...]]:
    TRACE.clear()
    run()
    return list(TRACE)


def plainly(what: list[Any], env: Any) -> None:
    shared = Shared()
    for number, steps in enumerate(what):
        env.process(play(env, shared, number, steps))
    env.run(until=END)


def model_of(what: list[Any], shared: Shared, numbers: range) -> Model:
    model = Model("program", stop=END)
    for number in numbers:
        arguments = {"shared": shared, "number": number, "what": what[number]}
        model.add(Process(f"process_{number}", function=play, arguments=arguments))
    return model


def as_actors(what: list[Any]) -> None:
    Simulation(model_of(what, Shared(), range(len(what)))).run()


def attached(what: list[Any], env: Any, inside: range, before: bool) -> None:
    """The processes of a range are actors of a run in ``env``, the others are processes there."""
    shared = Shared()
    simulation = Simulation(model_of(what, shared, inside))
    simulation_shared = shared
    for actor in simulation.actors.values():
        simulation_shared = actor.arguments["shared"]  # type: ignore[attr-defined]
    if before:
        simulation.attach(env)
    for number in range(len(what)):
        if number not in inside:
            env.process(play(env, simulation_shared, number, what[number]))
    if not before:
        simulation.attach(env)
    env.run(until=END)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(10))
def test_1000_random_programs_are_the_same_everywhere(block: int) -> None:
    happened = 0
    for seed in range(100 * block, 100 * block + 100):
        what = program(seed)
        expected = traced(lambda what=what: plainly(what, simpy.Environment()))
        happened += len(expected)
        assert traced(lambda what=what: plainly(what, Environment())) == expected, seed
        assert traced(lambda what=what: as_actors(what)) == expected, seed
        split = 1 + seed % (len(what) - 1)
        first, last = range(split), range(split, len(what))
        assert traced(lambda w=what, r=first: attached(w, simpy.Environment(), r, True)) == expected, seed
        assert traced(lambda w=what, r=last: attached(w, simpy.Environment(), r, False)) == expected, seed
    assert happened > 2000


@pytest.mark.parametrize("seed", range(5))
def test_random_programs(seed: int) -> None:
    what = program(seed)
    expected = traced(lambda: plainly(what, simpy.Environment()))
    assert len(expected) > 10
    assert traced(lambda: plainly(what, Environment())) == expected
    assert traced(lambda: as_actors(what)) == expected
    assert traced(lambda: attached(what, simpy.Environment(), range(1), True)) == expected
    assert traced(lambda: attached(what, simpy.Environment(), range(1, len(what)), False)) == expected


# -- functions as actors --------------------------------------------------------------------------------------------

BANK = '''
"""A bank."""


def source(env, counter, interval, number=3):
    for each in range(number):
        yield env.timeout(interval)
        counter.put(each)


def teller(env, counter, served, random):
    while True:
        customer = yield counter.get()
        yield env.timeout(random.expovariate(1 / 5))
        yield served.put((customer, env.now))


def broken(env):
    yield 3


def helper(number):
    return number
'''
MODEL = """
model: bank
actors:
  street: {type: Process, function: bank.source, output_ports: counter, arguments: {interval: 10}}
  teller: {type: Process, function: bank.teller, input_ports: [counter], output_ports: [served]}
connections:
  - street.counter -> teller.counter
run: {stop: 100, seed: 1, record: [street.counter, teller.served]}
"""


@pytest.fixture
def bank(tmp_path: Path) -> Path:
    name = tmp_path / "bank.py"
    name.write_text(BANK, encoding="utf-8")
    (tmp_path / "model.yaml").write_text(MODEL, encoding="utf-8")
    return name


@pytest.fixture(autouse=True)
def forget_modules(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    from epicycle.runner.model.catalogue import types

    monkeypatch.setattr(types, "_functions", {})
    sys.modules.pop("bank", None)
    yield
    sys.modules.pop("bank", None)


def test_functions_of_a_file_are_actors_with_ports(bank: Path) -> None:
    types = types_of_file(bank)
    results = Simulation(load_model(bank.with_name("model.yaml"), types=types)).run()
    assert list(results["street.counter"].times) == [10, 20, 30]
    assert [each[0] for each in results["teller.served"].values] == [0, 1, 2]
    assert list(results["teller.served"].times) == [each[1] for each in results["teller.served"].values]
    again = Simulation(load_model(bank.with_name("model.yaml"), types=types)).run()
    assert again.digest == results.digest


def said(bank: Path, text: str) -> str:
    path = bank.with_name("model.yaml")
    path.write_text(f"model: bank\nactors:\n  teller: {text}\n", encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        load_model(path, types=types_of_file(bank))
    return str(caught.value).replace(f"{bank.parent}/", "")


def test_a_file_that_was_not_named_gives_no_functions(bank: Path) -> None:
    with pytest.raises(ModelError) as caught:
        load_model(bank.with_name("model.yaml"))
    assert "'bank.source' is not a function that is known; known: none; name its file with --types FILE.py" in str(
        caught.value
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "{type: Process, function: bank.tellr}",
            (
                "model.yaml:3:37: error: teller.function: 'bank.tellr' is not a function that is known, did you mean "
                "'bank.teller'?; known: bank.broken, bank.source, bank.teller; name its file with --types FILE.py, or "
                "in Python load_model(types=[Process.knowing(function)])\n"
                "    3 |   teller: {type: Process, function: bank.tellr}\n"
                "      |                                     ^^^^^^^^^^"
            ),
        ),
        (
            "{type: Process, function: os.walk}",
            (
                "model.yaml:3:37: error: teller.function: 'os.walk' is not a function that is known; known: "
                "bank.broken, bank.source, bank.teller; name its file with --types FILE.py, or in Python "
                "load_model(types=[Process.knowing(function)])\n"
                "    3 |   teller: {type: Process, function: os.walk}\n"
                "      |                                     ^^^^^^^"
            ),
        ),
    ],
)
def test_wrong_functions_are_reported_at_their_place(bank: Path, text: str, message: str) -> None:
    assert said(bank, text) == message


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"function": len}, "part: function: len has no parameter 'env'; it has: obj"),
        ({"arguments": {"sevice": 2}}, "part: function: counter has no parameter 'sevice', did you mean 'service'?"),
        ({"arguments": {"env": 2}}, "part: arguments.env: 'env' is the environment"),
        ({"arguments": {}}, "part: function: counter needs a value for stock: give it in 'arguments'"),
        (
            {"arguments": {"stock": {"type": "Stor"}}},
            (
                "part: arguments.stock: SimPy has no resource 'Stor', did you mean 'Store'?; it has: Resource, "
                "PriorityResource, PreemptiveResource, Container, Store, PriorityStore, FilterStore"
            ),
        ),
        (
            {"arguments": {"stock": {"type": "Store", "capacity": 0}}},
            'part: arguments.stock: Store: "capacity" must be > 0.',
        ),
        ({"input_ports": ["door"]}, "part: function: counter has no parameter 'door'"),
        ({"gives": {"done": "number"}}, "part: gives: 'done' is not an output"),
        ({"input_ports": ["stock"], "output_ports": ["stock"]}, "part: stock is both an input and an output"),
    ],
)
def test_what_does_not_fit_a_function_is_reported(given: dict[str, Any], message: str) -> None:
    def counter(env: Any, stock: Any, service: float = 1.0) -> Behaviour:
        yield env.timeout(service)

    with pytest.raises(ParameterError) as caught:
        Process("part", **{"function": counter, **given})
    assert str(caught.value).removeprefix("part: ") == message.removeprefix("part: ")


def test_a_generator_that_yields_rubbish_is_named(bank: Path) -> None:
    types_of_file(bank)
    model = Model("bank")
    model.add(Process("teller", function="bank.broken"))
    with pytest.raises(ActorError) as caught:
        Simulation(model).run()
    line = bank.read_text().splitlines().index("    yield 3") + 1
    assert str(caught.value).splitlines()[0] == (
        f"teller failed in run() at (0 s, 1): broken yields 3 at bank.py:{line}, which is not an event"
    )


def test_a_decorator_names_the_ports_and_leaves_the_function_as_it_is() -> None:
    @process(inputs=["parts"], outputs=["done"])
    def press(env: Any, parts: Any, done: Any, duration: float) -> Behaviour:
        while True:
            part = yield parts.get()
            yield env.timeout(duration)
            yield done.put(part)

    env = simpy.Environment()
    parts, done = simpy.Store(env), simpy.Store(env)
    env.process(press(env, parts, done, 2))
    parts.put("bolt")
    env.run(until=3)
    assert done.items == ["bolt"]

    model = Model("pressing", stop=10.0)
    clock = model.add(Clock("clock", period=3))
    made = model.add(Process("press", function=press, arguments={"duration": 2}))
    kept = model.add(Recorder("kept"))
    model.connect(clock.output, made.inputs["parts"])
    model.connect(made.outputs["done"], kept.input)
    model.record("press.done")
    assert list(Simulation(model).run()["press.done"].times) == [2, 5, 8]


def test_a_function_that_starts_processes_is_an_actor_with_resources_of_simpy() -> None:
    left: list[tuple[int, float]] = []

    def customer(env: Any, number: int, counter: Any) -> Behaviour:
        with counter.request() as request:
            yield request
            yield env.timeout(4)
        left.append((number, env.now))

    def start(env: Any, counter: Any) -> None:
        for number in range(3):
            env.process(customer(env, number, counter))

    model = Model("bank", stop=100.0)
    model.add(Process("bank", function=start, arguments={"counter": {"type": "Resource", "capacity": 2}}))
    Simulation(model).run()
    assert left == [(0, 4.0), (1, 4.0), (2, 8.0)]


def test_random_has_the_methods_of_the_module_and_the_bits_of_a_stream() -> None:
    drawn: list[Any] = []

    def draws(env: Any, random: Any) -> Behaviour:
        random.seed(7)  # only the run's seed decides
        drawn.append(
            [
                random.random(),
                random.expovariate(0.5),
                random.randint(1, 6),
                random.choice("abc"),
                random.gauss(0, 1),
                random.uniform(2, 3),
                random.triangular(0, 1),
                random.lognormvariate(0, 1),
                random.gammavariate(2, 1),
                random.weibullvariate(2, 1),
                random.sample(range(9), 3),
            ]
        )
        yield env.timeout(1)

    model = Model("drawing", seed=5)
    model.add(Process("part", function=draws))
    for seed in (5, 5, 6):
        Simulation(model, seed=seed).run()
    assert drawn[0] == drawn[1] != drawn[2]
    assert all(math.isfinite(each) for each in drawn[0] if isinstance(each, float))
    assert drawn[0][2] in range(1, 7)


# -- a program as it is ---------------------------------------------------------------------------------------------


def test_an_environment_runs_as_simpys_does() -> None:
    env = Environment(seed=4)
    with pytest.raises(ValueError, match=r"^until \(0\) must be greater than the current simulation time$"):
        env.run(until=0)
    event = env.event()
    with pytest.raises(RuntimeError, match=r'^No scheduled events left but "until" event was not triggered: '):
        env.run(until=event)
    timeout = env.timeout(3, value="here")
    assert env.run(until=timeout) == "here"
    assert env.run(until=timeout) == "here"
    assert (env.now, type(env.now)) == (3, int)
    env.timeout(0.5)
    env.run()
    assert env.now == 3.5
    with pytest.raises(simpy.core.EmptySchedule):
        env.step()
    with pytest.raises(ValueError, match=r"^initial_time: a run begins at 0 s, not at 5 s$"):
        Environment(5)


def test_an_event_that_fails_ends_a_run_until_it() -> None:
    def failing(env: Any) -> Behaviour:
        yield env.timeout(1)
        raise KeyError("lost")

    env = Environment()
    with pytest.raises(KeyError, match="lost"):
        env.run(until=env.process(failing(env)))
