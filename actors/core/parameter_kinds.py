"""Parameters of several values: arrays, lists of texts, mappings of names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack, cast, overload

import numpy as np
from numpy.typing import NDArray

from .errors import Fault, ParameterError
from .parameter import REQUIRED, Parameter

if TYPE_CHECKING:
    from .parameter import Bounds, Options


@overload
def array_parameter(
    shape: tuple[int | None, ...], default: None, **options: Unpack[Bounds]
) -> Parameter[NDArray[np.float64] | None]: ...
@overload
def array_parameter(
    shape: tuple[int | None, ...], default: object = ..., **options: Unpack[Bounds]
) -> Parameter[NDArray[np.float64]]: ...
def array_parameter(
    shape: tuple[int | None, ...], default: object = REQUIRED, **options: Unpack[Bounds]
) -> Parameter[Any]:
    """A parameter whose value is a read-only array of floats; ``None`` in ``shape`` is any length."""
    return Parameter(cast(Any, float), default, shape=shape, **options)


def any_parameter(default: object = REQUIRED, **options: Unpack[Options]) -> Parameter[Any]:
    """A parameter whose value is anything that YAML can write: a token; with ``shape=(None,)``, a list of these."""
    return Parameter(cast(Any, object), default, **options)


def texts_parameter(default: object = REQUIRED, *, doc: str = "") -> Parameter[tuple[str, ...]]:
    """A parameter whose value is a list of texts; a single text counts as a list of one."""
    given: Any = default
    return Parameter(cast(Any, str), given, shape=(None,), doc=doc)


class MappingParameter(Parameter[Any]):
    """A parameter such as ``initial: {height: 10, speed: 0}``: names chosen by the model, each with a value of
    ``item``.

    Reads as a dict in the order of the names in the file.
    """

    def __init__(self, item: Parameter[Any], default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(object, default, doc=doc)
        self.item = item

    def describe_type(self) -> str:
        return f"mapping of names to {self.item.describe_type()}"

    def convert(self, value: object) -> dict[str, Any] | None:
        if value is None and self.optional:
            return None
        if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
            raise ParameterError(f"{value!r} is not a {self.describe_type()}")
        converted, faults = {}, list[Fault]()
        for name, each in value.items():
            try:
                converted[name] = self.item.convert(each)
            except ParameterError as error:
                faults += error.within(name, prefix=f"{name}: ")
        if faults:
            raise ParameterError.several(faults)
        return converted
