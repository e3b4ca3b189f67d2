"""Java's generators, against what these gave."""

from __future__ import annotations

import csv
import math
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from scipy import stats

from epicycle.ptolemy.generators import LAWS, DRand, JavaRandom
from epicycle.runner.execution.engine import ActorError, Simulation
from tests.actors import library_parts
from tests.actors.feeding import load
from tests.actors.library_parts import tokens

behave, problem = (partial(each, like="ptolemy") for each in (library_parts.behave, library_parts.problem))
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
    seed, at_start = 1 + java_hash(f".QueueAndServer.{name}"), str(name == "PoissonClock").lower()
    clock = f"{{type: PoissonClock, generator: {{type: JavaRandom, seed: {seed}}}, fire_at_start: {at_start}}}"
    sent = behave(clock, [], until=50)
    expected = [time for time, _ in sent_in_ptolemy(f"{name}.output")]
    assert len(expected) > 30
    assert [time for time, *_ in sent] == pytest.approx(expected, abs=1e-7)


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
    }
    laws = {
        "uniform": stats.uniform(1, 2), "normal": stats.norm(1, 2), "expon": stats.expon(scale=2),
        "triang": stats.triang(0.25, 1, 2),
    }  # fmt: skip
    for name, law in laws.items():
        assert stats.kstest(drawn[name], law.cdf).pvalue > 1e-3, name


def test_choices_and_truth_values() -> None:
    given = "generator: {type: JavaRandom, seed: 42}}"
    triggers = [("trigger", [[n, 0] for n in range(3)])]
    one = behave(f"{{type: Random, distribution: {{type: Bernoulli, probability: 0.7}}, {given}", triggers)
    assert tokens(one) == [False, True, True]
    law = "{type: Choice, values: [a, b, c], weights: [0.3, 0.4, 0.3]}"
    assert tokens(behave(f"{{type: Random, distribution: {law}, {given}", triggers)) == ["c", "b", "b"]


def test_a_distance_of_two_normal_coordinates() -> None:
    numbers = JavaRandom(seed=3).numbers()
    pairs = [(numbers.normal(1.0, 0.5), numbers.normal(-2.0, 0.5)) for _ in range(2)]
    text = "Rician, x_mean: 1, y_mean: -2, standard_deviation: 0.5, generator: {type: JavaRandom, seed: 3}"
    found = tokens(behave(f"{{type: {text}}}", [("trigger", [[0, 1], [1, 1]])]))
    assert found == [math.sqrt(x * x + y * y) for x, y in pairs]


def test_the_seed_of_the_run_does_not_matter_then() -> None:
    actor = "{type: PoissonClock, generator: {type: DRand, seed: 5}}"
    assert behave(actor, [], until=20, seed=1) == behave(actor, [], until=20, seed=2)
    assert not math.isnan(behave(actor, [], until=20)[-1][0])


def test_messages() -> None:
    drawn = "{type: Random, distribution: {type: Gamma}, generator: {type: JavaRandom, seed: 5}}"
    with pytest.raises(ActorError) as caught:
        behave(drawn, [("trigger", [[0, 0]])])
    assert caught.value.reason == "a generator of Java's has no 'gamma'; leave out 'generator'"
    wrong = "{type: PoissonClock, generator: {type: Java, seed: 5}}"
    assert problem(wrong) == "it.generator: 'Java' is not one of DRand, JavaRandom"


@pytest.mark.parametrize("law", sorted(LAWS))
def test_every_law_that_is_said_to_be_known_is(law: str) -> None:
    given = {"Choice": ", values: [a, b]", "Constant": ", value: 1", "Exponential": ", mean: 2"}.get(law, "")
    for kind in ("JavaRandom", "DRand"):
        actor = f"{{type: Random, distribution: {{type: {law}{given}}}, generator: {{type: {kind}, seed: 7}}}}"
        assert len(behave(actor, [("trigger", [[0, 0]])])) == 1
