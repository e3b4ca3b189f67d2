"""Aspects at parameters: an actor finds a parameter changed whenever it fires."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from epicycle.actors import Actor, InputPort, OutputPort, Parameter, array_parameter, random_stream
from epicycle.aspects import Drift
from epicycle.runner import ActorError, Model, ModelError, Simulation
from epicycle.runner.execution.engine import Results
from tests.engine.engine_parts import Scale, Ticker, load


class Gauge(Actor):
    """Sends its parameters whenever a token comes."""

    input: InputPort[Any] = InputPort(Any, required=False)
    output: OutputPort[Any] = OutputPort(Any)

    gain = Parameter(float, 2.0, min=0.0, max=10.0)
    steps = Parameter(int, 4)
    at = array_parameter((2,), (1.0, -1.0))
    name = Parameter(str, "x")
    limit: Parameter[float | None] = Parameter(float, None)

    def fire(self) -> None:
        self.output.send([self.gain, self.steps, tuple(self.at)])


MODEL = """
actors:
  t: {type: Ticker}
  g: {type: Gauge, count: 2, tags: gauge}
  s: {type: Scale, factor: 3}
  d: {type: TimeDelay, delay: 1.5 s}
connections: ["t.output -> g[*].input", t.output -> s.input, s.output -> d.input]
aspects: {ASPECTS}
run: {stop: 4 s}
"""


def model(aspects: str, **changes: Any) -> Model:
    return load(MODEL.replace("{ASPECTS}", f"{{{aspects}}}"), types=[Gauge], **changes)


def run(loaded: Model, seed: int = 0) -> Results:
    return Simulation(loaded, seed=seed, keep_log=True).run()


def sent(results: Results, path: str) -> list[Any]:
    return [record.value for record in results.log.records if record.event == "send" and record.actor == path]


def test_a_parameter_drifts() -> None:
    loaded = model("warm: {type: Drift, rate: 0.5, walk: 0.1, at: 'g[0].gain'}")
    results = run(loaded)
    random = random_stream(0, "g[0].gain", "aspect warm")
    walked, expected = 0.0, []
    for second in range(5):
        walked += float(random.normal(size=1)[0]) * (second > 0)
        expected.append(2.0 + 0.5 * second + 0.1 * walked)
    assert [gain for gain, *_ in sent(results, "g[0]")] == pytest.approx(expected)
    assert [gain for gain, *_ in sent(results, "g[1]")] == [2.0] * 5
    acts = [(r.tag.seconds, f"{r.actor}.{r.port}", r.value) for r in results.log.records if r.event == "replaced"]
    assert acts == [(second, "g[0].gain", [2.0, expected[second]]) for second in range(1, 5)]
    assert results.aspects == {"warm": {"replaced": 4}}
    assert loaded["g[0]"].gain == 2.0  # as the model says, when the run is over
    assert run(loaded).digest == results.digest


@pytest.mark.parametrize(
    ("at", "parameters"),
    [
        ("'g[*].gain'", ["g[0].gain", "g[1].gain"]),
        ("'*.gain'", ["g[0].gain", "g[1].gain"]),
        ("'**.factor'", ["s.factor"]),
        ("['g[*].gain', '!g[0].gain']", ["g[1].gain"]),
        ("['!g[0].gain', 'g[*].gain', s.factor]", ["g[1].gain", "s.factor"]),
        ("{type: Gauge, parameter: at}", ["g[0].at", "g[1].at"]),
        ("{tag: gauge, parameter: steps}", ["g[0].steps", "g[1].steps"]),
        ("[d.delay, s.output]", ["d.delay"]),
    ],
)
def test_pointcuts(at: str, parameters: list[str]) -> None:
    (woven,) = model(f"warm: {{type: Bias, by: 1, at: {at}}}").aspects
    assert woven.parameters == parameters
    assert woven.ports == (["s.output"] if "s.output" in at else [])


def test_numbers_of_every_kind() -> None:
    places = "'g[0].gain', 'g[0].steps', 'g[0].at', s.factor, d.delay"
    results = run(model(f"more: {{type: Bias, by: 0.6, at: [{places}]}}"))
    assert sent(results, "g[0]") == [[2.6, 5, (1.6, -0.4)]] * 5
    assert sent(results, "s") == [3.6 * n for n in range(5)]
    delayed = [record.tag.seconds for record in results.log.records if record.actor == "d" and record.event == "send"]
    assert delayed == [2.1, 3.1]


def test_aspects_at_one_parameter_follow_one_another() -> None:
    bias, scale = "b: {type: Bias, by: 1, at: 'g[0].gain'}", "c: {type: Transform, to: 2 * value, at: 'g[0].gain'}"
    assert sent(run(model(f"{bias}, {scale}")), "g[0]")[0][0] == 6.0
    assert sent(run(model(f"{scale}, {bias}")), "g[0]")[0][0] == 5.0


def test_a_schedule_and_what_ports_have_sent() -> None:
    results = run(model("c: {type: Transform, to: 5 if time < 1.5 else value + time, at: 'g[0].gain'}"))
    assert [gain for gain, *_ in sent(results, "g[0]")] == [5.0, 5.0, 4.0, 5.0, 6.0]
    results = run(model("c: {type: Transform, to: value + s.output / 3, at: 'g[0].gain'}"))
    assert [gain for gain, *_ in sent(results, "g[0]")] == [2.0, 2.0, 3.0, 4.0, 5.0]  # s fires behind it
    results = run(model("c: {type: Bias, by: 1, at: 'g[0].gain', from: 2 s, until: 3 s}"))
    assert [gain for gain, *_ in sent(results, "g[0]")] == [2.0, 2.0, 3.0, 2.0, 2.0]


def test_a_firing_that_is_put_off_finds_the_value_of_its_time() -> None:
    warm = "warm: {type: Transform, to: value + time, at: 'g[0].gain'}"
    results = run(model(f"slow: {{type: ExecutionTime, time: 0.5, at: 'g[0]'}}, {warm}"))
    assert [gain for gain, *_ in sent(results, "g[0]")] == [2.5, 3.5, 4.5, 5.5]


@pytest.mark.parametrize(
    "aspect", ["Drift", "Bias, by: 0", "Noise, deviation: 0", "Transform, to: value", "Replace, to: value"]
)
def test_at_strength_zero_the_log_is_the_same(aspect: str) -> None:
    for at in ("'g[*].gain'", "s.factor", "{type: Gauge, parameter: at}"):
        assert run(model(f"it: {{type: {aspect}, at: {at}}}"), seed=3).digest == run(model(""), seed=3).digest


def test_in_python() -> None:
    built = Model("m", stop=4)
    built.connect(built.add(Ticker("t")).output, built.add(Scale("s", factor=1)).input)
    built.weave("warm", Drift(rate=1), at="s.factor")
    results = run(built)
    assert sent(results, "s") == [0.0, 2.0, 6.0, 12.0, 20.0]
    built.unweave("warm")
    assert sent(run(built), "s") == [0.0, 1.0, 2.0, 3.0, 4.0]
    built.weave("warm", Drift(rate=1), at="s.factor")
    built.remove("s")
    assert built.aspects[0].places == []


def test_values_that_the_parameter_does_not_take() -> None:
    loaded = model("low: {type: Bias, by: -3, at: 'g[0].gain'}")
    with pytest.raises(ActorError) as caught:
        run(loaded)
    assert str(caught.value).partition("\n")[0] == (
        "aspect low failed in pass_token() at g[0].gain at (0 s, 1): gain of g[0]: -1 is out of bounds, expected a "
        "number from 0 to 10; an aspect Saturate after the others keeps it within bounds"
    )
    assert loaded["g[0]"].gain == 2.0
    kept = model("low: {type: Bias, by: -3, at: 'g[0].gain'}, keep: {type: Saturate, low: 0, at: 'g[0].gain'}")
    assert sent(run(kept), "g[0]")[0][0] == 0.0
    with pytest.raises(ActorError, match="'value > 1' gives True, which is not a number"):
        run(model("odd: {type: Transform, to: value > 1, at: 'g[0].gain'}"))


def problem(aspects: str, old: str = "", new: str = "") -> str:
    with pytest.raises(ModelError) as caught:
        load(MODEL.replace(old, new, 1).replace("{ASPECTS}", f"{{{aspects}}}"), types=[Gauge])
    found = caught.value.problems
    return "\n".join("; ".join([each.message, *each.help]) for each in found)


@pytest.mark.parametrize(
    ("aspect", "message"),
    [
        (
            "type: Bias, by: 1, at: 'g[0].name'",
            "aspect it: Bias alters numbers, but g[0].name is text",
        ),
        (
            "type: Bias, by: 1, at: 'g[0].limit'",
            "aspect it: Bias alters numbers, but g[0].limit has no value",
        ),
        (
            "type: Bias, by: 1, at: 'g[0].gian'",
            "aspect it: 'g[0].gian' matches no port; valid ports of g[0]: output; g[0] has a parameter 'gain'",
        ),
        (
            "type: PacketLoss, probability: 1, at: {type: Gauge, parameter: gain}",
            "aspect it: PacketLoss alters no parameters; leave 'parameter' out",
        ),
        (
            "type: Bias, by: 1, at: {type: Gauge, parameter: gian}",
            (
                "aspect it: no actor of type 'Gauge' has a parameter 'gian', did you mean 'gain'?; "
                "their parameters: at, gain, limit, name, steps"
            ),
        ),
    ],
)
def test_wrong_places(aspect: str, message: str) -> None:
    assert problem(f"it: {{{aspect}}}") == message


def test_a_parameter_that_is_connected() -> None:
    to_delay = ("s.output -> d.input", "s.output -> d.input, t.output -> d.delay")
    assert problem("it: {type: Bias, by: 1, at: d.delay}", *to_delay) == (
        "aspect it: d.delay gets its values over a connection; attach the aspect to 't.output', where they come from"
    )


def test_drift_has_the_variance_that_it_says() -> None:
    """The walk at 4 s over 400 instances: variance walk^2 * t, within 4 standard errors."""
    drift = "{warm: {type: Drift, walk: 0.1, at: 'g[*].gain'}}"
    text = MODEL.replace("count: 2", "count: 400").replace("{ASPECTS}", drift)
    results = run(load(text, types=[Gauge]), seed=5)
    last = np.array([sent(results, f"g[{i}]")[-1][0] for i in range(0, 400)])
    assert abs(last.mean() - 2.0) < 4 * 0.2 / 20
    assert abs(last.var() / 0.04 - 1) < 4 * np.sqrt(2 / 399)
