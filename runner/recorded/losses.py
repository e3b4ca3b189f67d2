"""Channels fitted to measured losses by maximum likelihood, and how well they fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Losses = NDArray[np.uint8]  # 1 for a lost message

_TRIED = 200_000  # messages from which the best starting point is chosen
_IMPOSSIBLE = -1e300  # a log likelihood that can be compared
_FAR, _DIGITS = 22.0, 9  # log odds of what is nearly 0 or 1, and the decimal places by which it is just that
_EXPECTED = 5.0  # runs in a bin of the chi-square test, at least
_BINS = 20


@dataclass(frozen=True)
class Goodness:
    """A test of goodness of fit; a small ``p`` speaks against the model."""

    name: str
    statistic: float
    freedom: int | None
    p: float


@dataclass(frozen=True)
class Channel:
    """A channel that is good or bad, as the aspect ``GilbertElliott`` has it."""

    p: float
    r: float
    loss_bad: float = 1.0
    loss_good: float = 0.0

    @property
    def bad(self) -> float:
        """The share of messages that find it bad."""
        return self.p / (self.p + self.r) if self.p + self.r > 0.0 else 0.0


@dataclass(frozen=True)
class LossModel:
    """One model of the losses: what it is as an aspect, and how well it fits.

    ``runs`` compares the lengths of runs of losses, and of runs without, with those of the model; ``gain`` is the
    likelihood ratio test against the simpler model before it.
    """

    name: str
    aspect: str
    parameters: dict[str, float]
    log_likelihood: float
    free: int
    bic: float
    runs: Goodness | None
    gain: Goodness | None


def loss_models(lost: NDArray[np.bool_]) -> list[LossModel]:
    """The models of increasing freedom: independent losses, Gilbert's bursts, Gilbert-Elliott's hidden states."""
    from scipy.stats import chi2

    losses: Losses = lost.astype(np.uint8)
    count, number = int(np.count_nonzero(losses)), len(losses)
    share = count / number
    channels = [("independent", "PacketLoss", {"probability": share}, Channel(1.0, 1.0, share, share))]
    if 0 < count < number:
        bursts, hidden = gilbert(losses), gilbert_elliott(losses)
        channels.append(("Gilbert", "GilbertElliott", {"p": bursts.p, "r": bursts.r}, bursts))
        channels.append(("Gilbert-Elliott", "GilbertElliott", vars(hidden), hidden))
    found: list[LossModel] = []
    for name, aspect, parameters, channel in channels:
        likelihood, free, gain = log_likelihood(losses, channel), len(parameters), None
        if found:
            statistic = max(0.0, 2.0 * (likelihood - found[-1].log_likelihood))
            freedom = free - found[-1].free
            gain = Goodness("likelihood ratio", statistic, freedom, float(chi2.sf(statistic, freedom)))
        bic, runs = free * math.log(number) - 2.0 * likelihood, run_lengths(losses, channel, free)
        found.append(LossModel(name, aspect, parameters, likelihood, free, bic, runs, gain))
    return found


# -- estimates --------------------------------------------------------------------------------------------------------


def gilbert(losses: Losses) -> Channel:
    """The channel that loses everything while it is bad, and nothing while it is good, by counting its changes.

    A change that was never seen counts as one that comes right after the last message: without it, a trace that begins
    or ends in the other state would be impossible.
    """
    before, after = losses[:-1], losses[1:]
    bad = int(np.count_nonzero(before))
    worse = int(np.count_nonzero(after & (1 - before)))
    better = int(np.count_nonzero(before & (1 - after)))
    good = len(before) - bad
    return Channel(worse / good if worse else 1.0 / (good + 1), better / bad if better else 1.0 / (bad + 1))


def gilbert_elliott(losses: Losses) -> Channel:
    """The channel with hidden states, from the best of several starting points."""
    share, simple = float(np.mean(losses)), gilbert(losses)
    starts = [
        Channel(max(simple.p / slow, 1e-6), max(simple.r / slow, 1e-6), high, low)
        for slow in (1.0, 4.0, 16.0)
        for high, low in ((0.95, 0.02 * share), (0.5 + 0.5 * share, 0.5 * share))
    ]
    part = losses[:_TRIED]
    best = max((_improved(part, start) for start in starts), key=lambda each: log_likelihood(part, each))
    found = _improved(losses, best)
    if found.loss_bad < found.loss_good:
        found = Channel(found.r, found.p, found.loss_good, found.loss_bad)
    # Without hidden states where these explain nothing more.
    return found if log_likelihood(losses, found) >= log_likelihood(losses, simple) else simple


def _improved(losses: Losses, start: Channel) -> Channel:
    """The channel of greatest likelihood near another one; in log odds, small probabilities are no edge of a search."""
    from scipy.optimize import minimize
    from scipy.special import expit, logit

    def cost(odds: NDArray[np.float64]) -> float:
        return -max(log_likelihood(losses, Channel(*expit(odds))), _IMPOSSIBLE)

    ends = (-_FAR, _FAR)
    odds = np.clip(logit(_values(start)), *ends)
    found = minimize(cost, odds, method="L-BFGS-B", bounds=[ends] * len(odds))
    return Channel(*expit(found.x).round(_DIGITS).tolist())


def log_likelihood(losses: Losses, channel: Channel) -> float:
    """The natural logarithm of the probability of the losses."""
    return _compiled()(losses, *_values(channel))


def _values(channel: Channel) -> tuple[float, float, float, float]:
    return channel.p, channel.r, channel.loss_bad, channel.loss_good


@cache
def _compiled() -> Callable[..., float]:
    from numba import njit  # heavy

    compiled: Any = njit(_log_likelihood)
    return compiled  # type: ignore[no-any-return]


def _log_likelihood(losses: Any, p: float, r: float, loss_bad: float, loss_good: float) -> float:
    """For numba; ``bad`` is the probability of the bad state given the losses before a message, then with its own."""
    bad = p / (p + r) if p + r > 0.0 else 0.0
    likelihood = 0.0
    for index in range(len(losses)):
        if index > 0:
            bad = bad * (1.0 - r) + (1.0 - bad) * p
        is_bad = bad * (loss_bad if losses[index] else 1.0 - loss_bad)
        is_good = (1.0 - bad) * (loss_good if losses[index] else 1.0 - loss_good)
        whole = is_bad + is_good
        if whole <= 0.0:
            return -np.inf
        likelihood += np.log(whole)
        bad = is_bad / whole
    return likelihood


# -- runs -------------------------------------------------------------------------------------------------------------


def runs(losses: Losses) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The lengths of the runs of losses and of the runs without, those at the ends left out: they are cut off."""
    edges = np.flatnonzero(np.diff(losses.astype(np.int8)))
    lengths = np.diff(edges)
    first, second = lengths[0::2], lengths[1::2]
    return (first, second) if len(edges) and not losses[edges[0]] else (second, first)


def run_lengths(losses: Losses, channel: Channel, free: int) -> Goodness | None:
    """Pearson's chi-square test of the lengths of runs; None where there are too few."""
    from scipy.stats import chi2

    statistic, bins, kinds = 0.0, 0, 0
    opposite = Channel(channel.p, channel.r, 1.0 - channel.loss_bad, 1.0 - channel.loss_good)
    for lengths, of in zip(runs(losses), (channel, opposite), strict=True):
        found = _binned(lengths, of)
        if len(found) > 1:
            statistic += math.fsum((seen - expected) ** 2 / expected for seen, expected in found)
            bins, kinds = bins + len(found), kinds + 1
    freedom = bins - kinds - free
    return Goodness("chi-square", statistic, freedom, float(chi2.sf(statistic, freedom))) if freedom > 0 else None


def _binned(lengths: NDArray[np.int64], channel: Channel) -> list[tuple[int, float]]:
    """How many runs of losses are in each bin of lengths, and how many are expected."""
    number = len(lengths)
    least = max(_EXPECTED, number / _BINS)
    if number < 2 * least:
        return []
    ordered = np.sort(lengths)
    found, above, first = [], 1.0, 1  # the probability of a length from first on
    for length, longer in enumerate(_longer(channel), 1):
        if number * longer < least:
            break
        if number * (above - longer) >= least:
            seen = np.searchsorted(ordered, length, "right") - np.searchsorted(ordered, first, "left")
            found.append((int(seen), number * (above - longer)))
            above, first = longer, length + 1
    seen = number - np.searchsorted(ordered, first, "left")
    return [*found, (int(seen), number * above)]


def _longer(channel: Channel) -> Iterator[float]:
    """The probabilities that a run of losses is longer than 1, 2, ... messages, in the stationary state."""
    p, r, high, low = _values(channel)

    def step(bad: float, good: float) -> tuple[float, float]:
        """After another loss."""
        return (bad * (1.0 - r) + good * p) * high, (bad * r + good * (1.0 - p)) * low

    bad, good = step(channel.bad * (1.0 - high), (1.0 - channel.bad) * (1.0 - low))
    whole = bad + good
    while True:
        bad, good = step(bad, good)
        yield (bad + good) / whole if whole > 0.0 else 0.0
