"""The tables of the importer, YAML files beside it, and the rows of counterparts in them.

A row tells which of our actors stands for one of Ptolemy's, and with what settings.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from epicycle.actors import Actor as OwnActor
from epicycle.actors import declared_parameters, declared_ports, has_own_ports

from ..dialect import known_types
from .writing import snake


@cache
def table(name: str) -> Mapping[str, Any]:
    """The contents of a table."""
    text = Path(__file__).with_name(f"{name}.yaml").read_text(encoding="utf-8")
    found: Mapping[str, Any] = yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    return found


WORDS = {name: frozenset(said.split()) for name, said in table("words").items() if isinstance(said, str)}
CONSTANTS: Mapping[str, Any] = table("functions")["constants"]
OPERATORS: Mapping[str, str] = table("functions")["operators"]
FUNCTIONS: Mapping[str, tuple[str, ...]] = {
    name: (said,) if isinstance(said, str) else tuple(said) for name, said in table("functions")["functions"].items()
}


def why_not(java: str) -> str:
    """The end of the message about a class without a counterpart: a reason, or nothing."""
    reasons = table("words")["reasons"].items()
    return next((f": {reason}" for pattern, reason in reasons if re.search(pattern, java)), "")


# -- rows -------------------------------------------------------------------------------------------------------------


UNSAID: Any = object()
_PORT = re.compile(r"(?P<name>\w+)(?P<multi>\*?)(?:=(?P<ours>\w+))?\Z")
_PARAMETER = re.compile(r"(?P<kind>[a-z]+)(?::(?P<ours>\w+))?(?:=(?P<default>[^|]*[^| ]))?(?: *\|(?P<words>.*))?\Z")
_SETTINGS = ("type", "ports", "set", "compute", "expression", "law", "given", "needs", "how", "note")
_PACKAGES, _FOREIGN, _OF_SINKS = (tuple(WORDS[f"packages {each}"]) for each in ("known", "foreign", "of sinks"))


class Face(NamedTuple):
    """What is known of a port: its direction, whether it is a multiport, and our name in a row of the table."""

    direction: str  # input or output
    multi: bool = False
    ours: str = ""


class Setting(NamedTuple):
    """A parameter of Ptolemy's: its counterpart, the kind of its value, and its default if ours is another."""

    ours: str
    kind: str = "value"
    default: object = UNSAID
    words: Mapping[str, str] | None = None  # by their lower case


@dataclass(frozen=True)
class Row:
    """A row of the table; ``settings`` are those that the head of the table lists."""

    type: str
    ports: Mapping[str, Face]
    parameters: Mapping[str, Setting]
    settings: Mapping[str, Any]
    is_view: bool = False

    def has_port(self, name: str) -> bool:
        """Whether a port has a counterpart in our actor."""
        kind = known_types().actors.get(self.type)
        return kind is None or has_own_ports(kind) or self.ports[name].ours in declared_ports(kind)


def row_of(java: str) -> Row | None:
    """The row for a Java class; None if there is none."""
    name = java if java in table("rows") else java.rpartition(".")[2]
    row = _row(name) if java.startswith(_PACKAGES) and not java.startswith(_FOREIGN) else None
    is_sink = row is not None and (row.is_view or row.type in ("Test", "Recorder", "Stop"))
    return row if is_sink or not java.startswith(_OF_SINKS) else None


@cache
def _row(name: str) -> Row | None:
    said = "Recorder" if name in table("rows")["views"].split() else table("rows").get(name)
    if name == "views" or not isinstance(said, dict):
        found = _row(said) if isinstance(said, str) and name != "views" else None
        return found if found is None or said != "Recorder" else Row("Recorder", found.ports, {}, {}, is_view=True)
    settings = {key: said[key] for key in _SETTINGS if key in said}
    kind = said.get("type", "Expression" if "expression" in said else name)
    ports: dict[str, Face] = {}
    for direction, names in zip(("input", "output"), said.get("ports", "input | output").split("|"), strict=False):
        for match in map(_PORT.match, names.split()):
            assert match is not None, said
            ours = match["ours"] or (match["name"] if kind == "Expression" else snake(match["name"]))
            ports[match["name"]] = Face(direction, bool(match["multi"]), ours)
    return Row(kind, ports, {key: _setting(key, said[key]) for key in said if key not in settings}, settings)


def _setting(name: str, text: str) -> Setting:
    match = _PARAMETER.match(text)
    assert match is not None, text
    ours, default = match["ours"] or snake(name), match["default"]
    if match["words"]:
        pairs = [each.partition("/") for each in match["words"].split()]
        words = {theirs.lower(): (other or theirs).replace("_", " ") for theirs, _, other in pairs}
        return Setting(ours, match["kind"], default, words)
    return Setting(ours, match["kind"], UNSAID if default is None else ast.literal_eval(default))


def row_of_type(kind: type[OwnActor]) -> Row:
    """The row of a user's actor, for a Java class of that name: all names are ours in camel case."""
    ports = {_camel(name): Face(port.direction, port.multi, name) for name, port in declared_ports(kind).items()}
    return Row(kind.__name__, ports, {_camel(name): Setting(name) for name in declared_parameters(kind)}, {})


def _camel(name: str) -> str:
    first, *rest = name.split("_")
    return first + "".join(each.capitalize() for each in rest)
