"""Settings from outside, ``--set path=value`` and ``--overrides file``, and the single acts of aspects that happen."""

from __future__ import annotations

import re
from collections.abc import Iterable
from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass
from pathlib import Path

from ..text.document import Mapping, Node, Scalar, parse, read
from ..text.files import COMMAND_LINE
from ..text.limits import NORMAL, Limits
from ..text.patterns import Comparisons, PatternError, check_pattern, matches, names_asked, names_of
from ..text.problems import POISON, Position, Problems
from ..text.program import call_site, node_of
from ..text.reading import NodeReader, Text, is_empty, split
from .fields import AT, Reader, Record, keyed, number, ref


@dataclass(frozen=True)
class Setting:
    """A value for every parameter whose path matches a pattern."""

    path: str
    node: Node
    position: Position


class Settings:
    """All settings from outside, in order of precedence: the last one that matches a parameter wins."""

    def __init__(self, settings: Iterable[Setting] = (), limits: Limits = NORMAL) -> None:
        self._all = list(settings)
        self._used: set[int] = set()
        # An overrides file may name thousands of paths.  Only patterns are tried one by one, and only if the path has
        # the name in the pattern that the fewest paths are likely to have.
        self._exact: dict[str, list[int]] = {}
        self._patterns: dict[str, list[int]] = {}
        self._comparisons = Comparisons(limits.comparisons)
        for place, setting in enumerate(self._all):
            if "*" in setting.path:
                asked = names_asked(setting.path)
                rare = next((name for name in asked if "[" in name and "*" not in name), asked[-1] if asked else "")
                self._patterns.setdefault(rare, []).append(place)
            else:
                self._exact.setdefault(setting.path, []).append(place)

    def find(self, full: str) -> Setting | None:
        """The setting for the parameter at this path; all that match are marked as used.  Raises ``TooManyError``."""
        found = self._exact.get(full, [])
        if self._patterns:
            likely = [number for name in ("", *names_of(full)) for number in self._patterns.get(name, ())]
            self._comparisons.spend(len(likely))
            found = found + [number for number in likely if matches(self._all[number].path, full)]
        self._used.update(found)
        return self._all[max(found)] if found else None

    @property
    def position(self) -> Position | None:
        """Where the first of the patterns is."""
        numbers = [number for each in self._patterns.values() for number in each]
        return self._all[min(numbers)].position if numbers else None

    def unused(self) -> list[Setting]:
        """The settings that no parameter has taken."""
        return [setting for number, setting in enumerate(self._all) if number not in self._used]


def read_overrides(path: Path, problems: Problems) -> list[Setting]:
    """The settings of a file: a mapping from paths or patterns to values, as ``--set`` takes them."""
    node = read(path, problems)
    if node is None:
        return []
    if not isinstance(node, Mapping):
        hint = "write lines like 'observer[*].sensor.range: 5 m'"
        problems.add(f"{path} is not a mapping from parameters to values", node.position, hint)
        return []
    return settings_in(node, problems)


def settings_like(example: str) -> Reader:
    """A mapping from paths or patterns to values; for anything else, ``example`` is the advice."""

    def read_settings(reader: NodeReader, node: Node, what: str) -> tuple[Setting, ...]:
        if isinstance(node, Mapping):
            return tuple(settings_in(node, reader.problems))
        if not is_empty(node):
            message = f"{what} is not a mapping from parameters to values"
            reader.problems.add(message, node.position, f"write lines like {example!r}")
        return ()

    return Reader({"type": ["object", "null"]}, read_settings)


def settings_in(node: Mapping, problems: Problems) -> list[Setting]:
    """The settings that a mapping from paths or patterns to values holds."""
    return [
        Setting(key, entry.value, entry.key.position)
        for key, entry in node.entries.items()
        if is_pattern(key, entry.key.position, problems)
    ]


def settings_of(
    given: Iterable[str | Setting] | AnyMapping[str, object], problems: Problems, flag: str = "--set"
) -> list[Setting]:
    """Settings as a call or a command gives them, the latter with a flag."""
    if not isinstance(given, AnyMapping):
        read = (parse_setting(each, problems, flag) if isinstance(each, str) else each for each in given)
        return [setting for setting in read if setting is not None]
    node = node_of(given, call_site())
    assert isinstance(node, Mapping)
    return settings_in(node, problems)


_ASSIGNED = r"[A-Za-z_][\w.*\[\]]*\s*=(?!=)"  # the beginning of a setting
_BEGUN = re.compile(rf"\s*{_ASSIGNED}")
_NUMBER_AND_MORE = re.compile(rf"[^=]*=\s*[-+]?\.?\d\S*(?:\s[^\"']*)?\s{_ASSIGNED}")


def parse_settings(text: str, problems: Problems, flag: str) -> list[Setting]:
    """``path=value,path=value,...``; a comma in brackets or quotes, or before anything else, belongs to the value."""
    parts: list[str] = []
    for start, end in split(text, ","):
        part = text[start:end]
        if parts and (_BEGUN.match(part) is None or parts[-1].count('"') % 2 or parts[-1].count("'") % 2):
            parts[-1] += f",{part}"
        else:
            parts.append(part)
    found = []
    for part in map(str.strip, parts):
        if _NUMBER_AND_MORE.match(part):
            message = f"{part!r} sets more than one parameter without a comma between them"
            problems.add(message, in_option(f"{flag} {text}", len(flag) + 1), "write load=0.9,servers=2")
        else:
            found.append(parse_setting(part, problems, flag))
    return [setting for setting in found if setting is not None]


def is_pattern(path: str, position: Position, problems: Problems) -> bool:
    """Whether a text names parameters, singly or by a pattern; if not, that is reported."""
    try:
        check_pattern(path)
    except PatternError as error:
        problems.add(f"{path!r} is not a parameter path: {error}", position)
        return False
    return True


def parse_setting(text: str, problems: Problems, flag: str = "--set") -> Setting | None:
    """``path=value``, where value is a YAML value such as ``3``, ``5 m`` or ``[0, 1]``; the ``flag`` stands before."""
    option = f"{flag} {text}"
    position = in_option(option, len(flag) + 1)
    path, equals, value = text.partition("=")
    path = path.strip()
    if not equals or not path:
        problems.add(f"{text!r} is not of the form path=value", position)
        return None
    if not is_pattern(path, position, problems):
        return None
    node = value_in(value, option, len(option) - len(value), problems)
    return None if node is None else Setting(path, node, position)


def in_option(option: str, start: int, length: int | None = None) -> Position:
    """A place on the command line: the part of an option from ``start`` on."""
    return Position(COMMAND_LINE, 1, start + 1, max(1, len(option) - start if length is None else length), option)


def value_in(text: str, option: str, offset: int, problems: Problems) -> Node | None:
    """The YAML value in an option from ``offset`` on."""
    if not text.strip():
        return Scalar(None, "", True, in_option(option, 0))
    if len(option.splitlines()) > 1:  # lines and columns then count within the value
        return parse(text, COMMAND_LINE, problems)
    return parse(" " * offset + text, COMMAND_LINE, problems, option)


@dataclass(frozen=True)
class ActText:
    """A single act of an aspect: its place, and the number of the token there, counted from 1."""

    position: Position
    aspect: Text = keyed(AT, "The name of the aspect.", missing=("an act names no aspect", "add 'aspect: NAME'"))
    at: Text = keyed(
        AT, "Its place: a port, a connection or an actor.", missing=("an act names no place", "add 'at: PATH'")
    )
    token: int = keyed(
        number(int, 1),
        "The number of the token, or firing, that passes it there: 1 is the first.",
        missing=("an act names no token", "add 'token: 1' for the first"),
    )


ACT = Record.of(ActText, "A single act of an aspect.", type="object")


def acts(reader: NodeReader, node: Node, what: str) -> tuple[ActText, ...]:
    """A list of acts; those that are wrong are left out."""
    read = [(ACT.read(reader, each, f"an act of {what!r}"), each) for each in reader.items(node, what) or ()]
    return tuple(ActText(**said, position=each.position) for said, each in read if said and POISON not in said.values())


ACTS = Reader({"type": ["array", "null"], "items": ref("act")}, acts)
