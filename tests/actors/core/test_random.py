"""Random streams: what they promise, and each law against its distribution function at 99.9 %."""

from __future__ import annotations

import copy
import pickle
import re
from typing import Any

import numpy as np
import pytest
from scipy import stats

from epicycle.actors.core import laws
from epicycle.actors.core.random import RandomStream, Stream, random_stream

DRAWS = 6_000
LEVEL = 1e-3  # a right law fails a test with this probability; the seeds are fixed

CONTINUOUS: dict[str, tuple[tuple[Any, ...], Any]] = {
    "random": ((), stats.uniform()),
    "uniform": ((-2.0, 5.0), stats.uniform(-2.0, 7.0)),
    "standard_normal": ((), stats.norm()),
    "normal": ((3.0, 0.5), stats.norm(3.0, 0.5)),
    "lognormal": ((0.3, 0.8), stats.lognorm(0.8, scale=np.exp(0.3))),
    "standard_exponential": ((), stats.expon()),
    "exponential": ((4.0,), stats.expon(scale=4.0)),
    "weibull": ((1.7,), stats.weibull_min(1.7)),
    "pareto": ((3.0,), stats.lomax(3.0)),
    "power": ((2.5,), stats.powerlaw(2.5)),
    "rayleigh": ((2.0,), stats.rayleigh(scale=2.0)),
    "laplace": ((1.0, 2.0), stats.laplace(1.0, 2.0)),
    "logistic": ((1.0, 2.0), stats.logistic(1.0, 2.0)),
    "gumbel": ((1.0, 2.0), stats.gumbel_r(1.0, 2.0)),
    "standard_cauchy": ((), stats.cauchy()),
    "triangular": ((1.0, 2.0, 5.0), stats.triang(0.25, 1.0, 4.0)),
    "standard_gamma": ((3.5,), stats.gamma(3.5)),
    "gamma": ((0.4, 2.0), stats.gamma(0.4, scale=2.0)),
    "chisquare": ((5.0,), stats.chi2(5.0)),
    "beta": ((0.5, 0.7), stats.beta(0.5, 0.7)),
    "standard_t": ((4.0,), stats.t(4.0)),
    "f": ((3.0, 8.0), stats.f(3.0, 8.0)),
    "vonmises": ((0.0, 2.0), stats.vonmises(2.0)),
    "wald": ((2.0, 3.0), stats.invgauss(2.0 / 3.0, scale=3.0)),
}
MORE: list[tuple[str, tuple[Any, ...], Any]] = [
    ("gamma", (1.0, 1.0), stats.expon()),
    ("gamma", (300.0, 1.0), stats.gamma(300.0)),
    ("beta", (3.0, 0.5), stats.beta(3.0, 0.5)),
    ("beta", (20.0, 30.0), stats.beta(20.0, 30.0)),
    ("vonmises", (0.0, 1e-9), stats.uniform(-np.pi, 2.0 * np.pi)),
    ("vonmises", (0.5, 1e7), stats.norm(0.5, 1e7**-0.5)),
    ("triangular", (1.0, 1.0, 2.0), stats.triang(0.0, 1.0, 1.0)),
]
DISCRETE: list[tuple[str, tuple[Any, ...], Any]] = [
    ("integers", (3, 10), stats.randint(3, 10)),
    ("geometric", (0.3,), stats.geom(0.3)),
    ("poisson", (0.7,), stats.poisson(0.7)),
    ("poisson", (9.9,), stats.poisson(9.9)),
    ("poisson", (10.1,), stats.poisson(10.1)),
    ("poisson", (250.0,), stats.poisson(250.0)),
    ("binomial", (7, 0.4), stats.binom(7, 0.4)),
    ("binomial", (40, 0.6), stats.binom(40, 0.6)),
    ("binomial", (500, 0.03), stats.binom(500, 0.03)),
    ("negative_binomial", (3.5, 0.4), stats.nbinom(3.5, 0.4)),
    ("choice", (4,), stats.randint(0, 4)),
]


def stream(seed: int = 1, path: str = "somewhere") -> Stream:
    return random_stream(seed, path, "a test")


@pytest.mark.parametrize(
    ("name", "parameters", "law"),
    [*((name, *rest) for name, rest in CONTINUOUS.items()), *MORE],
    ids=[*CONTINUOUS, *(f"{name}{list(parameters)}" for name, parameters, _ in MORE)],
)
def test_law_of_a_number(name: str, parameters: tuple[Any, ...], law: Any) -> None:
    values = getattr(stream(), name)(*parameters, size=DRAWS)
    assert stats.kstest(values, law.cdf).pvalue > LEVEL


@pytest.mark.parametrize(("name", "parameters", "law"), DISCRETE, ids=[f"{n}{list(p)}" for n, p, _ in DISCRETE])
def test_law_of_an_integer(name: str, parameters: tuple[Any, ...], law: Any) -> None:
    values = getattr(stream(2), name)(*parameters, size=DRAWS)
    assert_counts(values, law)


def assert_counts(values: np.ndarray, law: Any) -> None:
    """Pearson's test over classes that are expected ten times at least."""
    edges = sorted({int(law.ppf(share)) for share in np.linspace(0.002, 0.998, 60)})
    expected = DRAWS * np.diff([0.0, *law.cdf(edges), 1.0])
    counts = np.bincount(np.searchsorted(edges, values), minlength=len(edges) + 1)
    kept = expected > 10.0
    expected = np.append(expected[kept], expected[~kept].sum() + 1e-9)
    counts = np.append(counts[kept], counts[~kept].sum())
    statistic = float(((counts - expected) ** 2 / np.maximum(expected, 1.0)).sum())
    assert stats.chi2.sf(statistic, int(kept.sum())) > LEVEL, (counts, expected)


def test_every_law_is_tested() -> None:
    tested = {*CONTINUOUS, *(name for name, *_ in DISCRETE)}
    others = {"below", "bytes", "state", "shuffle", "permutation", "weighted"}  # in tests of their own
    vectors = {"multinomial", "dirichlet", "multivariate_normal"}
    assert {name for name in vars(RandomStream) if not name.startswith("_")} == tested | others | vectors


def one(word: int) -> RandomStream:
    """A stream whose next word is known."""
    made = RandomStream(np.random.PCG64())
    made._ahead = [word]
    return made


def test_the_inverse_normal_law_is_exact_to_its_last_digits() -> None:
    shares = np.concatenate([np.linspace(1e-4, 1 - 1e-4, 2_001), 10.0 ** -np.arange(4, 15.5, 0.25)])
    words = [int(share * 2**52) << 12 for share in shares]
    exact = stats.norm.ppf([(word / 4096 + 0.5) / 2**52 for word in words])
    values = np.array([laws.standard_normal(one(word)) for word in words])
    assert np.abs(values / exact - 1.0).max() < 4e-15
    assert [laws.standard_normal(one(word)) for word in (0, 2**64 - 1)] == [-8.209536151601386, 8.209536151601386]


@pytest.mark.parametrize("name", ["uniform", "normal", "lognormal", "exponential", "gumbel", "laplace", "logistic"])
def test_one_word_makes_one_value_that_grows_with_it(name: str) -> None:
    if name == "uniform":
        return  # drawn by the stream itself
    values = [
        getattr(laws, name)(one(word << 44), *((2.0, 3.0) if name != "exponential" else (3.0,)))
        for word in range(0, 1 << 20, 1 << 12)
    ]
    assert values == sorted(values)


def test_streams_stay_in_step_when_only_parameters_differ() -> None:
    one, other = stream(), stream()
    for _ in range(50):
        one.normal(0.0, 1.0), one.exponential(1.0), one.uniform(0.0, 1.0)
        other.normal(5.0, 2.0), other.exponential(9.0), other.uniform(-1.0, 3.0)
    assert one.state == other.state


def test_the_same_numbers_on_every_machine() -> None:
    """Written down once; another value anywhere means that runs of old seeds cannot be repeated."""
    here = stream(7, "golden")
    seen = {name: getattr(here, name)(*parameters) for name, (parameters, _) in CONTINUOUS.items()}
    assert {name: value.hex() for name, value in seen.items()} == GOLDEN
    assert [getattr(here, name)(*parameters) for name, parameters, _ in DISCRETE] == GOLDEN_INTEGERS
    assert here.permutation(10).tolist() == GOLDEN_ORDER


def test_random_and_uniform_are_numpys() -> None:
    generator = np.random.Generator(random_stream(3, "a")._bits)
    ours = random_stream(3, "a")
    assert [ours.random() for _ in range(100)] == [generator.random() for _ in range(100)]


@pytest.mark.parametrize("name", [*CONTINUOUS, "integers", "poisson", "binomial"])
def test_an_array_is_drawn_one_by_one(name: str) -> None:
    integers = {"integers": (3, 10), "poisson": (3,), "binomial": (9, 0.5)}
    parameters = integers.get(name) or CONTINUOUS[name][0]
    array, one = stream(), stream()
    values = getattr(array, name)(*parameters, size=(2, 3))
    assert values.shape == (2, 3)
    assert values.ravel().tolist() == [getattr(one, name)(*parameters) for _ in range(6)]
    assert array.state == one.state


def test_many_integers_are_refused_as_single_ones_are() -> None:
    class Bits:  # of 2^64 words each of three numbers gets a third only if 0 is refused
        def __init__(self) -> None:
            self.words = [0, 2**63, 0, 5, 2**64 - 1, 0, 0, 7, 2**62, 1, 2, 3] * 9

        def random_raw(self, count: int | None = None) -> np.ndarray | int:
            if count is None:
                return self.words.pop(0)
            taken, self.words = self.words[:count], self.words[count:]
            return np.array(taken, np.uint64)

    many, one = RandomStream(Bits()), RandomStream(Bits())
    assert many.below(3) == one.below(3) == 1
    assert many.integers(3, size=40).tolist() == [one.below(3) for _ in range(40)]
    assert many.word() == one.word()
    bound = 2**32 - 5
    many, one = stream(), stream()
    assert many.integers(bound, size=100).tolist() == [one.below(bound) for _ in range(100)]


def test_parameters_are_broadcast() -> None:
    values = stream().normal([0.0, 100.0], [[1.0], [0.0]])
    assert values.shape == (2, 2)
    assert values[1].tolist() == [0.0, 100.0]
    assert stream().uniform(np.array([1.0]), 1.0).tolist() == [1.0]
    assert type(stream().normal(np.float64(0.0))) is float
    assert stream().exponential(2.0, 3).shape == (3,)


def test_names_make_streams() -> None:
    first = [random_stream(1, "a", "x").random() for _ in range(2)]
    assert first[0] == first[1]
    others = [random_stream(seed, path, purpose).random() for seed, path, purpose in
              [(2, "a", "x"), (1, "b", "x"), (1, "a", "y"), (1, "a\0x", "")]]  # fmt: skip
    assert len({first[0], *others}) == 5


def test_bounds_of_any_size() -> None:
    here = stream()
    assert {here.below(1) for _ in range(5)} == {0}
    large = [here.below(3 * 2**80) for _ in range(200)]
    assert max(large) < 3 * 2**80
    assert min(large) < 2**80 < 2 * 2**80 < max(large)
    assert here.integers(5, 5, endpoint=True) == 5
    assert set(here.integers(2, size=50).tolist()) == {0, 1}
    assert here.integers(0, 2**64, dtype=np.uint64, size=3).dtype == np.uint64


def test_integers_are_fair_where_words_do_not_divide_evenly() -> None:
    here, third = stream(4), 3 * 2**62
    counts = np.bincount([here.below(third) // 2**62 for _ in range(DRAWS)], minlength=3)
    assert stats.chisquare(counts).pvalue > LEVEL


def test_shuffle_and_permutation() -> None:
    here = stream()
    orders = [tuple(here.permutation(3).tolist()) for _ in range(DRAWS)]
    counts = [orders.count(order) for order in sorted(set(orders))]
    assert len(counts) == 6
    assert stats.chisquare(counts).pvalue > LEVEL
    words = ["a", "b", "c", "d"]
    here.shuffle(words)
    assert sorted(words) == ["a", "b", "c", "d"]
    rows = np.arange(12).reshape(4, 3)
    here.shuffle(rows)
    assert sorted(rows.tolist()) == np.arange(12).reshape(4, 3).tolist()
    assert sorted(here.permutation(["x", "y"]).tolist()) == ["x", "y"]


def test_choice() -> None:
    here = stream(5)
    weights = [0.1, 0.0, 0.6, 0.3]
    drawn = here.choice(4, size=DRAWS, p=weights)
    counts = np.bincount(drawn, minlength=4)
    assert counts[1] == 0
    assert stats.chisquare(counts[[0, 2, 3]], DRAWS * np.array([0.1, 0.6, 0.3])).pvalue > LEVEL
    assert sorted(here.choice(5, size=5, replace=False).tolist()) == [0, 1, 2, 3, 4]
    assert sorted(here.choice(["a", "b", "c"], size=2, replace=False, p=[0.5, 0.0, 0.5]).tolist()) == ["a", "c"]
    assert here.choice(["only"]) == "only"
    pairs = [tuple(here.choice(4, size=2, replace=False).tolist()) for _ in range(DRAWS)]
    assert stats.chisquare([pairs.count(pair) for pair in sorted(set(pairs))]).pvalue > LEVEL
    assert len(set(pairs)) == 12


def test_vectors() -> None:
    here = stream(6)
    counts = here.multinomial(20, [0.2, 0.5, 0.3], size=2_000)
    assert (counts.sum(axis=1) == 20).all()
    assert abs(counts.mean(axis=0) - [4.0, 10.0, 6.0]).max() < 0.2
    assert_counts(here.multinomial(20, [0.2, 0.5, 0.3], size=DRAWS)[:, 1], stats.binom(20, 0.5))
    shares = here.dirichlet([0.5, 2.0, 1.0], size=DRAWS)
    assert abs(shares.sum(axis=1) - 1.0).max() < 1e-12
    for place, law in enumerate([stats.beta(0.5, 3.0), stats.beta(2.0, 1.5), stats.beta(1.0, 2.5)]):
        assert stats.kstest(shares[:, place], law.cdf).pvalue > LEVEL
    covariance = np.array([[4.0, 1.2, 0.0], [1.2, 1.0, 0.0], [0.0, 0.0, 0.0]])
    draws = here.multivariate_normal([1.0, 2.0, 3.0], covariance, size=DRAWS)
    assert (draws[:, 2] == 3.0).all()
    turned = draws[:, 0] - 1.0 - 1.2 * (draws[:, 1] - 2.0)
    assert stats.kstest(turned, stats.norm(0.0, (4.0 - 1.44) ** 0.5).cdf).pvalue > LEVEL
    assert here.multivariate_normal([0.0], [[1.0]]).shape == (1,)


def test_copies_go_on_alike() -> None:
    here = stream()
    here.random(size=5)
    for twin in (copy.deepcopy(here), pickle.loads(pickle.dumps(here))):
        assert twin.state == here.state
        assert twin.random() == copy.deepcopy(here).random()


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda s: s.normal(0.0, -1.0), "scale = -1 is not >= 0"),
        (lambda s: s.exponential(float("nan")), "scale = nan is not >= 0"),
        (lambda s: s.gamma(-1.0), "shape = -1 is not >= 0"),
        (lambda s: s.weibull(0.0), "a = 0 is not > 0"),
        (lambda s: s.poisson(-1.0), "lam = -1 is not between 0 and 1e18"),
        (lambda s: s.binomial(3, 1.5), "p = 1.5 is not between 0 and 1"),
        (lambda s: s.binomial(-1, 0.5), "n = -1 is not between 0 and 2^63 - 1"),
        (lambda s: s.geometric(0.0), "p = 0 is not > 0 and <= 1"),
        (lambda s: s.triangular(1.0, 0.0, 2.0), "left = 1, mode = 0 and right = 2 are not in ascending order"),
        (lambda s: s.integers(3, 3), "there is no integer from 3 to 3 (excluded)"),
        (lambda s: s.choice([]), "the choice is empty: give at least one element"),
        (lambda s: s.choice(3, p=[0.5, 0.5]), "2 weights for 3 elements; give one for each"),
        (lambda s: s.choice(2, p=[0.0, 0.0]), "weights [0.0, 0.0]: expected numbers >= 0 with a finite sum > 0"),
        (lambda s: s.choice(2, 3, False), "cannot choose 3 different elements of 2"),
        (lambda s: s.multinomial(5, [2.0, 1.0]), "pvals [2.0, 1.0]: expected probabilities that add up to at most 1"),
        (lambda s: s.multivariate_normal([0, 0], [[1, 2], [2, 1]]), "cov is not positive semidefinite"),
        (lambda s: s.multivariate_normal([0, 0], [[1, 2], [0, 1]]), "cov is not symmetric"),
        (lambda s: s.multivariate_normal([0, 0], [[1, 2]]), "cov is not square"),
    ],
)
def test_what_cannot_be_drawn(draw: Any, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message) + "$"):
        draw(stream())


def test_laws_that_are_missing_are_told() -> None:
    with pytest.raises(AttributeError) as caught:
        stream().zipf(2.0)
    assert str(caught.value).startswith(
        "a random stream has no 'zipf': NumPy's results depend on its version and the machine; available: below, beta, "
    )
    with pytest.raises(AttributeError, match=r"^a random stream has no 'gauss'$"):
        stream().gauss()


def test_nothing_and_certain() -> None:
    here = stream()
    assert here.poisson(0.0) == 0
    assert here.binomial(0, 0.5) == 0
    assert here.binomial(9, 1.0) == 9
    assert here.geometric(1.0) == 1
    assert here.gamma(0.0) == 0.0
    assert here.normal(2.0, 0.0) == 2.0
    assert len(here.bytes(13)) == 13
    assert here.poisson(1e17) > 9e16


GOLDEN = {
    "random": "0x1.254a019377202p-1",
    "uniform": "0x1.12520326f70b8p-2",
    "standard_normal": "0x1.24898540f50ddp+0",
    "normal": "0x1.70046ec6f6d0bp+1",
    "lognormal": "0x1.daf21cf7c2845p-1",
    "standard_exponential": "0x1.1665d9846992fp+0",
    "exponential": "0x1.1f338f740b5edp-2",
    "weibull": "0x1.80a87b43cf0b1p+0",
    "pareto": "0x1.af1be5fcecf8dp-3",
    "power": "0x1.ccc979e9cf5e8p-1",
    "rayleigh": "0x1.e0a43ccd29d75p+1",
    "laplace": "-0x1.a08db9baf7778p-2",
    "logistic": "-0x1.3849a1105cfecp-1",
    "gumbel": "0x1.8ca97a18cc9dcp+0",
    "standard_cauchy": "0x1.a745a1b53404ep-2",
    "triangular": "0x1.3af4f43299bffp+1",
    "standard_gamma": "0x1.8aeeb50898b8fp+2",
    "gamma": "0x1.6ad3b9b68927cp-1",
    "chisquare": "0x1.3a5c85b675a4ep+3",
    "beta": "0x1.ed02610fc80ebp-1",
    "standard_t": "0x1.5447f5710d6fcp+0",
    "f": "0x1.09e603219b60fp+0",
    "vonmises": "-0x1.1279f714aebb8p+1",
    "wald": "0x1.307e8876a6178p-1",
}
GOLDEN_INTEGERS = [5, 10, 1, 10, 7, 268, 3, 25, 10, 4, 1]
GOLDEN_ORDER = [2, 5, 8, 0, 7, 3, 6, 4, 9, 1]
