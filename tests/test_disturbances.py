"""What the packaged disturbances do to the scenario, with and without observers."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from epicycle.runner import ModelError, Simulation, load_model
from epicycle.runner.model import packaged_disturbances

NAMES = sorted(packaged_disturbances())


@pytest.mark.parametrize("observers", [0, 4])
@pytest.mark.parametrize("name", NAMES)
def test_disturbance_acts_on_the_scenario(name: str, observers: int) -> None:
    text = packaged_disturbances()[name].read_text(encoding="utf-8")
    assert f"disturbance: {name}\n" in text
    model = load_model("collision_avoidance", set={"observers": observers}, disturb=name)
    plain = load_model("collision_avoidance", set={"observers": observers})
    own = {woven.name for woven in model.aspects} - {woven.name for woven in plain.aspects}
    results = Simulation(model, seed=3).run(until=1.5)
    assert own <= results.aspects.keys()
    if observers:
        assert results.digest != Simulation(plain, seed=3).run(until=1.5).digest
    for path, signal in results.signals.items():
        if path.endswith(".state"):
            assert all(math.isfinite(x) for token in signal.tokens for x in (*token.position, *token.velocity))


@pytest.mark.parametrize("latency", ["1 us", "30 ms"])
def test_plans_and_controls_count_from_the_next_tick_on(latency: str) -> None:
    """What ``latency`` says of itself, without which a disturbance that brings one could not put it at zero."""
    digests = {
        Simulation(load_model("collision_avoidance", set={"latency": each}), seed=5).run(until=1.0).digest
        for each in (latency, "100 ms")
    }
    assert len(digests) == 1


DISTURBANCE = """
disturbance: leaky
parameters: {leak: {value: 0.25, unit: "1", min: 0, max: 1}, fast: "${mean_service < 1}"}
aspects: {leaky: {type: PacketLoss, probability: "${leak if not fast else 0}", at: server.input}}
"""


def test_a_disturbance_in_python_is_the_one_of_the_command_line(tmp_path: Path) -> None:
    file = tmp_path / "leaky.yaml"
    file.write_text(DISTURBANCE)
    at_once = load_model("mm1", disturb=[file], set={"leak": 0.5})
    later = load_model("mm1")
    (woven,) = later.disturb(file, set={"leak": "0.5"})
    assert (woven.name, woven.ports) == ("leaky", ["server.input"])
    counts = [Simulation(model, seed=2).run(until=200).digest for model in (at_once, later, load_model("mm1"))]
    assert counts[0] == counts[1] != counts[2]
    # It can be swept.
    swept = [load_model("mm1", disturb=str(file), set={"leak": leak}).aspects[0].aspect for leak in (0.1, 0.2)]
    assert [repr(aspect) for aspect in swept] == ["PacketLoss(probability=0.1)", "PacketLoss(probability=0.2)"]


def test_what_is_wrong_with_a_disturbance_of_a_model_that_is_made(tmp_path: Path) -> None:
    file = tmp_path / "leaky.yaml"
    file.write_text(DISTURBANCE)
    model = load_model("mm1")
    before = list(model.aspects)
    here = Path(__file__).name

    def told(**values: object) -> list[str]:
        with pytest.raises(ModelError) as caught:
            model.disturb(file, set=values)
        assert model.aspects == before
        text = str(caught.value).replace(f"{tmp_path}/", "")
        lines = [line.rpartition(here)[2] for line in text.splitlines()]
        return [line.partition("error: ")[2] or line for line in lines if "error:" in line or "help:" in line]

    assert told(leek=0.5) == ["'leek' sets no parameter, did you mean 'leak'?"]
    assert told(leak=2) == ["leak: 2 is out of bounds, expected a number from 0 to 1"]
    assert told(load=0.5) == ["'load' is a parameter of the model, not of the disturbance leaky"]
    file.write_text(DISTURBANCE.replace("server.input", "server.inptu") + "set: {mean_service: 2}")
    assert told() == [
        "'mean_service' cannot be set any more: the model is made",
        "   help: load the model together with the disturbance: load_model(..., disturb='leaky.yaml')",
    ]
    file.write_text(DISTURBANCE.replace("server.input", "server.inptu"))
    assert told()[0] == "aspect leaky: 'server.inptu' matches no port, did you mean 'server.input'?"
    file.write_text(DISTURBANCE)
    model.disturb(file)
    before = list(model.aspects)
    assert told() == ["there is an aspect 'leaky' already", "   help: unweave it before"]
