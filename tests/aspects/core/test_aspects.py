"""What the aspects do, where they stand, and whose random numbers they draw."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any, ClassVar

import pytest
from scipy.stats import binom

from epicycle.actors import random_stream
from epicycle.aspects import CommunicationAspect, JoinPoint, PortAspect
from epicycle.runner.execution.engine import ActorError, Results, Simulation
from epicycle.runner.model.build.load import load_model
from tests.engine.engine_parts import load, seen, sends, simulate

PAIR = """
actors: {{t: {{type: Ticker, period: 1 ms}}, a: {{type: Scale}}, b: {{type: Scale}}}}
connections: [t.output -> a.input, t.output -> b.input]
aspects:
{}
run: {{stop: 4 s}}
"""
TICKS = 4001


def lost(results: Results, port: str) -> set[int]:
    """The ticks whose token an aspect took away at a port."""
    return {
        record.value
        for record in results.log.records
        if record.event in ("dropped", "failed") and f"{record.actor}.{record.port}" == port
    }


@cache
def pair(*aspects: str, seed: int = 1) -> Results:
    """A run of the pair with aspects, each a line of YAML."""
    return simulate(PAIR.format("".join(f"  {line}\n" for line in aspects)), seed=seed)[1]


def in_interval(count: int, probability: float, trials: int = TICKS) -> bool:
    """Whether a count lies in the central 99.9 % of the binomial law."""
    low, high = binom.interval(0.999, trials, probability)
    return bool(low <= count <= high)


def packets(probability: float, at: str = '["*.input"]', more: str = "", name: str = "loss") -> str:
    return f"{name}: {{type: PacketLoss, probability: {probability}, at: {at}{more}}}"


@pytest.mark.parametrize("probability", [0.01, 0.25, 0.5, 0.9])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rates_and_independence(probability: float, seed: int) -> None:
    results = pair(packets(probability), seed=seed)
    at_a, at_b = lost(results, "a.input"), lost(results, "b.input")
    assert in_interval(len(at_a), probability)
    assert in_interval(len(at_b), probability)
    assert in_interval(len(at_a & at_b), probability**2)
    after = {tick + 1 for tick in at_a}  # nor does a loss depend on the one before
    assert in_interval(len(at_a & after), probability**2, TICKS - 1)
    assert results.aspects == {"loss": {"dropped": len(at_a) + len(at_b)}}
    assert {row[3] for row in sends(results, "a")} == {float(tick) for tick in range(TICKS) if tick not in at_a}


@pytest.mark.parametrize("probability", [0.01, 0.5])
def test_measurement_failure(probability: float) -> None:
    results = pair(f"failure: {{type: MeasurementFailure, probability: {probability}, at: t.output}}")
    failed = lost(results, "t.output")
    assert in_interval(len(failed), probability)
    assert results.aspects == {"failure": {"failed": len(failed)}}
    # What has failed was never sent, and nobody received it.
    assert {row[3] for row in sends(results, "t")} == set(range(TICKS)) - failed
    assert (
        {row[3] for row in sends(results, "a")} == {row[3] for row in sends(results, "b")} == set(range(TICKS)) - failed
    )


def test_certain_loss_and_spare_first() -> None:
    assert lost(pair(packets(1)), "a.input") == set(range(TICKS))
    spared = pair(packets(1, more=", spare_first: true"))
    assert lost(spared, "a.input") == set(range(1, TICKS))
    half = pair(packets(0.5, more=", spare_first: true"))
    assert lost(half, "a.input") == lost(pair(packets(0.5)), "a.input") - {0}
    failed = pair("failure: {type: MeasurementFailure, probability: 1, at: t.output, spare_first: true}")
    assert [row[3] for row in sends(failed, "t")] == [0]


def test_probability_zero_leaves_no_trace() -> None:
    bare = pair()
    for spare in ("true", "false"):
        assert pair(packets(0, more=f", spare_first: {spare}")).digest == bare.digest
    assert pair("failure: {type: MeasurementFailure, probability: 0, at: t.output}").digest == bare.digest
    assert pair(packets(0.5, more=", enabled: false")).digest == bare.digest
    assert pair(packets(0.5, more=", enabled: '${1 > 2}'")).aspects == {}


def test_probability_zero_in_the_example() -> None:
    both = load_model("collision_avoidance", set=["observers=2"])
    none = load_model(
        "collision_avoidance", set=["observers=2"], without_aspects=["packet_loss", "measurement_failure"]
    )
    with_them, without = (Simulation(model, seed=5).run(until=1) for model in (both, none))
    assert with_them.digest == without.digest
    assert with_them.metrics == without.metrics
    assert with_them.aspects == {
        **without.aspects,
        "packet_loss": {"dropped": 0},
        "measurement_failure": {"failed": 0},
    }


def test_an_aspect_does_not_move_the_stream_of_another() -> None:
    failure = "failure: {type: MeasurementFailure, probability: 0.3, at: a.output}"
    alone = lost(pair(packets(0.3)), "b.input")
    assert lost(pair(packets(0.3), packets(0.3, '"a.input"', name="more")), "b.input") == alone
    assert lost(pair(packets(0.3, '"a.input"', name="more"), packets(0.3)), "b.input") == alone
    assert lost(pair(packets(0.3), failure), "b.input") == alone
    assert lost(pair(packets(0.3, '"b.input"')), "b.input") == alone
    assert lost(pair(packets(0.3, name="other")), "b.input") != alone


def test_losses_take_one_number_of_the_stream_for_each_token() -> None:
    random = random_stream(1, "b.input", "aspect loss")
    expected = {tick for tick in range(TICKS) if random.random() < 0.3}
    assert lost(pair(packets(0.3)), "b.input") == expected


@pytest.mark.parametrize("seed", [1, 2])
def test_losses_are_nested_in_the_probability(seed: int) -> None:
    runs = [lost(pair(packets(p), seed=seed), "a.input") for p in (0, 0.01, 0.25, 0.5, 0.75, 1)]
    for fewer, more in pairwise(runs):
        assert fewer < more


class Mark(CommunicationAspect):
    """Writes its name behind the token."""

    events: ClassVar[tuple[str, ...]] = ("marked",)

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.act("marked", token)
        point.forward(f"{token}{point.aspect}")


class Echo(PortAspect):
    """Forwards at once, in the next microstep, and a second later."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.forward(token)
        point.forward(token, 0)
        point.forward(token, 1)


class Broken(PortAspect):
    """Fails."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        raise LookupError("no idea")


FAN = """
composites:
  Fan:
    inputs: [in]
    outputs: [out]
    actors: {{one: {{type: Probe}}, two: {{type: Probe}}, s: {{type: Scale}}}}
    connections: [in -> one.input, in -> two.input, in -> s.input, s.output -> out]
    aspects: {{{inside}}}
actors: {{t: {{type: Ticker, period: 10 ms}}, fan: {{type: Fan, count: 2}}, probe: {{type: Probe}}}}
connections: ["t.output -> fan[*].in", "fan[*].out -> probe.input"]
aspects: {{{outside}}}
run: {{stop: 4 s, record: ["fan[0].out", "fan[0].s.output"]}}
"""


def fan(inside: str = "", outside: str = "", **options: Any) -> Any:
    return simulate(FAN.format(inside=inside, outside=outside), types=[Mark, Echo, Broken], seed=4, **options)


def test_the_order_of_declaration_is_the_order_of_application() -> None:
    for first, second in ("xy", "yx"):
        lines = f"{first}: {{type: Mark, at: '*.input'}}, {second}: {{type: Mark, at: 'probe.input'}}"
        text = (
            "actors: {t: {type: Ticker, limit: 1}, probe: {type: Probe}}\n"
            f"connections: [t.output -> probe.input]\naspects: {{{lines}}}"
        )
        simulation, results = simulate(text, types=[Mark])
        assert seen(simulation) == [(0.0, 1, (f"0{first}{second}",))]
        assert [(r.aspect, r.value) for r in results.log.records if r.event == "marked"] == [
            (first, 0), (second, f"0{first}")
        ]  # fmt: skip


def test_a_port_that_fans_out_decides_once() -> None:
    simulation, results = fan(outside="loss: {type: PacketLoss, probability: 0.5, at: 'fan[0].in'}")
    one, two = seen(simulation, "fan[0].one"), seen(simulation, "fan[0].two")
    assert one == two
    assert in_interval(len(one), 0.5, 401)
    assert len(seen(simulation, "fan[1].one")) == 401
    assert results.aspects["loss"]["dropped"] == 401 - len(one)
    # Where it stands at the ports behind it, each decides for itself.
    simulation, _ = fan(outside="loss: {type: PacketLoss, probability: 0.5, at: 'fan[0].*.input'}")
    assert seen(simulation, "fan[0].one") != seen(simulation, "fan[0].two")


def test_several_connections_of_a_port_share_its_stream() -> None:
    text = """
actors: {t: {type: Ticker, period: 10 ms}, u: {type: Ticker, period: 10 ms}, join: {type: Join}}
connections: ["t.output, u.output -> join.input"]
aspects: {loss: {type: PacketLoss, probability: 0.5, at: join.input}}
run: {stop: 4 s}
"""
    _, results = simulate(text)
    tokens = [tuple(map(tuple, row[3])) for row in sends(results, "join")]
    assert in_interval(sum(len(one) for one, _ in tokens), 0.5, 401)
    assert in_interval(sum(len(other) for _, other in tokens), 0.5, 401)
    assert in_interval(sum(bool(one) and bool(other) for one, other in tokens), 0.25, 401)
    assert results.aspects["loss"]["dropped"] == 802 - sum(len(one) + len(other) for one, other in tokens)


def test_an_aspect_at_the_output_of_a_composite() -> None:
    simulation, results = fan(outside="failure: {type: MeasurementFailure, probability: 0.5, at: 'fan[0].out'}")
    out, inner = results.signals["fan[0].out"], results.signals["fan[0].s.output"]
    assert len(inner.tokens) == 401
    assert in_interval(len(out.tokens), 0.5, 401)
    assert sum(len(tokens) for _, _, tokens in seen(simulation)) == 401 + len(out.tokens)


def test_aspects_that_belong_to_a_composite() -> None:
    simulation, results = fan(inside="loss: {type: PacketLoss, probability: 0.5, at: one.input}")
    assert [woven.name for woven in simulation.model.aspects] == ["fan[0].loss", "fan[1].loss"]
    assert [woven.ports for woven in simulation.model.aspects] == [["fan[0].one.input"], ["fan[1].one.input"]]
    assert seen(simulation, "fan[0].one") != seen(simulation, "fan[1].one")
    assert len(seen(simulation, "fan[0].two")) == 401
    for name in ("fan[0]", "fan[1]"):
        assert results.aspects[f"{name}.loss"]["dropped"] == 401 - len(seen(simulation, f"{name}.one"))
    simulation, _ = fan(
        inside="loss: {type: PacketLoss, probability: 0.5, at: one.input}", set=["fan[1].loss.probability=0"]
    )
    assert len(seen(simulation, "fan[1].one")) == 401


def test_forwarding_later() -> None:
    text = "actors: {t: {type: Ticker, limit: 1}, probe: {type: Probe}}\nconnections: [t.output -> probe.input]\n"
    simulation, _ = simulate(text + "aspects: {echo: {type: Echo, at: probe.input}}", types=[Echo])
    assert seen(simulation) == [(0.0, 1, (0,)), (0.0, 2, (0,)), (1.0, 1, (0,))]
    simulation, results = simulate(text + "aspects: {echo: {type: Echo, at: t.output}}", types=[Echo])
    assert seen(simulation) == [(0.0, 1, (0,)), (0.0, 2, (0,)), (1.0, 1, (0,))]
    assert [row[:2] for row in sends(results)] == [(0.0, 1), (0.0, 2), (1.0, 1)]


def test_an_exception_in_an_aspect_names_the_aspect() -> None:
    with pytest.raises(ActorError) as caught:
        fan(outside="bad: {type: Broken, at: 'fan[1].in'}")
    told, _, where = str(caught.value).partition("\n")
    assert told == "aspect bad failed in pass_token() at fan[1].in at (0 s, 1): LookupError: no idea"
    assert where.startswith("   raised at tests/aspects/core/test_aspects.py:")
    assert 'raise LookupError("no idea")' in where.splitlines()[1]
    assert where.endswith("m.yaml:12:11")


LOSS = "loss: {type: PacketLoss, probability: 0.25, spare_first: true, at: 'fan[*].one.input'}"


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("loss=PacketLoss,probability=0.5", ("PacketLoss", 0.5, True, ["fan[0].one.input", "fan[1].one.input"])),
        ("loss=PacketLoss,spare_first=false", ("PacketLoss", 0.25, False, ["fan[0].one.input", "fan[1].one.input"])),
        ("loss=PacketLoss,at=[probe.input,fan[1].in]", ("PacketLoss", 0.25, True, ["fan[1].in", "probe.input"])),
        ("loss=PacketLoss,at=probe.input", ("PacketLoss", 0.25, True, ["probe.input"])),
        ("loss=Mark", ("Mark", None, None, ["fan[0].one.input", "fan[1].one.input"])),
        ("loss=PacketLoss,enabled=false", None),
    ],
)
def test_replacing_an_aspect(change: str, expected: Any) -> None:
    model = load(FAN.format(inside="", outside=LOSS), types=[Mark], aspects=[change])
    found = [
        (
            type(w.aspect).__name__,
            getattr(w.aspect, "probability", None),
            getattr(w.aspect, "spare_first", None),
            w.ports,
        )
        for w in model.aspects
    ]
    assert found == ([] if expected is None else [expected])


def test_adding_and_removing_aspects() -> None:
    text = FAN.format(inside="", outside=LOSS)
    model = load(text, aspects=["more=PacketLoss,probability=10 %,at=fan[*].in"])
    assert [(w.name, w.ports) for w in model.aspects][1] == ("more", ["fan[0].in", "fan[1].in"])
    assert model.aspects[1].aspect.probability == 0.1  # type: ignore[attr-defined]
    assert load(text, without_aspects=["loss"]).aspects == []
    model = load(text, set=["loss.probability=0.75"])
    assert model.aspects[0].aspect.probability == 0.75  # type: ignore[attr-defined]
