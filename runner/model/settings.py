"""What is said about a model from outside: ``--set path=value``, ``--aspect name=Type,key=value``, ``--without``."""

from __future__ import annotations

from dataclasses import dataclass

from .declarations import ModelText, PartText, Text
from .document import Entry, Node, Scalar, parse
from .patterns import PatternError, matches
from .problems import Position, Problems, did_you_mean


@dataclass
class Setting:
    """A value for every parameter whose path matches a pattern."""

    path: str
    node: Node
    position: Position
    used: bool = False

    def matches(self, full: str) -> bool:
        """Whether the setting is for the parameter at this path."""
        return matches(self.path, full)


def parse_setting(text: str, problems: Problems) -> Setting | None:
    """``path=value``, where value is a YAML value such as ``3``, ``5 m`` or ``[0, 1]``."""
    option = f"--set {text}"
    position = Position("command line", 1, 7, max(1, len(text)), option)
    path, equals, value = text.partition("=")
    path = path.strip()
    if not equals or not path:
        problems.add(f"{text!r} is not of the form path=value", position)
        return None
    try:
        matches(path, "")
    except PatternError as error:
        problems.add(f"{path!r} is no parameter path: {error}", position)
        return None
    node = _value(value, option, problems)
    return None if node is None else Setting(path, node, position)


def _value(text: str, option: str, problems: Problems) -> Node | None:
    if not text.strip():
        position = Position("command line", 1, 1, len(option), option)
        return Scalar(None, "", True, position)
    return parse(text, f"value in '{option}'", problems)


def without(text: ModelText, name: str, problems: Problems) -> None:
    """Take an aspect out of a model."""
    if text.root.aspects.pop(name, None) is None:
        option = f"--without {name}"
        problems.add(
            f"the model has no aspect {name!r}{did_you_mean(name, list(text.root.aspects))}",
            Position("command line", 1, 11, max(1, len(name)), option),
            f"its aspects: {', '.join(text.root.aspects) or 'none'}",
        )


def change_aspect(text: ModelText, change: str, problems: Problems) -> None:
    """``name=Type,key=value,...``: add an aspect, or put another in the place of one that is there.

    An aspect that is replaced leaves its ports to the new one unless ``at`` is given; if the type stays the same, so
    do the parameters that are not given.
    """
    option = f"--aspect {change}"
    position = Position("command line", 1, 10, max(1, len(change)), option)
    name, equals, rest = change.partition("=")
    parts = _split(rest)
    if not equals or not name.strip() or not parts or not parts[0]:
        problems.add(f"{change!r} is not of the form name=Type,key=value", position)
        return
    name = name.strip()
    values: dict[str, Entry] = {}
    for part in parts[1:]:
        key, equals, value = part.partition("=")
        key = key.strip()
        if not equals or not key:
            problems.add(f"{part!r} is not of the form key=value", position)
            return
        node = _value(value, option, problems)
        if node is not None:
            values[key] = Entry(Scalar(key, key, True, position), node)
    old = text.root.aspects.get(name)
    at = [Text(parse_text(values.pop("at").value), position)] if "at" in values else (old.at if old else [])
    if old is not None and old.type.text == parts[0]:
        values = {**old.values, **values}
    text.root.aspects[name] = PartText(name, position, Text(parts[0], position), values, at=at)


def parse_text(node: Node) -> str:
    """The text of a scalar."""
    return node.text if isinstance(node, Scalar) else ""


def _split(text: str) -> list[str]:
    """Split at commas that are not inside brackets."""
    parts, depth, start = [], 0, 0
    for index, character in enumerate(text):
        if character in "[{(":
            depth += 1
        elif character in "]})":
            depth -= 1
        elif character == "," and depth == 0:
            parts.append(text[start:index].strip())
            start = index + 1
    parts.append(text[start:].strip())
    return parts
