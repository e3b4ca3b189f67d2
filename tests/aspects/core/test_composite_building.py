"""Aspects that are models, in models that are built or changed in Python, and brought along by disturbances."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.aspects import PacketLoss
from epicycle.runner import ModelError, load_composite, load_model
from epicycle.runner.model.build.model import Model
from tests.aspects.core.composite_parts import CLASSES, PAIR, Negate, acts, load, pair, run, sends
from tests.engine.engine_parts import Join, Scale, Ticker


def python_pair() -> Model:
    model = Model("pair", stop=4)
    ticker, join = model.add(Ticker("t", limit=3)), model.add(Join("j"))
    for name, factor in (("a", 2), ("b", 3)):
        scale = model.add(Scale(name, factor=factor))
        model.connect(ticker.output, scale.input)
        model.connect(scale.output, join.input)
    return model


def library(tmp_path: Path) -> Path:
    path = tmp_path / "media.yaml"
    path.write_text(CLASSES, encoding="utf-8")
    return path


def test_models_built_in_python(tmp_path: Path) -> None:
    desk = load_composite(library(tmp_path), "Desk", types=[Negate])
    crossing = load_composite(library(tmp_path), "Crossing", types=[Negate])
    model = python_pair()
    model.weave("net", desk("net", time=0.1), at=[model["a"].input, "b.input"])
    assert [time for time, *_ in acts(run(model), "delivered")][:2] == [0.1, 0.2]
    model.unweave("net")
    model.weave("cpu", desk("cpu"), at=[model["a"], "b"], time="1 s")
    assert [time for time, *_ in acts(run(model), "executed")][:2] == [0.3, 0.6]
    model.unweave("cpu")
    assert not model.graph.composites
    assert not model.aspects
    assert run(model).digest == run(python_pair()).digest
    model.weave("net", crossing("net"), at={"east": model["a"].input, "west": ["b.input"]})
    assert [(time, port) for time, _, port, _ in acts(run(model), "delivered")][:2] == [
        (0.0, "a.input"),
        (0.5, "b.input"),
    ]
    model.remove("net")
    assert not model.aspects

    net = model.composite("medium", inputs=["request"], outputs=["response"])
    net.add(Negate("negate"))
    net.connect("request -> negate.input")
    net.connect("negate.output -> response")
    model.weave("net", net, at="a.input")
    assert [value for *_, value in sends(run(model), "a.output")] == [0.0, -2.0, -4.0]
    with pytest.raises(ModelError, match="medium is already the model of another aspect"):
        model.weave("again", net, at="b.input")
    assert [woven.name for woven in model.aspects] == ["net"]


def test_a_weaving_that_fails_changes_nothing(tmp_path: Path) -> None:
    desk = load_composite(library(tmp_path), "Desk", types=[Negate])
    model = python_pair()
    for at, message in (
        ("a.inptu", "'a.inptu' matches no port"),
        ("net.server.input", "it cannot attach to its own inside"),
    ):
        with pytest.raises(ModelError, match=message):
            model.weave("net", desk("net"), at=at)
    assert run(model).digest == run(python_pair()).digest
    model.weave("loss", PacketLoss(probability=0), at="a.input")
    with pytest.raises(ModelError, match="there is already an aspect 'loss'"):
        model.weave("loss", desk("net"), at="a.input")
    assert not model.graph.composites


def test_a_loaded_model_can_be_changed(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(
        "model: m" + PAIR.replace("{ASPECTS}", "{net: {type: Desk, at: [a.input, b.input]}}"), encoding="utf-8"
    )
    model = load_model(path, types=[Ticker, Scale, Join, Negate])
    model.unweave("net")
    assert run(model).digest == run(pair("")).digest


DISTURBANCE = """
disturbance: congestion
parameters: {time: {value: 100 ms, doc: how long a message takes}}
composites:
  Line2:
    parameters: {time: }
    inputs: [request]
    outputs: [response]
    actors: {server: {type: Server, service_time: "${time}"}}
    connections: [request -> server.input, server.output -> response]
aspects:
  net: {type: Line2, time: "${time}", at: [a.input, b.input]}
"""


def test_a_disturbance_brings_its_model_along(tmp_path: Path) -> None:
    path = tmp_path / "congestion.yaml"
    path.write_text(DISTURBANCE, encoding="utf-8")
    text = PAIR.replace("{ASPECTS}", "{}")
    loaded = load(text, disturb=path)
    assert [time for time, *_ in acts(run(loaded), "delivered")][:2] == [0.1, 0.2]
    assert [time for time, *_ in acts(run(load(text, disturb=path, set=["time=1 ms"])), "delivered")][:1] == [0.001]
    later = load(text)
    later.disturb(path)
    assert run(later).digest == run(loaded).digest
    later.unweave("net")
    assert run(later).digest == run(load(text)).digest

    path.write_text(DISTURBANCE.replace("b.input]", "b.inptu]"), encoding="utf-8")
    with pytest.raises(ModelError, match=r"'b.inptu' matches no port"):
        later.disturb(path)
    assert run(later).digest == run(load(text)).digest
    path.write_text(DISTURBANCE.replace("Line2", "Line"), encoding="utf-8")
    with pytest.raises(ModelError, match=r"there is already a composite 'Line'"):
        load(text, disturb=path)
    path.write_text(DISTURBANCE.replace("net:", "a:"), encoding="utf-8")
    for attempt in (lambda: later.disturb(path), lambda: load(text, disturb=path)):
        with pytest.raises(ModelError, match=r"'a' is the name of both an actor and an aspect that is a model"):
            attempt()


def test_the_streams_of_a_model_in_an_aspect_are_its_own() -> None:
    """Another aspect, before or behind, moves no random number inside."""
    random = PAIR.replace('service_time: "${time}"', "distribution: {type: Exponential, mean: 0.1}")
    random = random.replace("    parameters: {time: 300 ms}\n", "")
    alone = run(load(random.replace("{ASPECTS}", "{net: {type: Desk, at: a.input}}")))
    others = "noise: {type: Noise, deviation: 1, at: b.output}, two: {type: Desk, at: b.input}"
    both = run(load(random.replace("{ASPECTS}", f"{{{others}, net: {{type: Desk, at: a.input}}}}")))
    assert sends(alone, "a.output") == sends(both, "a.output")
    assert len({tag for tag, *_ in sends(alone, "a.output")}) == 3
