"""Changes of a model as changes of its text: connections, parts, values, aspects; comments and order stay.

Each function takes a text that can be read and gives another one.  It is read again: what it holds must be what was
there, with the one thing changed that was meant, so no name and no value can bring in anything else.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from epicycle.actors import declared_parameters

from ..model.language.models import COMPOSITE, MODEL
from ..model.language.parts import BESIDE
from ..model.language.places import PORT_SCHEMA, connection
from ..model.text.document import parse
from ..model.text.problems import Problems
from ..model.text.reading import NAME, NAMES_HAVE, NodeReader
from . import parts
from .knowledge import Knowledge
from .names import MODEL as OF_MODEL
from .parts import EditError, Keys

_ENDS = re.compile(PORT_SCHEMA["pattern"])
_TYPE = re.compile(r"[A-Za-z_]\w*(?:[.:][A-Za-z_]\w*)*\Z")
_ORDER = tuple(dict.fromkeys((*("model", "doc", "extends", "include", "composites"), *MODEL.keys, *COMPOSITE.keys)))


# -- what can be done -------------------------------------------------------------------------------------------------


def connect(text: str, owner: str, source: str, target: str, delay: str = "") -> str:
    """Connect two ports of a class."""
    _check_ends(source, target)
    item: Any = f"{source} -> {target}"
    if delay:
        item = {"from": source, "to": target, "delay": _value_of(delay)}
    return _added(text, (*_keys(owner), "connections"), None, item)


def disconnect(text: str, owner: str, source: str, target: str) -> str:
    """Remove the connection of two ports of a class, which may be one of several that an item makes."""
    _check_ends(source, target)
    for number, (item, pairs) in enumerate(_connections(text, owner)):
        if (source, target) not in pairs:
            continue
        keys: Keys = (*_keys(owner), "connections", number)
        if len(pairs) == 1:
            return _without(text, keys)
        sources, targets = (list(dict.fromkeys(each)) for each in zip(*pairs, strict=True))
        if isinstance(item, str) and 1 in (len(sources), len(targets)):
            left = ", ".join(each for each in sources if len(sources) == 1 or each != source)
            right = ", ".join(each for each in targets if len(targets) == 1 or each != target)
            return set_value(text, keys, f"{left} {'=>' if '=>' in item else '->'} {right}", is_text=True)
        raise EditError(f"{item} connects more than {source} and {target}: change it by hand")
    raise EditError(f"there is no connection {source} -> {target} in this text")


def _connections(text: str, owner: str) -> Iterator[tuple[Any, list[tuple[str, str]]]]:
    """The items of a class's connections, each with the pairs of ends that it may connect."""
    for item in _found(parts.data_of(text), (*_keys(owner), "connections")) or ():
        problems = Problems()
        node = parse(parts.written(item), "", problems)
        read = None if node is None else connection(NodeReader(problems), node)
        ends = (read.sources, read.destinations) if read and not problems.found and not read.removes else ((), ())
        yield item, [(source.text, target.text) for source in ends[0] for target in ends[1]]


def add_part(text: str, owner: str, section: str, name: str, kind: str, values: Mapping[str, str]) -> str:
    """Add an actor or an aspect of a type, with values as somebody types them."""
    _check_name(name)
    _check_type(kind)
    for key in values:
        _check_name(key)
    keys = (*_keys(owner), section)
    if name in (_found(parts.data_of(text), keys) or {}):
        raise EditError(f"there is already {name!r} among the {section}")
    return _added(text, keys, name, {"type": kind, **{key: _value_of(each) for key, each in values.items()}})


def attach(text: str, owner: str, name: str, kind: str, at: str, values: Mapping[str, str] | None = None) -> str:
    """Attach an aspect at the places of a pattern."""
    return add_part(text, owner, "aspects", name, kind, {**(values or {}), "at": at})


def remove(text: str, owner: str, section: str, name: str) -> str:
    """Remove an actor, with its connections, or an aspect."""
    keys = (*_keys(owner), section)
    changed = _without(text, (*keys, name))
    if section != "actors":
        return changed
    is_end = re.compile(rf"\A{re.escape(name)}(?:\[.*\])?\.")
    # One at a time, because an item may make several.
    while ends := [pair for _, pairs in _connections(changed, owner) for pair in pairs if any(map(is_end.match, pair))]:
        changed = disconnect(changed, owner, *ends[0])
    return changed


def set_parameter(text: str, owner: str, section: str, name: str, parameter: str, said: str) -> str:
    """Give a parameter of a part, or one that the class declares (``section`` is parameters), a value, as typed."""
    keys: Keys = (*_keys(owner), section, name)
    if section == "parameters":
        is_mapping = isinstance(_found(parts.data_of(text), keys), dict)
        return set_value(text, (*keys, "value") if is_mapping else keys, said)
    _check_name(parameter)
    return set_value(text, (*keys, parameter), said)


def switch(text: str, owner: str, name: str, on: bool) -> str:
    """Switch an aspect of the text on or off; what it says stays."""
    keys = (*_keys(owner), "aspects", name)
    if not on:
        return set_value(text, (*keys, "enabled"), "false")
    if "enabled" not in (_found(parts.data_of(text), keys) or {}):
        return text
    return _without(text, (*keys, "enabled"))


def swap(text: str, knowledge: Knowledge, owner: str, name: str, kind: str) -> str:
    """Put an aspect of another type in the place of one; of its values, those remain that the other type takes."""
    _check_type(kind)
    keys = (*_keys(owner), "aspects", name)
    cls = knowledge.type_called(kind, "aspects")
    known = knowledge.composite_parameters(kind) if cls is None else declared_parameters(cls)
    changed = set_value(text, (*keys, "type"), kind)
    for key in _found(parts.data_of(changed), keys) or {}:
        if key not in known and key not in ("type", *BESIDE.keys):
            changed = _without(changed, (*keys, key))
    return changed


def drop_in(text: str, disturbance: str) -> str:
    """Write what a disturbance, which is the text of a file, adds and sets."""
    data = parts.data_of(disturbance)
    if _found(data, ("disturbance",)) is None or _found(data, ("composites",)):
        raise EditError("this is not a disturbance that consists of parameters, values and aspects only")
    for section in ("parameters", "aspects"):
        for name, value in (_found(data, (section,)) or {}).items():
            _check_name(name)
            if name in (_found(parts.data_of(text), (section,)) or {}):
                raise EditError(f"there is already {name!r} among the {section}")
            text = _added(text, (section,), name, value)
    for name, value in (_found(data, ("set",)) or {}).items():
        if not NAME.match(name):
            raise EditError(f"the disturbance sets {name}: write that by hand")
        text = set_parameter(text, OF_MODEL, "parameters", name, "", parts.written(value))
    return text


def set_value(text: str, keys: Keys, said: str, *, is_text: bool = False) -> str:
    """Write a value, as somebody types it, in the place of another, or behind the others if there is none."""
    before = parts.data_of(text)
    holder = _found({} if before is None else before, keys[:-1])
    if not isinstance(holder, (dict, list)):
        raise EditError(f"there is no {parts.path(keys[:-1])} in this text")
    if isinstance(holder, dict) and keys[-1] not in holder:
        return _added(text, keys[:-1], str(keys[-1]), _value_of(said))
    data, error = said if is_text else _value_of(said), EditError("")

    def act(items: Any) -> None:
        items[keys[-1]] = data

    # Without quotes, if that means the same at this place.
    for value in (
        (said, parts.written(said), parts.quoted(said)) if is_text else (parts.typed(said), parts.quoted(said))
    ):
        try:
            return _checked(text, parts.put(text, keys, value), keys[:-1], act)
        except EditError as refused:
            error = refused
    raise error


# -- checks -----------------------------------------------------------------------------------------------------------


def _added(text: str, keys: Keys, key: str | None, value: Any) -> str:
    """The text with an entry or item behind the others."""

    def act(items: Any) -> None:
        if key is None:
            items.append(value)
        else:
            items[key] = value

    data = parts.data_of(text)
    for number in range(len(keys)):
        if number and not isinstance(_found(data, keys[:number]), dict):
            raise EditError(f"there is no {parts.path(keys[:number])} in this text")
    return _checked(text, parts.add(text, keys, key, value, _ORDER), keys, act, makes=[] if key is None else {})


def _checked(
    text: str, changed: str, keys: Keys, act: Callable[[Any], object], missing: str = "", makes: Any = None
) -> str:
    """The changed text, if it holds what the other one holds after an act at the end of some keys."""
    expected = copy.deepcopy(parts.data_of(text))
    expected = {} if expected is None else expected
    holder = expected
    for number, key in enumerate(keys):
        inner = _found(holder, (key,))
        if inner is None and makes is not None:
            inner = makes if number == len(keys) - 1 else {}
            holder[key] = inner
        holder = inner
    try:
        act(holder)
    except (KeyError, IndexError, TypeError, AttributeError):
        raise EditError(f"there is {missing or f'no {parts.path(keys)}'} in this text") from None
    if _canonical(expected) != _canonical(parts.data_of(changed)):
        raise EditError("this text is written in a way that no program can change here: change it by hand")
    return changed


def _canonical(data: Any) -> str:
    """Data as text: true is not 1, entries have no order, and an empty section is none."""
    if isinstance(data, dict):
        kept = (each for each in data.items() if each[0] not in parts.SECTIONS or each[1] not in (None, {}, []))
        return "{" + ", ".join(sorted(f"{key!r}: {_canonical(value)}" for key, value in kept)) + "}"
    return f"[{', '.join(map(_canonical, data))}]" if isinstance(data, list) else repr(data)


def _without(text: str, keys: Keys) -> str:
    """The text without an entry or item."""
    parts.data_of(text)  # says so if it cannot be read
    return _checked(
        text, parts.delete(text, keys), keys[:-1], lambda items: items.pop(keys[-1]), f"no {parts.path(keys)}"
    )


def _found(data: Any, keys: Keys) -> Any:
    for key in keys:
        if isinstance(data, dict):
            data = data.get(key)
        elif isinstance(data, list) and isinstance(key, int) and key < len(data):
            data = data[key]
        else:
            return None
    return data


def _keys(owner: str) -> Keys:
    return () if owner == OF_MODEL else ("composites", owner)


def _read_value(value: str) -> Any:
    return parts.data_of(f"[{value}]")[0]


def _value_of(said: str) -> Any:
    return _read_value(parts.typed(said))


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
