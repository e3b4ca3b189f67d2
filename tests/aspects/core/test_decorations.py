"""Aspects that come with actors: classes and instances that are decorated with the objects that models declare."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import Actor, EpicycleError, InputPort, OutputPort, random_stream
from epicycle.aspects import Bias, Drift, ExecutionTime, Latency, MeasurementFailure, Noise, PacketLoss
from epicycle.runner import Model, ModelError, Simulation
from epicycle.runner.execution.engine import Results
from epicycle.runner.interface.cli import main
from tests.engine.engine_parts import Scale, Ticker, load


@Noise(deviation=0.5).at("output")
class Sensor(Scale):
    """A scale whose output is noisy."""


@Bias(by=100.0).at("output")
class Skewed(Sensor):
    """Noisy first, then off by a hundred."""


@Latency(delay=0.25).at("input", name="cable")
@PacketLoss(probability=0.0).at("input")
class Remote(Scale):
    """What comes is late, and might be lost."""


@ExecutionTime(time=0.1).at()
class Slow(Scale):
    """It takes its time."""


TYPES = [Sensor, Skewed, Remote, Slow]
YAML = """
actors: {{t: {{type: Ticker}}, s: {{type: {}, count: 2}}}}
connections: ["t.output -> s[*].input"]
run: {{stop: 4 s}}
"""


def run(model: Model) -> Results:
    return Simulation(model, keep_log=True).run()


def sent(results: Results, path: str) -> list[tuple[float, Any]]:
    return [(r.tag.seconds, r.value) for r in results.log.records if r.event == "send" and r.actor == path]


def plain(cls: type[Actor], *names: str) -> Model:
    model = Model("m", stop=4)
    ticker = model.add(Ticker("t"))
    for name in names:
        model.connect(ticker.output, model.add(cls(name)).input)
    return model


def test_every_instance_of_a_class_has_it_everywhere() -> None:
    loaded = load(YAML.format("Sensor"), types=TYPES)
    assert [(woven.name, woven.ports) for woven in loaded.aspects] == [
        (f"s[{i}].noise", [f"s[{i}].output"]) for i in range(2)
    ]
    built = run(plain(Sensor, "s[0]", "s[1]"))
    assert built.digest == run(loaded).digest
    errors = [[value - time for time, value in sent(built, f"s[{i}]")] for i in range(2)]
    assert len({*errors[0], *errors[1]}) == 10  # each draws from a stream of its own
    assert built.aspects == {f"s[{i}].noise": {"replaced": 5} for i in range(2)}


def test_streams_go_by_the_path_of_the_actor() -> None:
    """Also within composites; so what an instance draws is the same whatever else is in the model."""
    model = Model("m", stop=4)
    around = model.composite("c", inputs=["go"])
    around.add(Sensor("s"))
    around.connect("go -> s.input")
    model.connect(model.add(Ticker("t")).output, "c.go")
    for results, path in ((run(model), "c.s"), (run(plain(Sensor, "s[0]", "s[1]")), "s[1]")):
        random = random_stream(0, f"{path}.output", f"aspect {path}.noise")
        assert [value for _, value in sent(results, path)] == [
            time + 0.5 * random.normal(size=1)[0] for time in range(5)
        ]


def test_instances() -> None:
    model = Model("m", stop=4)
    ticker = model.add(Ticker("t"))
    biased = Bias(by=7.0).at("output")(Scale("a"))
    model.connect(ticker.output, model.add(biased).input)
    model.connect(ticker.output, model.add(Scale("b")).input)
    results = run(model)
    assert [value for _, value in sent(results, "a")] == [7.0, 8.0, 9.0, 10.0, 11.0]
    assert [value for _, value in sent(results, "b")] == [0.0, 1.0, 2.0, 3.0, 4.0]
    model.unweave("a.bias")
    assert [value for _, value in sent(run(model), "a")] == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_they_are_nearer_to_the_actor_than_the_aspects_of_the_model() -> None:
    """At an output the actor's own come first, at an input last; of several of its own the inner one is nearest."""
    model = plain(Skewed, "s")
    model.weave("failure", MeasurementFailure(probability=1.0), at="s.output")
    assert [woven.name for woven in model.aspects] == ["s.noise", "s.bias", "failure"]
    results = run(model)
    assert results.aspects == {"s.noise": {"replaced": 5}, "s.bias": {"replaced": 5}, "failure": {"failed": 5}}
    model = plain(Remote, "s")
    model.weave("loss", PacketLoss(probability=1.0), at="s.input")
    assert [woven.name for woven in model.aspects] == ["loss", "s.cable", "s.packet_loss"]
    assert run(model).aspects == {"loss": {"dropped": 5}, "s.cable": {"delayed": 0}, "s.packet_loss": {"dropped": 0}}


def test_at_firings() -> None:
    assert [time for time, _ in sent(run(plain(Slow, "s")), "s")] == [0.1, 1.1, 2.1, 3.1]


class Fresh(Scale):
    """For what is tried on a class."""


@Drift(rate=2.0).at("factor")
class Ageing(Scale):
    """Its factor grows."""


def test_at_parameters() -> None:
    results = run(plain(Ageing, "s"))
    assert [value for _, value in sent(results, "s")] == [0.0, 3.0, 10.0, 21.0, 36.0]
    assert results.aspects == {"s.drift": {"replaced": 4}}
    with pytest.raises(EpicycleError, match="PacketLoss: Fresh has no port 'factor'; its ports: input, output"):
        PacketLoss(probability=0.0).at("factor")(Fresh)


def test_parameters_from_outside() -> None:
    model = load(
        YAML.format("Skewed"), types=TYPES, set=["s[*].bias.by=5", "s[0].noise.deviation=0", "s[1].bias.from=2 s"]
    )
    assert [value for _, value in sent(run(model), "s[0]")] == [5.0, 6.0, 7.0, 8.0, 9.0]
    assert [value > 4 for _, value in sent(run(model), "s[1]")] == [False, False, True, True, True]
    with pytest.raises(ModelError) as caught:
        load(YAML.format("Sensor"), types=TYPES, set=["s[0].noise.deviation=-1", "s[0].noise.deviatoin=1"])
    assert [problem.message for problem in caught.value.problems] == [
        "'s[0].noise.deviatoin' matches no parameter, did you mean 's[0].noise.deviation'?",
        "s[0].noise.deviation: -1 is out of bounds, expected a number >= 0",
    ]


def test_the_command_line_shows_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = YAML.format("Warm").replace("{type: Ticker}", "{type: Clock, period: 1 s}")
    (tmp_path / "m.yaml").write_text(f"model: m{text}")
    (tmp_path / "own.py").write_text(
        "from epicycle.actors import Scale\nfrom epicycle.aspects import Bias\n\n\n"
        '@Bias(by=2.0).at("output")\nclass Warm(Scale):\n    """Off by two."""\n'
    )
    assert main(["describe", str(tmp_path / "m.yaml"), "--aspects", "--types", str(tmp_path / "own.py")]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert lines[1:] == [[f"s[{i}].output", f"s[{i}].bias", "Bias", "by:", "2"] for i in range(2)]


@pytest.mark.parametrize(
    ("decorate", "message"),
    [
        (lambda: Noise(deviation=1).at("output")(object()), "is neither an actor nor a class of actors"),
        (lambda: Noise(deviation=1).at(), "Noise attaches to ports: give their names in at()"),
        (
            lambda: ExecutionTime(time=1).at("input"),
            "ExecutionTime attaches to actors, not to ports: write at() without ports",
        ),
        (
            lambda: Noise(deviation=1).at("output", name="2nd"),
            "'2nd' is not a name: use letters, digits and _, and no digit first",
        ),
        (
            lambda: Noise(deviation=1).at("outptu")(Fresh),
            "Noise: Fresh has no port 'outptu', did you mean 'output'?; its ports: input, output",
        ),
        (
            lambda: Noise(deviation=1).at("input")(Fresh),
            "Noise attaches to output ports, but input is an input port of Fresh",
        ),
        (
            lambda: Noise(deviation=1).at("output")(Sensor),
            "Sensor already has an aspect 'noise': give this one another name with name=...",
        ),
        (
            lambda: Noise(deviation=1).at("output")(Sensor("s")),
            "s already has an aspect 'noise': give this one another name with name=...",
        ),
        (
            lambda: Noise(deviation=1).at("output")(plain(Scale, "s")["s"]),
            "s is part of a model: weave the aspect there, with model.weave('noise', ..., at=...)",
        ),
    ],
)
def test_what_cannot_be(decorate: Any, message: str) -> None:
    with pytest.raises(EpicycleError) as caught:
        decorate()
    assert str(caught.value).endswith(message)
    assert "_decorations" not in vars(Fresh)


class Odd(Actor):
    """Its ports follow from nothing that the class says."""

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        return {"left": OutputPort(float)}


def test_ports_that_an_instance_lacks() -> None:
    decorated = Bias(by=1).at("right")(type("Lopsided", (Odd,), {}))
    model = Model("m")
    with pytest.raises(ModelError, match=r"aspect odd\.bias: odd has no port 'right'"):
        model.add(decorated("odd"))
    assert not model.graph.actors
    with pytest.raises(EpicycleError, match=r"Bias: odd has no port 'right'; its ports: left"):
        Bias(by=1).at("right")(Odd("odd"))
