"""The laws by which tokens are lost, shared by the aspects that lose them."""

from __future__ import annotations

from .core import JoinPoint


def loses(point: JoinPoint, probability: float, spare_first: bool) -> bool:
    """Whether this token is lost, independently of all others (Bernoulli).

    One uniform number is drawn for every token, whatever the probability: runs at two probabilities from one seed lose
    nested sets of tokens.  With ``spare_first`` the tokens of the first tag at which any passes here are kept.
    """
    return spared(point, point.random.random() < probability, spare_first)


def is_bad(point: JoinPoint, worsens: float, recovers: float) -> bool:
    """The state of a two-state Markov chain that takes one step for every token; it starts in its stationary law.

    ``worsens`` is the probability of good -> bad in a step, ``recovers`` that of bad -> good.  One uniform number is
    drawn for every token.
    """
    draw = point.random.random()
    bad = point.memory.get("bad")
    if bad is None:
        bad = draw * (worsens + recovers) < worsens
    else:
        bad = draw >= recovers if bad else draw < worsens
    point.memory["bad"] = bad
    return bad


def spared(point: JoinPoint, lost: bool, spare_first: bool) -> bool:
    """``lost``, but false for the tokens of the first tag if these are to be kept."""
    if not spare_first:
        return lost
    first = point.memory.get("first tag")
    if first is None:
        point.memory["first tag"] = point.tag
        return False
    return lost and bool(point.tag != first)
