"""Changes of a model as changes of its text: connections, parts, values, aspects; comments and order stay.

What a text holds is changed, as data, which are then written into the text; so no name and no value can bring in
anything else.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from ..model.language.parts import BESIDE
from ..model.language.places import PORT_SCHEMA, connection
from ..model.text.document import parse
from ..model.text.problems import Problems
from ..model.text.reading import NAME, NAMES_HAVE, NodeReader
from .knowledge import Knowledge
from .names import MODEL
from .parts import EditError, data_of, path, rendered, typed, written

# What something may be, and how that is said.
_NAME = NAME, f"a name: {NAMES_HAVE}"
_TYPE = re.compile(r"[A-Za-z_]\w*(?:[.:][A-Za-z_]\w*)*"), "the name of a type"
_END = re.compile(PORT_SCHEMA["pattern"]), "a port: write actor.port, or a port of the composite"


def change(text: str, what: str, owner: str, *given: Any) -> str:
    """The text after one of ``CHANGES`` of a class; raises ``EditError``."""
    data = data_of(text)
    CHANGES[what](data if owner == MODEL else _mapping(data, "composites", owner), *given)
    return rendered(text, data)


# -- what can be done, to the data of a class --------------------------------------------------------------------------


def connect(data: Any, source: str, target: str) -> None:
    """Connect two ports."""
    _check(_END, source, target)
    _section(data, "connections", []).append(f"{source} -> {target}")


def disconnect(data: Any, source: str, target: str) -> None:
    """Remove the connection of two ports, which may be one of several that an item makes."""
    _check(_END, source, target)
    items = _section(data, "connections", [])
    for number, (item, pairs) in enumerate(_connections(items)):
        if (source, target) not in pairs:
            continue
        if len(pairs) == 1:
            del items[number]
            return
        sources, targets = (list(dict.fromkeys(each)) for each in zip(*pairs, strict=True))
        if isinstance(item, str) and 1 in (len(sources), len(targets)):
            left = ", ".join(each for each in sources if len(sources) == 1 or each != source)
            right = ", ".join(each for each in targets if len(targets) == 1 or each != target)
            items[number] = f"{left} {'=>' if '=>' in item else '->'} {right}"
            return
        raise EditError(f"{item} connects more than {source} and {target}: change it by hand")
    raise EditError(f"there is no connection {source} -> {target} in this text")


def _connections(items: list[Any]) -> Iterator[tuple[Any, list[tuple[str, str]]]]:
    """The items of a class's connections, each with the pairs of ends that it may connect."""
    for item in items:
        problems = Problems()
        node = parse(written(item), "", problems)
        read = None if node is None else connection(NodeReader(problems), node)
        ends = (read.sources, read.destinations) if read and not problems.found and not read.removes else ((), ())
        yield item, [(source.text, target.text) for source in ends[0] for target in ends[1]]


def add_part(data: Any, section: str, name: str, kind: str, values: Mapping[str, str]) -> None:
    """Add an actor or an aspect of a type, with values as somebody types them."""
    _check(_TYPE, kind)
    _add(data, section, name, {"type": kind, **{key: typed(each) for key, each in values.items()}})
    for key in values:
        _check(_NAME, key)


def remove(data: Any, section: str, name: str) -> None:
    """Remove an actor, with its connections, or an aspect."""
    if name not in (parts := _section(data, section, {})):
        raise EditError(f"there is no {path(section, name)} in this text")
    del parts[name]
    if section == "actors":
        is_end = re.compile(rf"\A{re.escape(name)}(?:\[.*\])?\.")
        ends = [pair for _, pairs in _connections(_section(data, "connections", [])) for pair in pairs]
        for pair in ends:
            if any(map(is_end.match, pair)):
                disconnect(data, *pair)


def set_parameter(data: Any, section: str, name: str, parameter: str, said: str) -> None:
    """Give a parameter of a part, or one that the class declares (``section`` is parameters), a value, as typed."""
    if section == "parameters":
        _set_declared(data, name, typed(said))
    else:
        _check(_NAME, parameter)
        _mapping(data, section, name)[parameter] = typed(said)


def switch(data: Any, name: str, on: bool) -> None:
    """Switch an aspect of the text on or off; what it says stays."""
    part = _mapping(data, "aspects", name)
    part.pop("enabled", None)
    if not on:
        part["enabled"] = False


def swap(data: Any, name: str, kind: str, knowledge: Knowledge) -> None:
    """Put an aspect of another type in the place of one; of its values, those remain that the other type takes."""
    _check(_TYPE, kind)
    known = knowledge.parameters_of(kind, "aspects")
    part = _mapping(data, "aspects", name)
    part["type"] = kind
    for key in [each for each in part if each not in known and each not in ("type", *BESIDE.keys)]:
        del part[key]


def drop_in(data: Any, disturbance: str) -> None:
    """Write what a disturbance, which is the text of a file, adds and sets."""
    given = data_of(disturbance)
    if not isinstance(given, dict) or given.get("disturbance") is None or given.get("composites"):
        raise EditError("this is not a disturbance that consists of parameters, values and aspects only")
    for section in ("parameters", "aspects"):
        for name, value in _section(given, section, {}).items():
            _add(data, section, name, value)
    for name, value in _section(given, "set", {}).items():
        if not NAME.match(name):
            raise EditError(f"the disturbance sets {name}: write that by hand")
        _set_declared(data, name, value)


CHANGES: Mapping[str, Callable[..., None]] = {
    each.__name__: each for each in (connect, disconnect, add_part, remove, set_parameter, switch, swap, drop_in)
}


# -- data -------------------------------------------------------------------------------------------------------------


def _set_declared(data: Any, name: str, value: Any) -> None:
    """Give a parameter that a class declares a value."""
    declared = _section(data, "parameters", {})
    if isinstance(declared.get(name), dict):
        declared[name]["value"] = value
    else:
        declared[name] = value


def _section(data: Any, section: str, empty: Any) -> Any:
    """A section of a class, which is made if it is missing."""
    if data.get(section) is None:
        data[section] = empty
    if not isinstance(data[section], type(empty)):
        raise EditError(f"{section} is no {'list' if isinstance(empty, list) else 'mapping'}: change it by hand")
    return data[section]


def _mapping(data: Any, *keys: str) -> Any:
    """The mapping at the end of some keys."""
    for key in keys:
        data = data.get(key) if isinstance(data, dict) else None
    if not isinstance(data, dict):
        raise EditError(f"there is no {path(*keys)} in this text")
    return data


def _add(data: Any, section: str, name: str, value: Any) -> None:
    _check(_NAME, name)
    if name in (parts := _section(data, section, {})):
        raise EditError(f"there is already {name!r} among the {section}")
    parts[name] = value


def _check(kind: tuple[re.Pattern[str], str], *texts: str) -> None:
    pattern, said = kind
    for each in texts:
        if not pattern.fullmatch(each):
            raise EditError(f"{each!r} is not {said}")
