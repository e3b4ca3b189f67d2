"""Random choices, and vectors of random numbers, drawn in the same way as the single numbers of ``laws``."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate

from .laws import Bits, beta, between, binomial, standard_normal


def cumulated(weights: Sequence[float]) -> list[float]:
    """The cumulated sums of weights; raises ``ValueError`` if they are not weights."""
    sums = list(accumulate(weights))
    if not sums or not all(weight >= 0.0 for weight in weights) or not 0.0 < sums[-1] < math.inf:
        raise ValueError(f"weights {list(weights)}: expected numbers >= 0 with a finite sum > 0")
    return sums


def weighted(bits: Bits, sums: Sequence[float]) -> int:
    """An index with a probability in proportion to its weight; ``sums`` are ``cumulated``."""
    place = bisect_right(sums, between(bits) * sums[-1])
    # Rounding may have reached the whole sum, which is beyond the last weight above 0.
    return place if place < len(sums) else bisect_right(sums, math.nextafter(sums[-1], 0.0))


def without_replacement(bits: Bits, count: int, wanted: int, weights: Sequence[float] | None) -> list[int]:
    """Different indices, in the order in which they are drawn."""
    possible = count if weights is None else sum(weight > 0.0 for weight in weights)
    if wanted > possible:
        raise ValueError(f"cannot choose {wanted} different elements of {possible}")
    drawn: list[int] = []
    if weights is None:
        moved: dict[int, int] = {}  # of a shuffle that stores only the places that changed
        for last in range(count - 1, count - 1 - wanted, -1):
            place = bits.below(last + 1)
            drawn.append(moved.get(place, place))
            moved[place] = moved.get(last, last)
        return drawn
    left = list(weights)
    for _ in range(wanted):
        drawn.append(weighted(bits, cumulated(left)))
        left[drawn[-1]] = 0.0
    return drawn


def multinomial(bits: Bits, n: int, weights: Sequence[float]) -> list[int]:
    """How often each outcome comes: binomial numbers, one after the other, of the remaining trials."""
    share, counts = 1.0, []
    for weight in weights[:-1]:
        counts.append(binomial(bits, n, min(1.0, weight / share)) if n and weight else 0)
        n, share = n - counts[-1], share - weight
        if share < -1e-12 or weight < 0.0:
            raise ValueError(f"pvals {list(weights)}: expected probabilities that add up to at most 1")
    return [*counts, n]


def dirichlet(bits: Bits, shapes: Sequence[float]) -> list[float]:
    """Shares that add up to 1: each is a beta-distributed share of the remainder."""
    left, shares = 1.0, []
    rests = list(accumulate(reversed(shapes)))[::-1]
    for shape, rest in zip(shapes[:-1], rests[1:], strict=True):
        share = beta(bits, shape, rest)
        shares.append(left * share)
        left *= 1.0 - share
    return [*shares, left]


def square_root(covariance: Sequence[Sequence[float]]) -> list[list[float]]:
    """A lower triangle L with L L^T the covariance (Cholesky); zeros for a direction without variance."""
    size = len(covariance)
    if any(len(row) != size for row in covariance):
        raise ValueError("cov is not square")
    root = [[0.0] * size for _ in range(size)]
    for i in range(size):
        for j in range(i + 1):
            if not abs(covariance[i][j] - covariance[j][i]) <= 1e-8 * (1.0 + abs(covariance[i][j])):
                raise ValueError("cov is not symmetric")
            rest = covariance[i][j]
            for k in range(j):
                rest -= root[i][k] * root[j][k]
            if i != j:
                root[i][j] = rest / root[j][j] if root[j][j] else 0.0
            elif rest < -1e-8 * (1.0 + covariance[i][i]):
                raise ValueError("cov is not positive semidefinite")
            else:
                root[i][i] = math.sqrt(rest) if rest > 1e-14 * covariance[i][i] else 0.0
    return root


def multivariate_normal(bits: Bits, means: Sequence[float], root: Sequence[Sequence[float]]) -> list[float]:
    """means + root z, with independent standard normal numbers z."""
    draws = [standard_normal(bits) for _ in means]
    values = []
    for mean, row in zip(means, root, strict=True):
        for factor, draw in zip(row, draws, strict=True):
            mean += factor * draw
        values.append(mean)
    return values
