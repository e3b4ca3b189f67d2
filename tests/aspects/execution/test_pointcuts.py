"""Where aspects of execution stand: at actors, and at composites for all the actors in them."""

from __future__ import annotations

import pytest

from epicycle.actors import Clock
from epicycle.aspects import ExecutionTime, PacketLoss
from epicycle.runner import Model, ModelError, Simulation
from epicycle.runner.show.graph.outlines import outline
from tests.aspects.execution.execution_parts import PARTS, sent
from tests.engine.engine_parts import Scale, load, simulate

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
            "SkipFiring attaches to actors, but a.input is a port\n   help: write 'a', without the port",
        ),
        (
            "type: SkipFiring, probability: 1, at: 'pair[*].*.output'",
            (
                "SkipFiring attaches to actors, but pair[0].one.output is a port\n"
                "   help: write 'pair[*].*', without the port"
            ),
        ),
        (
            "type: SkipFiring, probability: 1, at: t.output -> a.input",
            (
                "SkipFiring attaches to actors, not to connections\n"
                "   help: write 'a' for the receiving actor"
            ),
        ),
        (
            "type: SkipFiring, probability: 1, at: {type: Scale, port: input}",
            "SkipFiring attaches to actors, not to their ports\n   help: leave 'port' out",
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
            "'a..b' is not a pointcut: '' is not a name, a name with an index, '*' or '**'",
        ),
        (
            "type: SkipFiring, probability: 1, at: {type: Scael}",
            "there is no actor of type 'Scael', did you mean 'Scale'?\n   help: types here: Pair, Scale, Ticker",
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


def test_weaving_in_python() -> None:
    model = Model("m", stop=3)
    clock, scale = model.add(Clock("clock", period=1)), model.add(Scale("scale"))
    model.connect(clock.output, scale.inputs["input"])
    woven = model.weave("slow", ExecutionTime(time=0.5), at=scale)
    assert woven.actors == {"scale": "scale"}
    assert sent(Simulation(model, keep_log=True).run(), "scale") == [(0.5, 0), (1.5, 1), (2.5, 2)]
    for wrong, message in [
        (Scale("scale"), "scale is not part of this model"),
        (scale.outputs["output"], "aspect more: ExecutionTime attaches to actors, but scale.output is a port"),
    ]:
        with pytest.raises(ModelError) as caught:
            model.weave("more", ExecutionTime(time=0.5), at=wrong)
        assert [problem.message for problem in caught.value.problems] == [message]
    with pytest.raises(ModelError) as caught:
        model.weave("loss", PacketLoss(probability=1), at=scale)  # type: ignore[arg-type]
    assert [problem.message for problem in caught.value.problems] == ["scale is an actor, not a port"]
    model.remove("scale")
    assert [each.actors for each in model.aspects] == [{}]


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
    assert {woven.name: woven.actors for woven in simulation.model.aspects} == {
        "single.slow": {"single.one": "single.one"}
    }
    assert [time for time, _ in sent(results, "single.one")] == [1, 2, 3]


def test_drawings_mark_actors() -> None:
    model = load(PARTS.format('type: SkipFiring, probability: 0, at: ["a", "pair[1].two"]'))
    for depth, marked in [
        (1, {"a": ("it",), "pair[1]": (), "pair[1].two": ("it",)}),
        (0, {"a": ("it",), "pair[1]": ("it",)}),
    ]:
        boxes = {box.path: box.aspects for box in outline(model, depth).root.walk()}
        assert marked.items() <= boxes.items()
        assert not any(aspects for path, aspects in boxes.items() if path not in marked)
