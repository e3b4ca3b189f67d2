"""Rows of the table of counterparts: which of our actors replaces one of Ptolemy's, and the names of its settings."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import Actor as OwnActor
from epicycle.actors import declared_parameters, declared_ports, has_own_ports

from ..dialect import known_types
from .names import snake
from .relations import PortFace

UNSAID: Any = object()
Special = Callable[[Any], None]  # sets the values of an imported actor
_PORT = re.compile(r"(?P<name>\w+)(?P<multi>\*?)(?:=(?P<ours>\w+))?\Z")
_PARAMETER = re.compile(r"(?P<kind>[a-z]+)(?::(?P<ours>\w+))?(?:=(?P<default>.*))?\Z", re.DOTALL)


@dataclass(frozen=True)
class PortSaid:
    """A port of Ptolemy's, and its counterpart."""

    ours: str
    face: PortFace


@dataclass(frozen=True)
class ParameterSaid:
    """A parameter of Ptolemy's: its counterpart, the kind of its value, and the value it has if the file omits it.

    A default is given only where ours differs or is missing.  The kinds: ``value``, ``list``, ``number``, ``whole``,
    ``flag``, ``time`` (s), ``times``, ``text``; ``nothing`` makes no difference to a run, ``none`` has no counterpart.
    """

    ours: str
    kind: str
    default: object = UNSAID


@dataclass(frozen=True)
class Counterpart:
    """A row: our type, its ports and parameters by their names in Ptolemy, and fixed values."""

    type: str
    ports: Mapping[str, PortSaid]
    parameters: Mapping[str, ParameterSaid]
    fixed: Mapping[str, object] = field(default_factory=dict)
    special: Special | None = None  # what a row cannot express
    is_view: bool = False  # it only displays its input
    needs: frozenset[str] = frozenset()  # in Ptolemy, it never fires unless something sends to one of these

    def has_port(self, name: str) -> bool:
        """Whether a port has a counterpart in our actor."""
        kind = known_types().actors.get(self.type)
        return kind is None or has_own_ports(kind) or self.ports[name].ours in declared_ports(kind)


def counterpart(
    type_name: str,
    ports: str = "input | output",
    *,
    fixed: Mapping[str, object] | None = None,
    special: Special | None = None,
    needs: str = "",
    **parameters: str,
) -> Counterpart:
    """A row in short form: ``"input* trigger=ours | output"`` (``*`` marks a multiport), ``period="time=1.0"``."""
    said: dict[str, PortSaid] = {}
    for direction, names in zip(("input", "output"), f"{ports} | ".split("|"), strict=False):
        for each in names.split():
            match = _PORT.fullmatch(each)
            assert match is not None, each
            said[match["name"]] = PortSaid(
                match["ours"] or snake(match["name"]), PortFace(direction, bool(match["multi"]))
            )
    read = {name: _parameter(name, each) for name, each in parameters.items()}
    return Counterpart(type_name, said, read, fixed or {}, special, needs=frozenset(needs.split()))


def _parameter(name: str, text: str) -> ParameterSaid:
    match = _PARAMETER.fullmatch(text)
    assert match is not None, text
    default = UNSAID if match["default"] is None else ast.literal_eval(match["default"])
    return ParameterSaid(match["ours"] or snake(name), match["kind"], default)


def counterpart_of_type(kind: type[OwnActor]) -> Counterpart:
    """The row of a user's actor, for a Java class of that name: all names are ours in camel case."""
    ports = {}
    for name, port in declared_ports(kind).items():
        ports[_camel(name)] = PortSaid(name, PortFace(port.direction, port.multi))
    parameters = {_camel(name): ParameterSaid(name, "value") for name in declared_parameters(kind)}
    return Counterpart(kind.__name__, ports, parameters)


def _camel(name: str) -> str:
    first, *rest = name.split("_")
    return first + "".join(each.capitalize() for each in rest)


def view(ports: str = "input*") -> Counterpart:
    """An actor that only displays its input; a Recorder if an aspect is enabled there or a channel matters."""
    found = counterpart("Recorder", ports)
    ours = {name: PortSaid("input", each.face) for name, each in found.ports.items()}
    return Counterpart("Recorder", ours, {}, is_view=True)
