"""What a row of the table of counterparts says: which actor stands for one of Ptolemy's, and what its words are."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import Actor as OwnActor
from epicycle.actors import declared_parameters, declared_ports, has_own_ports

from ..catalogue import built_in
from .names import snake
from .relations import PortFace

UNSAID: Any = object()
Special = Callable[[Any], None]  # what finds the values of an actor that is imported
_PORT = re.compile(r"(?P<name>\w+)(?P<multi>\*?)(?:=(?P<ours>\w+))?\Z")
_PARAMETER = re.compile(r"(?P<kind>[a-z]+)(?::(?P<ours>\w+))?(?:=(?P<default>.*))?\Z", re.DOTALL)


@dataclass(frozen=True)
class PortSaid:
    """A port of Ptolemy's, and which of ours it is."""

    ours: str
    face: PortFace


@dataclass(frozen=True)
class ParameterSaid:
    """A parameter of Ptolemy's: which of ours it is, how it is written, and what it is if it is left out there.

    The default stands only where ours is another, or has none.  The kinds: ``value``, ``list``, ``number``, ``whole``,
    ``flag``, ``time`` (s), ``times``, ``text``; ``nothing`` makes no difference to a run, ``none`` has no counterpart.
    """

    ours: str
    kind: str
    default: object = UNSAID


@dataclass(frozen=True)
class Counterpart:
    """A row: our type, its ports by their names there, its parameters, and values that it always has."""

    type: str
    ports: Mapping[str, PortSaid]
    parameters: Mapping[str, ParameterSaid]
    fixed: Mapping[str, object] = field(default_factory=dict)
    special: Special | None = None  # what the words of a row cannot say
    is_view: bool = False  # it only shows what comes, to somebody who looks on
    needs: frozenset[str] = frozenset()  # inputs of which one must be fed, or it never fires there, though ours would

    def has_port(self, name: str) -> bool:
        """Whether a port there is one of our actor's."""
        kind = built_in().actors.get(self.type)
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
    """A row in few words: ``"input* trigger=ours | output"`` (``*`` is a multiport), ``period="time=1.0"``."""
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
    """The row of an actor of one's own, for a Java class of its name: all names are ours in camel case."""
    ports = {}
    for name, port in declared_ports(kind).items():
        ports[_camel(name)] = PortSaid(name, PortFace(port.direction, port.multi))
    parameters = {_camel(name): ParameterSaid(name, "value") for name in declared_parameters(kind)}
    return Counterpart(kind.__name__, ports, parameters)


def _camel(name: str) -> str:
    first, *rest = name.split("_")
    return first + "".join(each.capitalize() for each in rest)


def view(ports: str = "input*") -> Counterpart:
    """An actor that only shows what comes; a Recorder where an aspect stands there, or a channel counts."""
    found = counterpart("Recorder", ports)
    ours = {name: PortSaid("input", each.face) for name, each in found.ports.items()}
    return Counterpart("Recorder", ours, {}, is_view=True)
