"""What a firing costs: by the ports that trigger it, the same for all aspects that let firings take time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import Actor, Clock, InputPort, OutputPort
from epicycle.aspects import ExecutionTime, Processor
from epicycle.runner import Model, ModelError, Results, Simulation, load_model
from tests.engine.engine_parts import TYPES, load, simulate


class Listener(Actor):
    """Works when it is told to go, and takes note of news in between."""

    go: InputPort[Any] = InputPort(Any)
    news: InputPort[Any] = InputPort(Any, required=False, triggers=False)
    extra: InputPort[Any] = InputPort(Any, required=False)
    fired = OutputPort(str)

    def fire(self) -> None:
        self.fired.send(" ".join(name for name, port in self.inputs.items() if port.present))


MODEL = """
actors:
  go: {{type: Clock, period: 1 s}}
  news: {{type: Clock, period: 1 s, offset: 500 ms}}
  extra: {{type: Clock, period: 1 s, offset: 750 ms}}
  a: {{type: Listener}}
  b: {{type: Listener}}
connections: [go.output -> a.go, news.output -> a.news, extra.output -> a.extra, news.output -> b.go]
aspects: {{it: {{{}}}}}
run: {{stop: 2.9 s}}
"""


def fired(aspect: str, **options: Any) -> tuple[list[tuple[float, str]], Results]:
    """When ``a`` fired, and for what."""
    results = simulate(MODEL.format(aspect), types=[Listener], **options)[1]
    return firings(results), results


def firings(results: Results) -> list[tuple[float, str]]:
    return [(r.tag.seconds, r.value) for r in results.log.records if (r.actor, r.event) == ("a", "send")]


def rounds(go: float, news: float, extra: float) -> list[tuple[float, str]]:
    times = ((n + at, port) for n in range(3) for at, port in ((go, "go"), (news, "news"), (extra, "extra")))
    return [(round(time, 9), port) for time, port in times if time < 2.9]


@pytest.mark.parametrize("kind", ["ExecutionTime", "Processor"])
@pytest.mark.parametrize(
    ("time", "expected"),
    [
        ("0.1 s", rounds(0.1, 0.5, 0.85)),  # of the news it only takes note
        ("0.6 s", [(0.6, "go"), (0.6, "news"), (1.35, "extra"), (1.95, "go"), (1.95, "news"), (2.55, "extra")]),
        ("{go: 0.1 s}", rounds(0.1, 0.5, 0.75)),
        ("{go: 0.1 s, news: 0.2 s}", rounds(0.1, 0.7, 0.75)),
        ("{go: {type: Constant, value: 0.1}, extra: 50 ms}", rounds(0.1, 0.5, 0.8)),
        ("{extra: 0 s}", rounds(0.0, 0.5, 0.75)),
    ],
)
def test_a_firing_costs_what_its_ports_cost(kind: str, time: str, expected: list[tuple[float, str]]) -> None:
    assert fired(f"type: {kind}, time: {time}, at: a")[0] == expected


def test_a_firing_for_several_ports_costs_as_much_as_the_dearest() -> None:
    together = MODEL.replace("offset: 500 ms", "offset: 0 s").replace("offset: 750 ms", "offset: 0 s")
    for time, at in (("{go: 20 ms, extra: 30 ms}", 0.03), ("{news: 1 ms}", 0.001), ("50 ms", 0.05)):
        results = simulate(together.format(f"type: ExecutionTime, time: {time}, at: a"), types=[Listener])[1]
        assert firings(results) == [(n + at, "go news extra") for n in range(3)]


def test_who_is_busy_skips_no_news() -> None:
    """They wait until it can take note of them; what would have taken time is skipped."""
    found, results = fired("type: ExecutionTime, time: 0.8 s, busy: skip, at: a")
    assert found == [(0.8, "go"), (0.8, "news"), (1.8, "go"), (1.8, "news"), (2.8, "go"), (2.8, "news")]
    assert results.aspects["it"]["skipped"] == 3


def test_to_take_note_needs_no_processor() -> None:
    """At 0.5 s it is b's for 0.4 s: what a has to do then waits, what a only hears does not."""
    found, _ = fired("type: Processor, times: {a: {go: 100 ms, extra: 100 ms}, b: 400 ms}, at: [a, b]")
    assert found == rounds(0.1, 0.5, 1.0)


def test_what_is_measured_and_replayed_is_work_alone(tmp_path: Path) -> None:
    _, results = fired("type: ExecutionTime, measure: true, at: a")
    assert len(results["it@a"].tokens) == 6  # for go and extra
    (tmp_path / "times.csv").write_text("value\n0.1\n0.2\n")
    text = MODEL.format("type: ExecutionTime, times: times.csv, at: a")
    (tmp_path / "m.yaml").write_text(f"model: m\n{text}")
    model = load_model(tmp_path / "m.yaml", types=[*TYPES, Listener])
    assert firings(Simulation(model, keep_log=True).run()) == rounds(0.1, 0.5, 0.95)


def test_a_composite_as_a_processor_is_told_the_same() -> None:
    text = """
composites:
  Core:
    inputs: [request]
    outputs: [response]
    actors:
      cost: {type: Expression, expression: "job['execution_time']"}
      server: {type: Server}
    connections:
      - request -> cost.job, server.input
      - cost.output -> server.service_time
      - server.output -> response
""" + MODEL.format("type: Core, at: [{at: a, time: {go: 100 ms, extra: 20 ms}}]")
    results = simulate(text, types=[Listener])[1]
    assert firings(results) == rounds(0.1, 0.5, 0.77)


def test_in_python() -> None:
    model = Model("m", stop=1.9)
    listener = model.add(Listener("a"))
    model.connect(model.add(Clock("go", period=1)).output, listener.go)
    model.connect(model.add(Clock("news", period=1, offset=0.5)).output, listener.news)
    model.weave("slow", ExecutionTime(time={"go": "60 ms"}), at=listener)
    results = Simulation(model, keep_log=True).run()
    assert firings(results) == [(0.06, "go"), (0.5, "news"), (1.06, "go"), (1.5, "news")]
    assert repr(Processor(time={"go": 0.5})) == "Processor(time={'go': 0.5})"
    with pytest.raises(ModelError) as caught:
        model.weave("more", ExecutionTime(time={"new": 0.1}), at=listener)
    problem, *_, advice = str(caught.value).partition("error: ")[2].splitlines()
    assert problem == "aspect more: time: no actor that this applies to has an input 'new', did you mean 'news'?"
    assert advice == "   help: their inputs: go, news, extra"


def test_with_an_actor() -> None:
    @ExecutionTime(time={"goo": 1}).at()
    class Decorated(Listener):
        """Comes with a mistake."""

    with pytest.raises(ModelError) as caught:
        load(
            "actors: {t: {type: Clock}, a: {type: Decorated}}\nconnections: [t.output -> a.go]\nrun: {stop: 1 s}",
            types=[*TYPES, Decorated],
        )
    assert "aspect a.execution_time: time: no actor that this applies to has an input 'goo', did you mean 'go'?" in str(
        caught.value
    )
