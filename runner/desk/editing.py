"""Changes of a model as changes of its text: connections, parts, values, aspects; comments and order stay.

Each function takes a text that can be read and gives another one.  It changes what the text holds, as data, which are
then written into the text; so no name and no value can bring in anything else.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import wraps
from typing import Any, Concatenate, ParamSpec

from ..model.language.parts import BESIDE
from ..model.language.places import PORT_SCHEMA, connection
from ..model.text.document import parse
from ..model.text.problems import Problems
from ..model.text.reading import NAME, NAMES_HAVE, NodeReader
from .knowledge import Knowledge
from .names import MODEL
from .parts import EditError, Keys, data_of, path, rendered, typed, written

_ENDS = re.compile(PORT_SCHEMA["pattern"])
_TYPE = re.compile(r"[A-Za-z_]\w*(?:[.:][A-Za-z_]\w*)*\Z")
_P = ParamSpec("_P")


def _of_text(act: Callable[Concatenate[Any, _P], None]) -> Callable[Concatenate[str, _P], str]:
    """A change of a text, by what changes the data that it holds."""

    @wraps(act)
    def change(text: str, /, *given: _P.args, **named: _P.kwargs) -> str:
        data = data_of(text)
        act(data, *given, **named)
        return rendered(text, data)

    return change


# -- what can be done -------------------------------------------------------------------------------------------------


@_of_text
def connect(data: Any, owner: str, source: str, target: str, delay: str = "") -> None:
    """Connect two ports of a class."""
    _check_ends(source, target)
    item = {"from": source, "to": target, "delay": typed(delay)} if delay else f"{source} -> {target}"
    _section(data, owner, "connections", []).append(item)


@_of_text
def disconnect(data: Any, owner: str, source: str, target: str) -> None:
    """Remove the connection of two ports of a class, which may be one of several that an item makes."""
    _check_ends(source, target)
    _disconnect(_section(data, owner, "connections", []), source, target)


def _disconnect(items: list[Any], source: str, target: str) -> None:
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


@_of_text
def add_part(data: Any, owner: str, section: str, name: str, kind: str, values: Mapping[str, str]) -> None:
    """Add an actor or an aspect of a type, with values as somebody types them."""
    _check_type(kind)
    _add(data, owner, section, name, {"type": kind, **{key: typed(each) for key, each in values.items()}})
    for key in values:
        _check_name(key)


@_of_text
def remove(data: Any, owner: str, section: str, name: str) -> None:
    """Remove an actor, with its connections, or an aspect."""
    keys = _keys(owner)
    parts = _found(data, (*keys, section))
    if not isinstance(parts, dict) or name not in parts:
        raise EditError(f"there is no {path(*keys, section, name)} in this text")
    del parts[name]
    items = _found(data, (*keys, "connections")) or []
    is_end = re.compile(rf"\A{re.escape(name)}(?:\[.*\])?\.")
    # One at a time, because an item may make several.
    while section == "actors" and (
        ends := [pair for _, pairs in _connections(items) for pair in pairs if any(map(is_end.match, pair))]
    ):
        _disconnect(items, *ends[0])


@_of_text
def set_parameter(data: Any, owner: str, section: str, name: str, parameter: str, said: str) -> None:
    """Give a parameter of a part, or one that the class declares (``section`` is parameters), a value, as typed."""
    keys = (*_keys(owner), section, name)
    if section == "parameters":
        _set_declared(data, keys, typed(said))
    else:
        _check_name(parameter)
        _set(data, (*keys, parameter), typed(said))


@_of_text
def switch(data: Any, owner: str, name: str, on: bool) -> None:
    """Switch an aspect of the text on or off; what it says stays."""
    keys = (*_keys(owner), "aspects", name)
    if on:
        (_found(data, keys) or {}).pop("enabled", None)
    else:
        _set(data, (*keys, "enabled"), False)


@_of_text
def swap(data: Any, knowledge: Knowledge, owner: str, name: str, kind: str) -> None:
    """Put an aspect of another type in the place of one; of its values, those remain that the other type takes."""
    _check_type(kind)
    known = knowledge.parameters_of(kind, "aspects")
    part = _set(data, (*_keys(owner), "aspects", name, "type"), kind)
    for key in [each for each in part if each not in known and each not in ("type", *BESIDE.keys)]:
        del part[key]


@_of_text
def drop_in(data: Any, disturbance: str) -> None:
    """Write what a disturbance, which is the text of a file, adds and sets."""
    given = data_of(disturbance)
    if _found(given, ("disturbance",)) is None or _found(given, ("composites",)):
        raise EditError("this is not a disturbance that consists of parameters, values and aspects only")
    for section in ("parameters", "aspects"):
        for name, value in (_found(given, (section,)) or {}).items():
            _add(data, MODEL, section, name, value)
    for name, value in (_found(given, ("set",)) or {}).items():
        if not NAME.match(name):
            raise EditError(f"the disturbance sets {name}: write that by hand")
        _set_declared(data, ("parameters", name), value)


CHANGES: Mapping[str, Callable[..., str]] = {
    each.__name__: each for each in (connect, disconnect, add_part, remove, set_parameter, switch, swap, drop_in)
}


# -- data -------------------------------------------------------------------------------------------------------------


def _set(data: Any, keys: Keys, value: Any) -> Any:
    """Set a value at the end of some keys; what it is in is the answer."""
    holder = _holder(data, keys[:-1])
    holder[keys[-1]] = value
    return holder


def _set_declared(data: Any, keys: Keys, value: Any) -> None:
    """Give a parameter that a class declares a value."""
    _set(data, (*keys, "value") if isinstance(_found(data, keys), dict) else keys, value)


def _section(data: Any, owner: str, section: str, empty: Any) -> Any:
    """A section of a class, which is made if it is missing."""
    holder = _holder(data, _keys(owner))
    if holder.get(section) is None:
        holder[section] = empty
    if not isinstance(holder[section], type(empty)):
        kind = "list" if isinstance(empty, list) else "mapping"
        raise EditError(f"{path(*_keys(owner), section)} is no {kind}: change it by hand")
    return holder[section]


def _holder(data: Any, keys: Keys) -> Any:
    """The mapping at the end of some keys."""
    for number in range(len(keys) + 1):
        if not isinstance(_found(data, keys[:number]), dict):
            raise EditError(f"there is no {path(*keys[:number])} in this text")
    return _found(data, keys)


def _add(data: Any, owner: str, section: str, name: str, value: Any) -> None:
    _check_name(name)
    if name in (parts := _section(data, owner, section, {})):
        raise EditError(f"there is already {name!r} among the {section}")
    parts[name] = value


def _found(data: Any, keys: Keys) -> Any:
    for key in keys:
        data = data.get(key) if isinstance(data, dict) else None
    return data


def _keys(owner: str) -> Keys:
    return () if owner == MODEL else ("composites", owner)


def _check_name(name: str) -> None:
    if not NAME.match(name):
        raise EditError(f"{name!r} is not a name: {NAMES_HAVE}")


def _check_type(kind: str) -> None:
    if not _TYPE.match(kind):
        raise EditError(f"{kind!r} is not the name of a type")


def _check_ends(*ends: str) -> None:
    for each in ends:
        if not _ENDS.match(each) or "\n" in each:
            raise EditError(f"{each!r} is not a port: write actor.port, or a port of the composite")
