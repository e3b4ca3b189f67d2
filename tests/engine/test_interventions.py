"""Acts of aspects: their names, and runs in which some of them do not happen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import Tag
from epicycle.aspects import JoinPoint, PortAspect
from epicycle.runner.execution.engine import ActorError, Interventions, Simulation
from epicycle.runner.execution.results import Results
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.graph.acts import ActName
from epicycle.runner.model.text.problems import ModelError
from tests.engine.engine_parts import load, seen

TEXT = """
actors:
  a: {type: Ticker, limit: 6}
  probe: {type: Probe}
connections: [a.output -> probe.input]
aspects:
  lossy: {type: PacketLoss, probability: 0.5, at: probe.input}
  slow: {type: Latency, delay: 200 ms, at: probe.input}
"""


def run(text: str, exactly: frozenset[ActName] | None = None, seed: int = 1) -> tuple[list[object], Results]:
    simulation = Simulation(load(text), seed=seed, acts=Interventions(exactly))
    results = simulation.run()
    return [(time, *tokens) for time, _, tokens in seen(simulation)], results


def test_acts_have_the_names_of_their_tokens() -> None:
    tokens, results = run(TEXT)
    losses = [act for act in results.acts if act.name.aspect == "lossy"]
    delays = [act for act in results.acts if act.name.aspect == "slow"]
    assert len(losses) + len(delays) == 6
    assert len(delays) == len(tokens)
    for act in losses:
        assert act.name.place == "probe.input"
        assert act.source == "a.output"
        assert act.events == ("dropped",)
        assert act.time == (act.name.token - 1) * 1_000_000_000
    # What is lost is no token for the aspect behind.
    assert [act.name.token for act in delays] == list(range(1, len(delays) + 1))
    assert str(losses[0].name) == f"lossy at probe.input, token {losses[0].name.token}"


def test_an_act_that_does_not_happen_leaves_all_others_as_they_are() -> None:
    tokens, results = run(TEXT)
    names = [act.name for act in results.acts]
    for name in (each for each in names if each.aspect == "lossy"):
        _, others = run(TEXT, frozenset(names) - {name})
        assert {act.name for act in others.acts if act.name.aspect == "lossy"} == {
            each for each in names if each.aspect == "lossy" and each != name
        }
    late = next(name for name in names if name.aspect == "slow")
    again, _ = run(TEXT, frozenset(names) - {late})
    assert len(again) == len(tokens)
    assert again[1:] == tokens[1:]
    assert again[0][0] == pytest.approx(tokens[0][0] - 0.2)  # type: ignore[index]


def test_counts_are_of_what_happens() -> None:
    _, results = run(TEXT, frozenset())
    assert results.acts == []
    assert results.aspects == {"lossy": {"dropped": 0}, "slow": {"delayed": 0}}


@pytest.mark.slow
@pytest.mark.parametrize("disturbance", sorted(path.stem for path in Path("models/disturbances").glob("*.yaml")))
def test_noting_acts_changes_nothing_and_leaving_out_none_neither(disturbance: str) -> None:
    for model in ("collision_avoidance", "mm1"):
        try:
            made = load_model(model, disturb=disturbance)
        except ModelError:  # it is for other models
            continue
        plain = Simulation(made, seed=3).run(until=2.0)
        noted = Simulation(made, seed=3, acts=Interventions()).run(until=2.0)
        assert noted.digest == plain.digest
        exactly = frozenset(act.name for act in noted.acts)
        assert Simulation(made, seed=3, acts=Interventions(exactly)).run(until=2.0).digest == plain.digest


@pytest.mark.parametrize(
    "aspect",
    [
        "{type: Bus, factor: 0.5, message_length: 1, at: probe.input}",
        "{type: Duplicate, probability: 1, at: probe.input}",
        "{type: Noise, deviation: 1, at: a.output}",
        "{type: ExecutionTime, time: 300 ms, at: probe}",
        "{type: Processor, time: 300 ms, at: probe}",
        "{type: SkipFiring, probability: 0.9, at: probe}",
        "{type: Reorder, probability: 0.9, at: probe.input}",
    ],
)
def test_without_its_acts_an_aspect_does_nothing(aspect: str) -> None:
    head = TEXT[: TEXT.index("aspects:")]
    plain, _ = run(head)
    with_aspect, results = run(f"{head}aspects:\n  it: {aspect}\n")
    assert results.acts
    assert with_aspect != plain
    without, results = run(f"{head}aspects:\n  it: {aspect}\n", frozenset())
    assert without == plain
    assert results.acts == []


class Trap(PortAspect):
    """Fails at every token."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        raise RuntimeError("trapped")


def test_what_fails_behind_an_aspect_that_is_over_is_not_its_fault() -> None:
    model = load(f"{TEXT}  trap: {{type: Trap, at: probe.input}}\n", types=[Trap])
    ends = dict.fromkeys(("lossy", "slow"), Tag(0, 0))
    with pytest.raises(ActorError) as raised:
        Simulation(model, acts=Interventions(ends=ends)).run()
    assert str(raised.value).splitlines()[0] == (
        "aspect trap failed in pass_token() at probe.input at (0 s, 1): RuntimeError: trapped"
    )


def test_snapshots_know_the_names() -> None:
    simulation = Simulation(load(TEXT), seed=1, acts=Interventions())
    simulation.advance(2.5)
    snapshot = simulation.snapshot()
    acts = simulation.run().acts
    again = Simulation(simulation.model, seed=1)
    again.restore(snapshot)
    assert again.run().acts == acts


def test_a_disturbance_names_the_only_acts_that_happen(tmp_path: Path) -> None:
    _, results = run(TEXT)
    first = next(act.name for act in results.acts if act.name.aspect == "lossy")
    file = tmp_path / "exactly.yaml"
    file.write_text(
        f"disturbance: one\nexactly:\n  - {{aspect: lossy, at: probe.input, token: {first.token}}}\n", encoding="utf-8"
    )
    model = load(TEXT, disturb=file)
    assert model.exactly == {first}
    assert [act.name for act in Simulation(model, seed=1).run().acts] == [first]
    made = load(TEXT)
    made.disturb(file)
    assert made.exactly == {first}


def test_acts_of_aspects_and_places_that_are_not_there(tmp_path: Path) -> None:
    file = tmp_path / "exactly.yaml"
    file.write_text(
        "disturbance: wrong\nexactly:\n  - {aspect: losy, at: probe.input, token: 1}\n"
        "  - {aspect: lossy, at: probe.inputt, token: 2}\n",
        encoding="utf-8",
    )
    with pytest.raises(ModelError) as raised:
        load(TEXT, disturb=file)
    text = str(raised.value).replace(str(tmp_path), ".")
    assert text.removesuffix("\n2 errors in ./exactly.yaml") == (
        "./exactly.yaml:3:14: error: exactly: there is no aspect 'losy', did you mean 'lossy'?\n"
        "    3 |   - {aspect: losy, at: probe.input, token: 1}\n"
        "      |              ^^^^\n"
        "   help: the aspects: lossy, slow\n\n"
        "./exactly.yaml:4:25: error: exactly: aspect lossy does not attach to 'probe.inputt', did you mean "
        "'probe.input'?\n"
        "    4 |   - {aspect: lossy, at: probe.inputt, token: 2}\n"
        "      |                         ^^^^^^^^^^^^\n"
        "   help: it attaches to probe.input"
    )
