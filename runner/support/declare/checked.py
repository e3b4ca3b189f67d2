"""What programs give to calls, read as the command line reads it."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from functools import cache, wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from .commands import Declared, declared

P = ParamSpec("P")
T = TypeVar("T")


def checked(call: Callable[P, T]) -> Callable[P, T]:
    """The call, which takes no numbers and choices that its options refuse; raises ``EpicycleError`` for others."""

    @wraps(call)
    def checking(*given: P.args, **named: P.kwargs) -> T:
        return call(*given, **as_declared(call, named))

    return checking


def as_declared(call: Callable[..., Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """What is given for parameters of a call, as its options read it: one value for several is a list of one."""
    known = _declared(call)
    return {name: _read(known[name], value) if name in known else value for name, value in given.items()}


@cache
def _declared(call: Callable[..., Any]) -> dict[str, Declared]:
    return {each.name: each for each in declared(call)}


def _read(parameter: Declared, value: Any) -> Any:
    from epicycle.actors import EpicycleError

    name, option = parameter.name, parameter.option
    if value is None or parameter.is_switch or option.is_argument:
        return value
    if not option.once:
        if isinstance(value, (str, Path)):
            return [value]
        if not isinstance(value, Iterable):
            raise EpicycleError(f"{name}: {value!r} is not a list")
        return value
    if option.choices is not None and value not in option.choices:
        raise EpicycleError(f"{name}: {value!r} is none of {', '.join(map(repr, option.choices))}")
    if option.read is str or value == parameter.default:  # which need not be one that can be given
        return value
    try:
        return option.read(str(value))
    except argparse.ArgumentTypeError as error:
        raise EpicycleError(f"{name}: {error}") from None
