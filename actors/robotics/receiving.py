"""How messages enter an actor: the shapes of their arrays are checked here, so that kernels, which do not check them,
never read or write beyond an array."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from ..core import REQUIRED, EpicycleError, InputPort, Parameter, ParameterError
from .arrays import Array
from .messages import Observation
from .sensor_models import RANGE, RELATIVE_POSITION
from .tokens import ANY, SOME, Shape, Token

PLANE, SPACE = (2,), (3,)
EITHER = PLANE + SPACE
_WHERE = {2: "in the plane", 3: "in space"}
_KINDS = RANGE, RELATIVE_POSITION


class MessageError(EpicycleError):
    """A message has arrays of shapes that its receiver cannot use."""


class PlaceParameter(Parameter[Any]):
    """A place in the plane or in space: an array of two or three numbers, the height last; or ``several`` places."""

    def __init__(self, default: object = REQUIRED, *, several: bool = False, unit: str = "m", doc: str) -> None:
        given: Any = default
        super().__init__(float, given, unit=unit, shape=(None, None) if several else (None,), doc=doc)

    def convert(self, value: object) -> Any:
        several = len(self.shape or ()) == 2
        each = value if several and isinstance(value, (list, tuple, np.ndarray)) else (value,)
        lengths = {len(place) for place in each if isinstance(place, (list, tuple, np.ndarray))}
        for length in lengths - set(EITHER):
            raise ParameterError(f"it has {length} numbers; expected 2, or 3 with the height last")
        if len(lengths) > 1:
            raise ParameterError("some places have a height, and others have none")
        return super().convert(value)


M = TypeVar("M", bound=Token)


def received(port: InputPort[M], dimensions: Sequence[int] = EITHER) -> tuple[M, ...]:
    """The tokens of a port, each with arrays for one of the ``dimensions``; raises ``MessageError`` if one has not."""
    tokens = port.tokens
    for token in tokens:
        _check(port, token, dimensions)
    return tokens


def by_channel(port: InputPort[M], dimensions: Sequence[int] = EITHER) -> list[list[M]]:
    """The same, a list for each channel."""
    received(port, dimensions)
    return port.by_channel()


def latest(port: InputPort[M], dimensions: Sequence[int] = EITHER) -> M:
    """The same, the last of them."""
    return received(port, dimensions)[-1]


def _check(port: InputPort[M], message: M, dimensions: Sequence[int]) -> None:
    for each in dimensions:
        if message.fits(each):
            kind = getattr(message, "kind", RANGE)
            if kind not in _KINDS and not isinstance(message, Observation):
                raise MessageError(
                    f"{port.path} got {type(message).__name__} of the kind {kind!r}; expected {' or '.join(_KINDS)}"
                )
            return
    name, array, _ = _culprit(message, dimensions)
    expected = " or ".join(
        f"({', '.join(map(str, shape))}{',' * (len(shape) == 1)}) {_WHERE[each]}"
        for each in dimensions
        for other, _, shape in message.shapes(each)
        if other == name
    )
    raise MessageError(
        f"{port.path} got {type(message).__name__} with {name!r} of shape {array.shape}; expected {expected}"
    )


def _culprit(message: M, dimensions: Sequence[int]) -> tuple[str, Array, Shape]:
    """The array that does not fit, judged by the dimensions in which most of the arrays do."""
    wrong = [[each for each in message.shapes(d) if not _fits(each[1].shape, each[2])] for d in dimensions]
    return min(wrong, key=len)[0]


def _fits(found: tuple[int, ...], expected: Shape) -> bool:
    return len(found) == len(expected) and all(
        wanted in (length, ANY) or (wanted == SOME and length > 0)
        for length, wanted in zip(found, expected, strict=True)
    )
