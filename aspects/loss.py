"""The law of independent losses, shared by the aspects that lose tokens."""

from __future__ import annotations

from .core import JoinPoint


def loses(point: JoinPoint, probability: float, spare_first: bool) -> bool:
    """Whether this token is lost: one uniform number is drawn for every token, whatever the probability.

    So runs at two probabilities from one seed lose nested sets of tokens.  With ``spare_first`` the tokens of the
    first tag at which any passes here are kept.
    """
    lost = bool(point.random.random() < probability)
    first = point.memory.setdefault("first tag", point.tag)
    return lost and not (spare_first and first == point.tag)
