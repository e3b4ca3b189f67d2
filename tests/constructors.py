"""Constructors as type checkers see them, made from what actors, aspects and their parts declare.

A class takes its parameters as ``**parameters``, which says nothing to a type checker.  So the faces of ``actors`` and
``aspects`` show it a subclass of each instead, whose ``__init__`` names them; Python never imports these stubs.
"""

from __future__ import annotations

from collections.abc import Iterable
from keyword import iskeyword
from pathlib import Path
from typing import Any

from epicycle.actors import Actor, Configurable, MappingParameter, Parameter, declared_parameters
from epicycle.actors.expression import (
    Formula,
    FormulaParameter,
    PortFormula,
    PortFormulaParameter,
    TokenFormulaParameter,
)
from epicycle.actors.functions import FunctionParameter
from epicycle.aspects import ByActorParameter, GroupsParameter
from epicycle.runner.model.catalogue.reference import describe, is_part, parts_of
from epicycle.runner.model.catalogue.types import built_in

HEAD = """\
# What constructors take, as the declarations say: for type checkers only.  Written by `make reference`.
# fmt: off
# ruff: noqa

from collections import abc
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

"""
KINDS = """
_Number: TypeAlias = float | np.floating[Any] | np.integer[Any] | str  # a text has a unit
_Whole: TypeAlias = int | np.integer[Any] | str
_Row: TypeAlias = abc.Sequence[_Number] | NDArray[Any]
_Rows: TypeAlias = abc.Sequence[_Row] | NDArray[Any]
_Texts: TypeAlias = str | abc.Sequence[str]
"""
WORDS: dict[Any, str] = {
    float: "_Number",
    int | float: "_Number",
    int: "_Whole",
    bool: "bool",
    str: "str",
    Path: "str | Path",
    object: "object",
}


def stubs() -> dict[str, str]:
    """The text of each file of stubs, by its name."""
    known = built_in()
    types: list[type[Configurable]] = [*known.actors.values(), *known.aspects.values()]
    parts = parts_of(types)
    types += [each for found in parts.values() for each in found.values()]
    return {f"{face}/constructors.pyi": _stub(face, types, parts) for face in ("actors", "aspects")}


def _stub(face: str, types: Iterable[type[Configurable]], bases: Iterable[type]) -> str:
    mine = sorted((each for each in types if _place(each)[0] == face), key=lambda each: each.__name__)
    classes = "".join(map(_class, mine))
    imports: dict[str, set[str]] = {}
    for cls in mine:
        imports.setdefault(_place(cls)[1], set()).add(f"{cls.__name__} as _{cls.__name__}")
    # What annotations name: in actors by the module that defines it, in aspects by the face of actors.
    for cls in (each for each in (*bases, Formula, PortFormula) if f" {each.__name__}" in classes):
        module = _place(cls)[1] if face == "actors" else "epicycle.actors"
        module = "epicycle.actors.expression" if cls in (Formula, PortFormula) else module
        imports.setdefault(module, set()).add(cls.__name__)
    lines = [f"from {module} import {', '.join(sorted(names))}\n" for module, names in sorted(imports.items())]
    return f"{HEAD}{''.join(lines)}{KINDS}{classes}"


def _place(cls: type) -> tuple[str, str]:
    """The folder that defines a class, and its module as seen from there."""
    _, folder, *rest = cls.__module__.split(".")
    return folder, f".{'.'.join(rest)}"


def _class(cls: type[Configurable]) -> str:
    parameters = list(declared_parameters(cls).values())
    taken = [
        *(["path: str"] if issubclass(cls, Actor) else []),
        *(["*"] if parameters else []),
        *map(_taken, parameters),
    ]
    summary = describe(cls.__name__, cls).summary.replace("\\", "\\\\")
    head = f'class {cls.__name__}(_{cls.__name__}):\n    """{summary}."""\n'
    return f"\n{head}    def __init__({', '.join(['self', *taken])}) -> None: ...\n"


def _taken(parameter: Parameter[Any]) -> str:
    """A parameter as it stands in a constructor."""
    name = f"{parameter.name}_" if iskeyword(parameter.name) else parameter.name
    kind, default = annotation(parameter), "" if parameter.required else " = ..."
    return f"{name}: {kind}{' | None' if parameter.optional and kind != 'object' else ''}{default}"


def annotation(parameter: Parameter[Any]) -> str:
    """The type of what a parameter takes."""
    if parameter.forms:
        return " | ".join(dict.fromkeys(map(annotation, parameter.forms)))
    if isinstance(parameter, (MappingParameter, ByActorParameter)):
        return f"abc.Mapping[str, {annotation(parameter.item)}]"
    if isinstance(parameter, GroupsParameter):
        return "abc.Mapping[str, _Texts]"
    if isinstance(parameter, (FormulaParameter, TokenFormulaParameter)):
        return "str | float | Formula"
    if isinstance(parameter, PortFormulaParameter):
        return "str | PortFormula"
    if isinstance(parameter, FunctionParameter):
        return "str | abc.Callable[..., object]"
    if is_part(parameter):
        return f"{parameter.type.__name__} | abc.Mapping[str, object]"
    if parameter.choices:
        return f"Literal[{', '.join(map(repr, parameter.choices))}]"
    if parameter.shape is None:
        return WORDS[parameter.type]
    return {str: "_Texts", object: "abc.Sequence[object]"}.get(
        parameter.type, "_Row" if len(parameter.shape) == 1 else "_Rows"
    )
