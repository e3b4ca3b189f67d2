"""The types of composite ports as written in a model: ``float``, ``int | str``, ``array[n, 2]``, ``Measurement``."""

from __future__ import annotations

import re
import types
import typing
from collections.abc import Callable, Iterator, Mapping
from functools import reduce
from operator import or_
from typing import Annotated, Any

import numpy as np

from epicycle.actors import FaultError, declared_ports, did_you_mean, shaped
from epicycle.aspects import Request

from ..text.reading import split
from .types import Catalogue

BUILT_IN: dict[str, Any] = {
    "any": Any,
    "array": np.ndarray,
    "bool": bool,
    "dict": dict,
    "float": float,
    "int": int,
    "list": list,
    "str": str,
    "tuple": tuple,
}
MAX_TEXT = 200
_TYPE = re.compile(r"([A-Za-z_]\w*)\s*(?:\[(.*)\])?\Z", re.ASCII | re.DOTALL)


def read_type(text: str, tokens: Callable[[], Mapping[str, type]]) -> Any:
    """The type that a text names; ``tokens`` gives the token classes by name.  Raises ``FaultError``."""
    if len(text) > MAX_TEXT:
        raise FaultError(f"a type has at most {MAX_TEXT} characters")
    choices = [_one(text[start:end].strip(), tokens) for start, end in split(text, "|")]
    return Any if Any in choices else reduce(or_, choices) if len(choices) > 1 else choices[0]


def _one(text: str, tokens: Callable[[], Mapping[str, type]]) -> Any:
    match = _TYPE.match(text)
    if match is None:
        raise FaultError(f"{text!r} is not a type", help=["write a name such as float, 'float | int' or array[2]"])
    name, inside = match.groups()
    if name not in BUILT_IN and name not in tokens():
        known = [*BUILT_IN, *sorted(tokens())]
        near = did_you_mean(name, known)
        raise FaultError(f"there is no type {name!r}{near}", help=[f"types: {', '.join(known)}"])
    found: Any = BUILT_IN.get(name) or tokens()[name]
    if inside is None:
        return found
    parts = [inside[start:end].strip() for start, end in split(inside, ",")]
    if name == "array":
        return shaped(np.ndarray, tuple(_size(part) for part in parts))
    if len(parts) != {"list": 1, "dict": 2}.get(name, len(parts) if name == "tuple" else 0):
        advice = "array[...], list[...], dict[..., ...] and tuple[...] take brackets"
        raise FaultError(f"{text!r} is not a type", help=[advice])
    arguments = tuple(read_type(part, tokens) for part in parts)
    return found[arguments if len(arguments) > 1 else arguments[0]]


def _size(text: str) -> int | None:
    if text == "n":
        return None
    if re.fullmatch(r"\d{1,9}", text, re.ASCII):
        return int(text)
    raise FaultError(f"{text!r} is not an array size", help=["write a number, or n for any"])


def token_types(catalogue: Catalogue) -> dict[str, type]:
    """The classes in the port types of all actors, and what passes through aspects that are models, by name."""
    found: dict[str, type] = {Request.__name__: Request}
    for actor in catalogue.loaded()[0].actors.values():
        for port in declared_ports(actor).values():
            for each in _classes(port.type):
                found.setdefault(each.__name__, each)
    no_token = (object, types.UnionType, Annotated, *BUILT_IN.values())
    return {name: each for name, each in found.items() if each not in no_token}


def _classes(declared: Any) -> Iterator[type]:
    if arguments := typing.get_args(declared):
        for argument in (typing.get_origin(declared), *arguments):
            yield from _classes(argument)
    elif isinstance(declared, type):
        yield declared
