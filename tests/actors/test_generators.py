"""Generators of other programs, against what these gave."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from scipy import stats

from epicycle.actors import DRand, JavaRandom
from epicycle.runner.engine import ActorError, Simulation
from tests.actors.feeding import feed, load
from tests.actors.library_parts import behave, problem, tokens

SENDS = Path(__file__).parents[1] / "conformance/sends/QueueAndServer.csv"


def java_hash(text: str) -> int:
    """What Java's ``String.hashCode`` gives."""
    found = 0
    for letter in text:
        found = (31 * found + ord(letter)) % 2**32
    return found - 2**32 if found >= 2**31 else found


def sent_in_ptolemy(port: str) -> list[tuple[float, str]]:
    """What a port sent in real Ptolemy, with seed 1."""
    with SENDS.open(encoding="utf-8", newline="") as file:
        return [(float(row["time"]), row["token"]) for row in csv.DictReader(file) if row["port"] == port]


@pytest.mark.parametrize("name", ["PoissonClock", "PoissonClock2"])
def test_a_poisson_clock_of_ptolemy(name: str) -> None:
    """Its seed is added to the hash of its name; its times are multiples of 1e-10 s."""
    clock = {
        "type": "PoissonClock",
        "generator": {"type": "JavaRandom", "seed": 1 + java_hash(f".QueueAndServer.{name}")},
        "fire_at_start": name == "PoissonClock",
    }
    _, sent, _ = feed(clock, {}, until=50)
    expected = [time for time, _ in sent_in_ptolemy(f"{name}.output")]
    assert len(expected) > 30
    assert [time for time, _ in sent["output"]] == pytest.approx(expected, abs=1e-7)


def test_an_exponential_of_colt() -> None:
    expected = [float(value) for _, value in sent_in_ptolemy("ColtExponential.output")]
    seed = 1 + java_hash(".QueueAndServer.ColtExponential")
    actor = f"{{type: Random, distribution: {{type: Exponential}}, generator: {{type: DRand, seed: {seed}}}}}"
    sends = behave(actor, [("trigger", [[n, 0] for n in range(len(expected))])])
    assert len(expected) > 30
    assert tokens(sends) == pytest.approx(expected, abs=1e-12)


QUEUE_AND_SERVER = """
model: QueueAndServer
director: {{like: ptolemy}}
actors:
  Queue: {{type: Queue}}
  PoissonClock: {{type: PoissonClock, values: [1, 0], generator: {{type: JavaRandom, seed: {PoissonClock}}}}}
  Ramp: {{type: Ramp}}
  PoissonClock2:
    type: PoissonClock
    values: [1, 0]
    fire_at_start: false
    generator: {{type: JavaRandom, seed: {PoissonClock2}}}
  ColtExponential:
    type: Random
    distribution: {{type: Exponential}}
    generator: {{type: DRand, seed: {ColtExponential}}}
  Server: {{type: Server}}
connections:
  - Ramp.output -> Queue.input, ColtExponential.trigger, Server.input
  - PoissonClock2.output -> Queue.trigger
  - PoissonClock.output -> Ramp.trigger
  - ColtExponential.output -> Server.service_time
"""


def test_queue_and_server() -> None:
    """All that Ptolemy's model of this name sent, port by port, to the nanosecond."""
    names = ("PoissonClock", "PoissonClock2", "ColtExponential")
    text = QUEUE_AND_SERVER.format(**{name: 1 + java_hash(f".QueueAndServer.{name}") for name in names})
    records = Simulation(load(text), keep_log=True).run(until=50).log.records
    found: dict[str, list[Any]] = {}
    for r in records:
        if r.event == "send":
            found.setdefault(f"{r.actor}.{r.port}", []).append((r.tag.seconds, r.value))
    assert len(found) == 8
    for port, sends in found.items():
        expected = [(time, float(value)) for time, value in sent_in_ptolemy(port)]
        assert [time for time, _ in sends] == pytest.approx([time for time, _ in expected], abs=1e-9), port
        assert [value for _, value in sends] == pytest.approx([value for _, value in expected], abs=1e-12), port


def test_numbers_that_the_documentation_of_java_gives() -> None:
    """The first numbers of ``new Random(42)`` are widely known."""
    numbers = JavaRandom(seed=42).numbers()
    assert [numbers.random() for _ in range(3)] == [0.7275636800328681, 0.6832234717598454, 0.30871945533265976]
    numbers = JavaRandom(seed=42).numbers()
    assert [numbers.normal() for _ in range(3)] == pytest.approx(
        [1.1419053154730547, 0.9194079489827879, -0.9498666368908959], rel=1e-14
    )
    assert JavaRandom(seed=-1).numbers().random() == JavaRandom(seed=2**64 - 1).numbers().random()


@pytest.mark.parametrize("generator", [JavaRandom(seed=3), DRand(seed=3)], ids=repr)
def test_laws(generator: Any) -> None:
    """1e-3: one of a thousand seeds would fail."""
    numbers = generator.numbers()
    drawn = {
        "uniform": [numbers.uniform(1.0, 3.0) for _ in range(4000)],
        "normal": [numbers.normal(1.0, 2.0) for _ in range(4000)],
        "expon": [numbers.exponential(2.0) for _ in range(4000)],
        "triang": [numbers.triangular(1.0, 1.5, 3.0) for _ in range(4000)],
        "lognorm": [numbers.lognormal(0.0, 0.5) for _ in range(4000)],
    }
    laws = {
        "uniform": stats.uniform(1, 2), "normal": stats.norm(1, 2), "expon": stats.expon(scale=2),
        "triang": stats.triang(0.25, 1, 2), "lognorm": stats.lognorm(0.5),
    }  # fmt: skip
    for name, law in laws.items():
        assert stats.kstest(drawn[name], law.cdf).pvalue > 1e-3, name


LAWS: dict[str, tuple[Callable[[Any], Any], Any]] = {
    "gamma of 0.5": (lambda n: n.gamma(0.5, 2.0), stats.gamma(0.5, scale=2)),
    "gamma of 1": (lambda n: n.gamma(1.0), stats.gamma(1)),
    "gamma of 5": (lambda n: n.gamma(5.0), stats.gamma(5)),
    "gamma of 20": (lambda n: n.gamma(20.0), stats.gamma(20)),
    "chisquare of 1": (lambda n: n.chisquare(1.0), stats.chi2(1)),
    "chisquare of 4": (lambda n: n.chisquare(4.0), stats.chi2(4)),
    "t": (lambda n: n.standard_t(3.0), stats.t(3)),
    "cauchy": (lambda n: n.standard_cauchy(), stats.cauchy),
    "vonmises": (lambda n: n.vonmises(0.0, 2.0), stats.vonmises(2)),
}
WHOLE: dict[str, tuple[Callable[[Any], Any], Any]] = {
    "poisson": (lambda n: n.poisson(3.5), stats.poisson(3.5)),
    "binomial": (lambda n: n.binomial(12, 0.3), stats.binom(12, 0.3)),
    "binomial of many": (lambda n: n.binomial(12, 0.8), stats.binom(12, 0.8)),
    "negative binomial": (lambda n: n.negative_binomial(2.0, 0.6), stats.nbinom(2, 0.6)),
}


@pytest.mark.parametrize("name", LAWS)
def test_laws_of_colt(name: str) -> None:
    draw, law = LAWS[name]
    numbers = DRand(seed=11).numbers()
    assert stats.kstest([draw(numbers) for _ in range(4000)], law.cdf).pvalue > 1e-3


@pytest.mark.parametrize("name", WHOLE)
def test_laws_of_colt_of_whole_numbers(name: str) -> None:
    draw, law = WHOLE[name]
    numbers = DRand(seed=12).numbers()
    drawn = [draw(numbers) for _ in range(8000)]
    few = range(int(law.mean() + 3 * law.std()))
    expected = [8000 * law.pmf(k) for k in few] + [8000 * law.sf(few[-1])]
    counts = [drawn.count(k) for k in few] + [sum(k > few[-1] for k in drawn)]
    kept = [(n, e) for n, e in zip(counts, expected, strict=True) if e > 5]
    total = sum(e for _, e in kept) / sum(n for n, _ in kept)
    assert stats.chisquare([n for n, _ in kept], [e / total for _, e in kept]).pvalue > 1e-3


@pytest.mark.parametrize(
    ("distribution", "law"),
    [
        ("{type: ChiSquare, freedom: 3}", stats.chi2(3)),
        ("{type: StudentT, freedom: 4}", stats.t(4)),
        ("{type: Cauchy, median: 1, scale: 2}", stats.cauchy(1, 2)),
        ("{type: VonMises, mean: 1, concentration: 3}", stats.vonmises(3, loc=1)),
    ],
)
def test_distributions(distribution: str, law: Any) -> None:
    sends = behave(f"{{type: Random, distribution: {distribution}}}", [("trigger", [[0, 0]] * 2000)], seed=2)
    assert stats.kstest(tokens(sends), law.cdf).pvalue > 1e-3


@pytest.mark.parametrize(
    ("distribution", "law"),
    [
        ("{type: Poisson, mean: 20}", stats.poisson(20)),
        ("{type: Binomial, trials: 30, probability: 0.4}", stats.binom(30, 0.4)),
        ("{type: NegativeBinomial, successes: 3, probability: 0.25}", stats.nbinom(3, 0.25)),
    ],
)
def test_distributions_of_whole_numbers(distribution: str, law: Any) -> None:
    sends = behave(f"{{type: Random, distribution: {distribution}}}", [("trigger", [[0, 0]] * 2000)], seed=2)
    drawn = tokens(sends)
    assert all(type(each) is int for each in drawn)
    assert abs(sum(drawn) / 2000 - law.mean()) < 4 * law.std() / math.sqrt(2000)


def test_a_cauchy_distribution_that_is_cut_off() -> None:
    sends = behave(
        "{type: Random, distribution: {type: Cauchy, median: 1, scale: 2, cut: 3}}", [("trigger", [[0, 0]] * 2000)]
    )
    law, drawn = stats.cauchy(1, 2), tokens(sends)
    low, high = law.cdf(-2.0), law.cdf(4.0)
    assert stats.kstest(drawn, lambda x: (law.cdf(x) - low) / (high - low)).pvalue > 1e-3
    assert -2.0 <= min(drawn) < -1.9 < 3.9 < max(drawn) <= 4.0


def test_choices_and_truth_values() -> None:
    given = "generator: {type: JavaRandom, seed: 42}}"
    triggers = [("trigger", [[n, 0] for n in range(3)])]
    one = behave(f"{{type: Random, distribution: {{type: Bernoulli, probability: 0.7}}, {given}", triggers)
    assert tokens(one) == [False, True, True]
    law = "{type: Choice, values: [a, b, c], weights: [0.3, 0.4, 0.3]}"
    assert tokens(behave(f"{{type: Random, distribution: {law}, {given}", triggers)) == ["c", "b", "b"]


def test_the_seed_of_the_run_does_not_matter_then() -> None:
    actor = "{type: PoissonClock, generator: {type: DRand, seed: 5}}"
    assert behave(actor, [], until=20, seed=1) == behave(actor, [], until=20, seed=2)
    assert not math.isnan(behave(actor, [], until=20)[-1][0])


def test_messages() -> None:
    drawn = "{type: Random, distribution: {type: Gamma}, generator: {type: JavaRandom, seed: 5}}"
    with pytest.raises(ActorError) as caught:
        behave(drawn, [("trigger", [[0, 0]])])
    assert caught.value.reason == "a generator of another program has no 'gamma'; leave out 'generator'"
    wrong = "{type: PoissonClock, generator: {type: Java, seed: 5}}"
    assert problem(wrong) == "it.generator: 'Java' is not one of DRand, JavaRandom"
    many = "{type: Random, distribution: {type: Poisson, mean: 10}, generator: {type: DRand, seed: 5}}"
    with pytest.raises(ActorError) as caught:
        behave(many, [("trigger", [[0, 0]])])
    assert caught.value.reason == (
        "DRand draws Poisson numbers only with a mean below 10, not 10; leave out 'generator'"
    )
    narrow = "{type: Random, distribution: {type: VonMises, concentration: 1e7}, generator: {type: DRand, seed: 5}}"
    with pytest.raises(ActorError) as caught:
        behave(narrow, [("trigger", [[0, 0]])])
    assert caught.value.reason == (
        "DRand draws angles only with a concentration from 1e-6 to 1e6, not 1e+07; leave out 'generator'"
    )
