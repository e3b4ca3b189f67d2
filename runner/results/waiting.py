"""Tokens that wait until the event log encodes them, many at a time.

A token is sent in the middle of other work, when the encoder is not in the processor's caches: encoding takes three
times as long there as among a thousand others.  A token that cannot change therefore waits.  It is often logged several
times, by its sender, by channels that pass it on, by aspects on its way: it is encoded once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

import numpy as np

from .encoding import canonical, encoders, field_values

LARGE = 10_000  # approximate bytes of a token: larger ones do not wait, as a thousand of them could fill the memory
_BEYOND = LARGE + 1
_SMALL = frozenset({float, bool, type(None), np.float64})
_AT_ONCE = _SMALL | {int}  # types whose tokens are encoded as fast as looked up


class WaitingTokens(dict[type, Callable[[Any], Any]]):
    """``waiting[type(token)](token)`` is what to keep of a token; later, everything kept is encoded."""

    def __init__(self) -> None:
        super().__init__()
        self._known: dict[int, Any] = {}  # waiting tokens by id: while they wait, no other object has it

    def __missing__(self, cls: type) -> Callable[[Any], Any]:
        self[cls] = keep = encoders[cls] if cls in _AT_ONCE else self._keep
        return keep

    def _keep(self, token: Any) -> Any:
        """The token itself if it cannot change until it is encoded, or else its bytes.

        Raises an exception if it cannot be encoded.
        """
        if id(token) in self._known:
            return token
        if weight(token) > LARGE:
            return canonical(token)
        self._known[id(token)] = token
        return token

    def forget(self) -> None:
        """Everything kept has been encoded: no token waits any longer."""
        self._known.clear()


def weight(token: Any) -> int:
    """The approximate number of bytes of a token that can wait; huge if it can change, or may not be encodable."""
    kind: type = type(token)
    if kind is np.ndarray:
        is_fixed = not token.flags.writeable and token.base is None and token.dtype.kind in "biuf"
        return int(token.nbytes) if is_fixed else _BEYOND
    if kind in _SMALL:
        return 8
    if kind is str:
        return len(token)
    if kind is int:
        return 8 if -(2**63) <= token < 2**63 else _BEYOND
    values_of = _values_of_fixed(kind)
    if values_of is None:
        return _BEYOND
    total = 0
    for value in values_of(token):
        total += 8 if type(value) in _SMALL else weight(value)
    return total


@cache
def _values_of_fixed(cls: type) -> Callable[[Any], Iterable[Any]] | None:
    """A function that gives the values in a tuple, or in a frozen dataclass; None for all other types."""
    if cls is tuple:
        return iter
    params = vars(cls).get("__dataclass_params__")
    return field_values(cls) if params is not None and params.frozen else None
