"""What changes a model does all of it or nothing; and a model is part of one run at a time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import Actor, Clock, EpicycleError, InputPort, Merge, Recorder, Scale, Server
from epicycle.aspects import CommunicationAspect, JoinPoint, PacketLoss, Processor
from epicycle.runner import Model, ModelError, Simulation, load_composite, load_model

LIBRARY = """
composites:
  Line:
    parameters: {factor: {value: 1}}
    inputs: [request, other]
    outputs: [response]
    actors: {scale: {type: Scale, factor: "${factor}", count: 2}, last: {type: Recorder}}
    connections:
      - request -> scale[0].input
      - scale[0].output -> scale[1].input, last.input
      - scale[1].output -> response
    aspects: {lossy: {type: PacketLoss, probability: 0.5, at: "scale[*].input"}}
"""
MODEL = """
model: m
include: [library.yaml]
parameters: {factor: 2, none: 0}
actors:
  clock: {type: Clock, period: 1}
  line: {type: Line, factor: "${factor}"}
  more: {type: Line, count: 2}
  absent: {type: Scale, count: "${none}"}
  shop: {type: Server, service_time: 0.1}
  beside: {type: Line}
connections:
  - clock.output -> line.request, more[*].request, shop.input
  - clock.output -> beside.request
aspects:
  loss: {type: PacketLoss, probability: 0.3, at: shop.input}
run: {stop: 20, record: [line.response], stop_when: clock.output}
metrics: {ticks: {of: clock.output, take: count}}
"""
MODES = """
model: m
composites:
  Lit: {actors: {clock: {type: Clock, period: 1}}}
  Lamp: {modes: {off: , on: {refinement: Lit}}, transitions: [off -> on after 1 s]}
actors: {lamp: {type: Lamp}}
"""
DISTURBANCE = """
disturbance: d
composites:
  Wait:
    inputs: [request]
    outputs: [response]
    actors: {wait: {type: Scale}, again: {type: Scale}}
    connections: [request -> wait.input, wait.output -> again.input, again.output -> response]
aspects:
  wait: {type: Wait, at: shop.input}
  first: {type: PacketLoss, probability: 0.1, at: line.request}
  second: {type: PacketLoss, probability: 7, at: shop.nowhere}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in (("library.yaml", LIBRARY), ("m.yaml", MODEL), ("d.yaml", DISTURBANCE)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def state(model: Model) -> Any:
    """All that a model consists of."""
    graph = model.graph
    scopes = [model, *map(model.__getitem__, graph.composites)]
    return {
        "ports": [(path, str(node)) for path, node in graph.ports.items()],
        "hops": [(str(edge), edge.order, edge.delay) for edge in graph.edges],
        "ways": [[str(edge) for edge in (*graph.incoming(port), *graph.outgoing(port))] for port in graph.ports],
        "actors": [(path, id(actor), actor.path, actor.is_part) for path, actor in graph.actors.items()],
        "components": [(path, str(each)) for path, each in graph.components.items()],
        "domains": [(path, str(each)) for path, each in graph.domains.items()],
        "gaps": (dict(model.graph.gaps), set(model.graph.fed)),
        "rest": (model.graph.is_wired, graph.next_order, list(map(str, graph.detours)), model.is_checked),
        "aspects": [(woven.name, id(woven), repr(woven)) for woven in model.aspects],
        "watched": (
            model.output.recorded[:],
            model.output.stop_ports[:],
            [repr(metric) for metric in model.output.metrics],
            model.stop,
        ),
        "scopes": [(id(scope), list(graph.parts(scope.path)), repr(scope)) for scope in scopes],
    }


@PacketLoss(probability=0.1).at("nowhere", name="odd")
class Misfit(Actor):
    """Comes with an aspect for a port that its instances do not have."""

    input = InputPort(float)

    def own_ports(self) -> dict[str, Any]:
        return {}


class Nosy(CommunicationAspect):
    """Asks what it must not."""

    def __init__(self, doing: Callable[[], object]) -> None:
        super().__init__()
        self.doing = doing

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        self.doing()


def line(folder: Path, name: str = "fresh", **values: object) -> Any:
    return load_composite(folder / "library.yaml", "Line")(name, **values)


REFUSED: dict[str, Callable[[Model, Path], object]] = {
    "disturb: a file that is wrong": lambda m, f: m.disturb(f / "d.yaml"),
    "disturb: no such file": lambda m, f: m.disturb("nothing.yaml"),
    "add: a name that is taken": lambda m, f: m.add(Scale("shop")),
    "add: no name": lambda m, f: m.add(Scale("a b")),
    "add: not the next of its array": lambda m, f: m.add(line(f, "more[4]")),
    "add: an aspect of its own that is wrong": lambda m, f: m.add(Misfit("misfit")),
    "add: a class with a wrong parameter": lambda m, f: m.add(line(f, factor="red")),
    "add: no actor": lambda m, f: m.add("actor"),  # type: ignore[call-overload]
    "add: inside": lambda m, f: m["line"].add(Scale("last")),
    "composite: a wrong port": lambda m, f: m.composite("inner", inputs=["a", "b", "a"], director=True),
    "composite: a wrong clock": lambda m, f: m.composite("inner", director=True, drift=0),
    "composite: in another": lambda m, f: m["more[1]"].composite("inner", outputs=["o", "o"]),
    "input: there is one": lambda m, f: m["line"].input("request"),
    "output: no name": lambda m, f: m["line"].output("1"),
    "connect: one of several": lambda m, f: m.connect("clock.output", ["line.other", "more[*].other", "shop.nothing"]),
    "connect: two writers": lambda m, f: m.connect("line.response -> shop.input"),
    "connect: a wrong delay": lambda m, f: m.connect("clock.output -> line.other", delay="red"),
    "connect: not a port": lambda m, f: m.connect(m["clock"], m["shop"].input),
    "disconnect: not connected": lambda m, f: m.disconnect("clock.output -> line.other"),
    "weave: nowhere": lambda m, f: m.weave("more_loss", PacketLoss(probability=0.1), at=["shop.input", "nowhere.*"]),
    "weave: the name is taken": lambda m, f: m.weave("loss", PacketLoss(probability=0.1), at="shop.input"),
    "weave: a model, nowhere": lambda m, f: m.weave("by", line(f), at={"request": "shop.input", "other": "nowhere"}),
    "weave: a model by no port of it": lambda m, f: m.weave("by", line(f), at={"nothing": "shop.input"}),
    "weave: a composite that is connected": lambda m, f: m.weave("by", m["beside"], at={"request": "shop.input"}),
    "weave: a composite by no port of it": lambda m, f: m.weave("by", m["beside"], at="shop.input"),
    "weave: no aspect": lambda m, f: m.weave("by", PacketLoss, at="shop.input"),  # type: ignore[arg-type]
    "unweave: none of that name": lambda m, f: m.unweave("nothing"),
    "unweave: of a class": lambda m, f: m["line"].unweave("nothing"),
    "remove: none of that name": lambda m, f: m.remove("nothing"),
    "remove: not the last": lambda m, f: m.remove("more[0]"),
    "record: one of several": lambda m, f: m.record("shop.output", "nothing.output"),
    "stop_when: an input": lambda m, f: m.stop_when("line.response", "shop.input"),
    "metric: the name is taken": lambda m, f: m.metric("ticks", of="shop.output"),
    "metric: no such port": lambda m, f: m.metric("tocks", of="shop.nothing"),
    "stop: a colour": lambda m, f: setattr(m, "stop", "red"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_refused_leaves_no_trace(what: str, folder: Path) -> None:
    model = load_model(folder / "m.yaml")
    digest = Simulation(load_model(folder / "m.yaml")).run().digest
    before = state(model)
    for _ in range(2):
        with pytest.raises((EpicycleError, AttributeError)):
            REFUSED[what](model, folder)
        assert state(model) == before
    assert Simulation(model).run().digest == digest
    # All that is there is still found, and can be changed.
    model.remove("shop")
    model.remove("more[1]")
    model["line"].disconnect("scale[1].output -> response")
    model.unweave("line.lossy")
    assert "shop" not in model.graph.actors
    assert [woven.name for woven in model.aspects] == ["more[0].lossy", "beside.lossy", "loss"]


def test_an_actor_that_was_refused_can_be_added_elsewhere() -> None:
    model = Model("m")
    inner = model.composite("inner")
    actor = Misfit("misfit")
    for _ in range(2):
        with pytest.raises(ModelError, match="misfit has no port 'nowhere'"):
            inner.add(actor)
        assert (actor.path, actor.is_part, actor.input.path) == ("misfit", False, "misfit.input")
    clock = Clock("clock", period=1)
    inner.add(clock)
    with pytest.raises(ModelError, match="is already part of a model"):
        model.add(clock)
    assert clock.path == "inner.clock"


def test_after_a_refused_disturbance_what_it_would_have_added_is_not_there(folder: Path) -> None:
    model = load_model(folder / "m.yaml")
    with pytest.raises(ModelError):
        model.disturb(folder / "d.yaml")
    with pytest.raises(ModelError) as caught:
        model.remove("wait")
    (problem,) = caught.value.problems
    assert problem.message == "m has no actor 'wait'"
    assert problem.help == ("valid actors: clock, line, more[0], more[1], shop, beside",)
    (folder / "d.yaml").write_text(DISTURBANCE.rpartition("  second")[0], encoding="utf-8")
    assert [woven.name for woven in model.disturb(folder / "d.yaml")] == ["wait", "first"]
    model.remove("wait")
    assert [woven.name for woven in model.aspects if "." not in woven.name] == ["loss", "first"]


def test_a_scope_survives_what_is_removed_beside_it(folder: Path) -> None:
    model = load_model(folder / "m.yaml")
    inner = model["line"]
    model.remove("shop")
    assert model["line"] is inner
    inner.add(Scale("third"))
    inner.connect("other -> third.input")
    with pytest.raises(ModelError, match=r"there is already a line\.third"):
        inner.add(Scale("third"))


def test_a_run_is_not_changed_with_its_model() -> None:
    def busy(doing: Callable[[Model], object]) -> Model:
        model = Model("busy", stop=3)
        clock, recorder = model.add(Clock("clock", period=1)), model.add(Recorder("recorder"))
        model.connect(clock.output, recorder.input)
        model.weave("nosy", Nosy(lambda: doing(model)), at=recorder.input)
        return model

    def once(change: Callable[[Model], object]) -> Callable[[Model], object]:
        waiting = [change]
        return lambda model: waiting.pop()(model) if waiting else None

    expected = Simulation(busy(lambda model: None)).run().digest
    for change in (
        lambda model: model.add(Merge("merge")),
        lambda model: model.remove("clock"),
        lambda model: model.record("clock.output"),
        lambda model: model.unweave("nosy"),
        lambda model: Simulation(model).run(until=0),
    ):
        model = busy(once(change))
        assert Simulation(model).run().digest == expected


def test_a_model_whose_run_failed_is_run_again() -> None:
    model = Model("m", stop=3)
    server = model.add(Server("server", service_time=1))
    clock = model.add(Clock("clock", period=1))
    model.connect(clock.output, server.input)
    woven = model.weave("nosy", Nosy(lambda: 1 / 0), at=server.input)
    with pytest.raises(EpicycleError, match="aspect nosy failed"):
        Simulation(model).run()
    model.unweave(woven.name)
    assert Simulation(model).run().end == 3


def test_a_graph_that_is_run_is_frozen() -> None:
    """A change goes to a copy: the graph of a run, and the run itself, stay as they are."""
    model = Model("m", stop=3)
    clock, scale = model.add(Clock("clock", period=1)), model.add(Scale("scale"))
    model.connect(clock.output, scale.input)
    simulation, graph = Simulation(model), model.graph
    before = state(model)
    for change in (
        lambda: graph.connect("clock.output", "scale.input", None, None),
        lambda: graph.remove("scale"),
        lambda: graph.add_actor(Clock("other", period=1), None),
        lambda: graph.add_component("c", "C"),
        lambda: graph.disconnect(next(iter(graph.edges))),
    ):
        with pytest.raises(RuntimeError) as caught:
            change()
        assert str(caught.value) == "a frozen graph cannot be changed: change a copy"
    assert state(model) == before
    model.remove("scale")
    model.add(Recorder("recorder"))
    model.connect(clock.output, "recorder.input")
    assert model.graph is not graph
    assert list(graph.actors) == ["clock", "scale"]
    assert simulation.run().digest == Simulation(_same(Scale("scale"))).run().digest
    assert Simulation(model).run().digest != simulation.log.digest


def test_an_actor_of_a_frozen_graph_stays_where_it_is() -> None:
    model = Model("m", stop=3)
    clock, scale = model.add(Clock("clock", period=1)), model.add(Scale("scale"))
    model.connect(clock.output, scale.input)
    simulation = Simulation(model)
    model.remove("scale")
    with pytest.raises(ModelError) as caught:
        model.composite("inner").add(scale)
    (problem,) = caught.value.problems
    assert problem.message == "scale is already part of a model, and an actor belongs to only one"
    assert scale.path == "scale"
    assert simulation.run().digest == Simulation(_same(Scale("scale"))).run().digest
    model.add(Scale("scale"))
    model.remove("scale")
    model.add(Recorder("scale"))


def test_what_is_woven_around_a_checked_model_is_checked() -> None:
    model = _same(Scale("scale"))
    model.weave("one", Processor(time=0.1), at="scale")
    Simulation(model)
    model.weave("other", Processor(time=0.1), at="scale")
    with pytest.raises(ModelError) as caught:
        Simulation(model)
    (problem,) = caught.value.problems
    assert problem.message == "aspect other: scale already runs on the processor 'one'"


def test_a_composite_with_modes_loses_none_of_its_parts(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(MODES, encoding="utf-8")
    model = load_model(tmp_path / "m.yaml")
    for name in ("machine", "on"):
        with pytest.raises(ModelError) as caught:
            model["lamp"].remove(name)
        (problem,) = caught.value.problems
        assert (problem.message, problem.help) == (
            f"lamp.{name} belongs to the modes of lamp",
            ("remove lamp as a whole",),
        )
    model.remove("lamp")


def _same(receiver: Scale) -> Model:
    model = Model("m", stop=3)
    clock = model.add(Clock("clock", period=1))
    model.add(receiver)
    model.connect(clock.output, "scale.input")
    return model
