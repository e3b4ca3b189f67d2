"""Choices among several, and vectors of random numbers; made as ``laws`` makes single numbers."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate

from .laws import Bits, beta, between, binomial, standard_normal


def cumulated(weights: Sequence[float]) -> list[float]:
    """The sums of weights up to each; raises ``ValueError`` where they are no weights."""
    sums = list(accumulate(weights))
    if not sums or not all(weight >= 0.0 for weight in weights) or not 0.0 < sums[-1] < math.inf:
        raise ValueError(f"weights {list(weights)} are not all 0 or more with a finite sum above 0")
    return sums


def weighted(bits: Bits, sums: Sequence[float]) -> int:
    """An index, as likely as its weight; ``sums`` are ``cumulated``."""
    place = bisect_right(sums, between(bits) * sums[-1])
    # Rounding may have reached the whole sum, which lies beyond the last weight that is not 0.
    return place if place < len(sums) else bisect_right(sums, math.nextafter(sums[-1], 0.0))


def without_replacement(bits: Bits, count: int, wanted: int, weights: Sequence[float] | None) -> list[int]:
    """Different indices, in the order in which they are drawn."""
    possible = count if weights is None else sum(weight > 0.0 for weight in weights)
    if wanted > possible:
        raise ValueError(f"{wanted} different elements are asked for, and there are {possible}")
    drawn: list[int] = []
    if weights is None:
        moved: dict[int, int] = {}  # of a shuffle whose untouched places are not written down
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
    """How often each outcome comes: one binomial number after the other, of what is left."""
    share, counts = 1.0, []
    for weight in weights[:-1]:
        counts.append(binomial(bits, n, min(1.0, weight / share)) if n and weight else 0)
        n, share = n - counts[-1], share - weight
        if share < -1e-12 or weight < 0.0:
            raise ValueError(f"pvals {list(weights)} are no probabilities, or add up to more than 1")
    return [*counts, n]


def dirichlet(bits: Bits, shapes: Sequence[float]) -> list[float]:
    """Shares that add up to 1: each is a beta share of what the ones before it have left."""
    left, shares = 1.0, []
    rests = list(accumulate(reversed(shapes)))[::-1]
    for shape, rest in zip(shapes[:-1], rests[1:], strict=True):
        share = beta(bits, shape, rest)
        shares.append(left * share)
        left *= 1.0 - share
    return [*shares, left]


def square_root(covariance: Sequence[Sequence[float]]) -> list[list[float]]:
    """A lower triangle L with L L^T the covariance (Cholesky); a direction without variance gets zeros."""
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
