"""No aspect changes what it is not woven on: the whole catalogue on every packaged model, and the tests themselves."""

from __future__ import annotations

import copy
import random  # noqa: TID251 (to be caught at it)
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from epicycle.actors import Actor, InputPort, OutputPort, Streams, Tag, declared_parameters
from epicycle.aspects import (
    Aspect,
    Assert,
    Count,
    JoinPoint,
    MeasurementAspect,
    Memory,
    Noise,
    ObservationAspect,
    PacketLoss,
    Place,
    Probe,
    SelectionParameter,
)
from epicycle.aspects.testing import (
    Woven,
    assert_observes_only,
    assert_order_of_unrelated_aspects_is_free,
    assert_removal_moves_nothing,
    assert_silent_at_zero,
    assert_streams_are_its_own,
)
from epicycle.runner import Simulation, Trial, load_model
from epicycle.runner.execution.engine import Record
from epicycle.runner.model.catalogue.packaged import packaged_models
from tests.aspects.strengths import AT_WORK, AT_ZERO
from tests.engine.engine_parts import load

ENOUGH = 50  # events of a run
SETTINGS = {"collision_avoidance": ["observers=1", "disturbance=0.5"]}
OBSERVERS: list[Aspect] = [Probe(), Count(), Count(by="token"), Assert(that="token == 0")]

# What aspects that select ports or actors select in a model, and where they stand then.
HOMES: dict[str, dict[str, Any]] = {
    "collision_avoidance": {
        "positions": ["main.state", "observer[*].state", "obstacle.state"],
        "target": ["obstacle.state"],
        "sender": "token.robot",
        "groups": {"left": "main", "right": "observer[*]"},
        "at": {"input": "*.peer_plan", "output": "*.sensor.measurement"},
    },
    "grid": {
        "positions": ["**"],
        "target": ["t.output"],
        "groups": {"left": ["t", "first[1]"], "right": ["first[0]", "second[1]"]},
    },
}
GRID = """
actors:
  t: {{type: Ticker, period: 1 ms}}
  first: {{type: Scale, count: {0}}}
  second: {{type: Scale, count: {0}}}
connections: ["t.output -> first[*].input", "first[*].output -> second[*].input"]
run: {{stop: {1} ms}}
"""


@cache
def trial_of(name: str) -> Trial:
    """The first part of a run of a packaged model."""
    model = load_model(name, set=SETTINGS.get(name, ()))
    until = model.stop / 256 if model.stop else 1.0
    while Simulation(model).run(until=until).events < ENOUGH and until < (model.stop or 1000.0):
        until *= 2
    return Trial(model, until=until)


def at_home(aspect: Aspect, model: str, at: str = "**") -> Woven | None:
    """The aspect with what it selects in a model, and where it can stand; None if it cannot."""
    declared = declared_parameters(type(aspect))
    selecting = {name: each for name, each in declared.items() if isinstance(each, SelectionParameter)}
    if not any(each.patterns(getattr(aspect, name)) for name, each in selecting.items()):
        return Woven("tested", aspect, at)
    if model not in HOMES:
        return None
    aspect, home = copy.copy(aspect), HOMES[model]
    for name in home.keys() & declared.keys():
        vars(aspect)[name] = declared[name].convert(home[name])
    return Woven("tested", aspect, home["at"][min(aspect.stands_at)] if at == "**" else at)


def over_models(
    aspect: Aspect, test: Callable[..., None], models: Collection[str] = packaged_models(), **options: Any
) -> int:
    """Do a test on all of these models that an aspect can stand on; how many these are."""
    pairs = 0
    for name in models:
        woven = at_home(aspect, name)
        if woven is not None:
            test(woven.aspect, trial_of(name), woven.at, **options)
            pairs += 1
    return pairs


def dealt(aspects: list[Aspect]) -> Any:
    """Pairs of an aspect and some models: a quarter of all pairs, in which each model meets many aspects, and the rest.

    A model that few aspects can select something in is in all quarters.
    """
    models, cases = packaged_models(), []
    for number, aspect in enumerate(aspects):
        for quarter in range(4):
            share = [name for place, name in enumerate(models) if (number + place) % 4 == quarter or name in HOMES]
            marks = pytest.mark.slow if quarter else ()
            cases.append(pytest.param(aspect, share, id=f"{aspect!r}-{quarter}", marks=marks))
    return pytest.mark.parametrize(("aspect", "models"), cases)


@pytest.mark.slow
@dealt(AT_ZERO)
def test_strength_zero_leaves_every_model_as_it_is(aspect: Aspect, models: list[str], record_property: Any) -> None:
    pairs = over_models(aspect, assert_silent_at_zero, models)
    assert pairs > 0
    record_property("pairs of aspect and model: silent at zero", pairs)


@pytest.mark.slow
@dealt(AT_WORK)
def test_removal_moves_no_stream_of_others(aspect: Aspect, models: list[str], record_property: Any) -> None:
    loss = Woven("loss", PacketLoss(probability=0.1), "**")
    pairs = over_models(aspect, assert_removal_moves_nothing, models, beside=[loss])
    assert pairs > 0
    record_property("pairs of aspect and model: removal moves nothing", pairs)


@pytest.mark.slow
@pytest.mark.parametrize("aspect", OBSERVERS, ids=repr)
def test_observers_only_observe(aspect: Aspect, record_property: Any) -> None:
    pairs = over_models(aspect, assert_observes_only)
    assert pairs == len(packaged_models())
    record_property("pairs of aspect and model: observes only", pairs)


@pytest.mark.slow
@pytest.mark.parametrize("aspect", AT_WORK, ids=repr)
def test_a_hundred_ports_have_streams_of_their_own(aspect: Aspect) -> None:
    woven = at_grid(aspect, "first[*]")
    assert_streams_are_its_own(woven.aspect, grid(100, 2), woven.at)


@pytest.mark.slow
@pytest.mark.parametrize("aspect", AT_WORK, ids=repr)
def test_order_of_unrelated_aspects_is_free(aspect: Aspect) -> None:
    trial = grid(2, 8)
    for other in AT_WORK[AT_WORK.index(aspect) :]:
        first, second = at_grid(aspect, "first[*]"), at_grid(other, "second[*]")
        assert_order_of_unrelated_aspects_is_free(replace(first, name="a"), replace(second, name="b"), trial)


def at_grid(aspect: Aspect, actors: str) -> Woven:
    woven = at_home(aspect, "grid", actors if "actor" in aspect.stands_at else f"{actors}.*")
    assert woven is not None
    return woven


@cache
def grid(count: int, stop: int) -> Trial:
    return Trial(load(GRID.format(count, stop)), seed=5)


# -- the tests themselves find what they are there for -----------------------------------------------------------------


class Thief(MeasurementAspect):
    """Draws from a stream that is not its own."""

    def __init__(self, victim: Actor) -> None:
        super().__init__()
        self.victim = victim

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        self.victim.random.random()
        point.forward(token)


class Wrap(Actor):
    """Sends what comes in a list."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        self.output.send([self.input.value])


class Vandal(MeasurementAspect):
    """Changes a token in place."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        token.append(1)
        point.forward(token)


class Gossip(ObservationAspect):
    """Remembers in its class what it has seen, at whatever port and in whatever run."""

    events = ("seen",)
    seen = 0

    def observe(self, token: Any, point: JoinPoint) -> None:
        Gossip.seen += 1
        point.act("seen", token, self.seen)


class Newcomer(ObservationAspect):
    """Remembers in itself what the last port was."""

    events = ("changed",)
    last = ""

    def observe(self, token: Any, point: JoinPoint) -> None:
        if point.tag == (0, 1):
            self.last = ""
        point.act("changed", token, self.last)
        self.last = point.port


class Meddler(ObservationAspect):
    """Lets a token pass twice."""

    def observe(self, token: Any, point: JoinPoint) -> None:
        point.forward(token)


class Lottery(ObservationAspect):
    """Draws from what all share."""

    def observe(self, token: Any, point: JoinPoint) -> None:
        random.random()
        np.random.rand()  # noqa: NPY002


class Careless:
    """A trial with an engine that makes mistakes: it runs two ports, to each of which one token comes."""

    seed = 0
    streams = Streams(0)
    tag = Tag(0, 1)

    def __init__(self, *, one_stream: bool = False, minds_order: bool = False) -> None:
        self.one_stream = one_stream
        self.minds_order = minds_order
        self.log: list[Record] = []

    def __call__(self, *woven: Woven) -> list[Record]:
        self.log = []
        for place, each in enumerate(woven):
            for port in ["a.input", "b.input"] if each.at == "**" else each.at:
                where = Place(each.name, port, "a" if self.one_stream else port, port)
                point = JoinPoint(where, Memory(), self)
                each.aspect.pass_token(float(place if self.minds_order else 0), point)
        return sorted(self.log, key=lambda record: record.aspect)

    def forward(self, token: Any) -> None:
        pass

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        raise NotImplementedError

    def latest(self, port: str) -> Any:
        raise NotImplementedError

    def note(self, place: Place, event: str, token: Any) -> None:
        self.log.append(Record(self.tag, event, place.owner, place.name, None, place.aspect, token))

    def record(self, signal: str, token: Any) -> None:
        pass

    def stop(self, reason: str) -> None:
        raise NotImplementedError


def told(test: Callable[..., None], *arguments: Any, **options: Any) -> str:
    with pytest.raises(AssertionError) as caught:
        test(*arguments, **options)
    return str(caught.value)


def test_what_is_not_silent_is_found() -> None:
    assert told(assert_silent_at_zero, PacketLoss(probability=1), grid(2, 8), "second[1].input") == (
        "PacketLoss(probability=1.0) at second[1].input is not silent: event 4 differs\n"
        "  without it: (0 s, 1) second[0].output send 0\n"
        "  with it: (0 s, 1) second[1].input tested: dropped 0"
    )
    assert told(assert_silent_at_zero, Noise(deviation=1e-9), grid(2, 8), "second[1].output").startswith(
        "Noise(deviation=1e-09) at second[1].output is not silent: event 5 differs\n"
    )


def test_what_does_not_only_observe_is_found() -> None:
    assert told(assert_observes_only, Meddler(), grid(2, 8), "t.output").startswith(
        "Meddler() at t.output does more than observe: event 2 differs\n"
    )
    stops = Assert(that="token < 3", on_violation="stop")
    assert told(assert_observes_only, stops, grid(2, 8), "t.output") == (
        f"{stops!r} at t.output does more than observe: event 21 differs\n"
        "  without it: (0.004 s, 1) t.output send 4\n"
        "  with it, its own events left out: nothing more"
    )


def test_who_draws_from_the_stream_of_another_is_found() -> None:
    model = load(
        """
actors: {clock: {type: PoissonClock, mean_interval: 1 ms}, a: {type: Scale}}
connections: [clock.output -> a.input]
run: {stop: 20 ms}
"""
    )
    message = told(assert_removal_moves_nothing, Thief(model.graph.actors["clock"]), Trial(model))
    assert message.startswith(
        "Thief() at ** changes more than its own events, although none of its decisions was carried out: event 3 "
        "differs\n"
    )


def test_who_changes_tokens_in_place_is_found() -> None:
    text = "actors: {t: {type: Ticker}, a: {type: Wrap}}\nconnections: [t.output -> a.input]"
    model = load(text, types=[Wrap])
    assert "Vandal() at a.output changes more than its own events" in told(
        assert_removal_moves_nothing, Vandal(), Trial(model, until=3), at="a.output"
    )


def test_streams_that_are_not_ones_own_are_found() -> None:
    assert told(assert_streams_are_its_own, Lottery(), grid(3, 4)) == (
        "Lottery() draws from a global generator; use point.random"
    )
    assert told(assert_streams_are_its_own, Gossip(), grid(3, 4), "first[*].input") == (
        "Gossip() at first[*].input acts differently in a second run: event 2 differs\n  the first: (0 s, 1) "
        "first[0].input tested: seen [0, 16]\n  the second: (0 s, 1) first[0].input tested: seen [0, 31]"
    )
    assert told(assert_streams_are_its_own, Newcomer(), grid(3, 4), "first[*].input") == (
        "Newcomer(): what it decides at a port depends on where else it is attached: event 3 differs\n  at "
        "first[*].input: (0.001 s, 1) first[0].input tested: changed [1, first[2].input]\n  at half of that: (0.001 "
        "s, 1) first[0].input tested: changed [1, first[0].input]"
    )
    assert told(assert_streams_are_its_own, Probe(), Careless(one_stream=True)) == (
        "Probe() has the same random stream for a.input and b.input"
    )


def test_who_depends_on_the_order_is_found() -> None:
    first, second = Woven("a", Probe(), ["a.input"]), Woven("b", Probe(), ["b.input"])
    assert_order_of_unrelated_aspects_is_free(first, second, Careless())
    assert told(assert_order_of_unrelated_aspects_is_free, first, second, Careless(minds_order=True)) == (
        "Probe() and Probe() depend on the order of their declaration: event 1 differs\n"
        "  a first: (0 s, 1) a.input a: seen 0\n"
        "  b first: (0 s, 1) a.input a: seen 1"
    )
    at_one = Woven("a", Noise(deviation=1), "first[*].output"), Woven("b", Noise(deviation=1), "first[1].*")
    assert told(assert_order_of_unrelated_aspects_is_free, *at_one, grid(2, 4)) == (
        "a and b are both attached to first[1].output, so their order matters"
    )


def test_what_nothing_passes_shows_nothing() -> None:
    late = Noise(deviation=0, **{"from": 10})
    message = (
        "nothing has passed Noise(deviation=0.0, from=10.0) at **, so the test shows nothing: let the model run longer"
    )
    for test in (assert_silent_at_zero, assert_removal_moves_nothing, assert_streams_are_its_own):
        assert told(test, late, grid(2, 8)) == message
