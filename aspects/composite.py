"""Aspects that are models: a composite through which the tokens of join points go before they go on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from .core import Aspect


@dataclass(frozen=True)
class Request:
    """A token on its way through an aspect that is a model: what the actors of such a composite get and send.

    ``source`` is the port that the token comes from, ``port`` where it was going (the connection, for an aspect that
    stands on one alone), ``time`` when it came, in s.  What the composite answers goes on to where the request came
    from: an actor inside may keep a request for a while, lose it, or change its token with
    ``dataclasses.replace(request, token=...)``.
    """

    token: Any
    source: str
    port: str
    time: float
    aspect: str
    way: int = 0  # which of the ways through the port


class CompositeAspect(Aspect):
    """An aspect that is a model: each token is a request to a composite, and goes on when the composite answers.

    Events: ``requested``; ``delivered``, with the seconds since.  A request that is never answered is a token lost.
    Ptolemy: ``CompositeCommunicationAspect``.
    """

    events: ClassVar[tuple[str, ...]] = ("requested", "delivered")
