"""Parameters that are declared but never used: usually a name is misspelled somewhere."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from epicycle.actors import Actor, declared_parameters
from epicycle.actors.expression import ExpressionError, names_in

from ..catalogue import CatalogueError
from ..text import Entry, Node, Position, Problems, Scalar, Sequence, Text, nearest
from ..text import Mapping as MappingNode
from .declarations import CompositeText, ModelText, PartText

_WORD = re.compile(r"[A-Za-z_]\w*")
_MAX_STRANGE = 50  # comparing names takes time


def check_usage(
    text: ModelText,
    declared: Mapping[str, CompositeText],
    composites: Mapping[str, CompositeText],
    actor_types: Mapping[str, type[Actor]],
    problems: Problems,
) -> None:
    """Add a problem for every parameter of the model or of a class that no expression uses.

    ``declared`` are the classes as written, ``composites`` with what they inherit.  What a base declares may be used
    by the classes that extend it.
    """
    used = {name: _names(_nodes(composite)) for name, composite in composites.items()}
    # Up the order of inheritance: what a class uses counts for its base, and for the base of that.
    for name in composites:
        base = composites[name].extends
        while base is not None and base.text in composites:
            used[base.text] = used[base.text] | used[name]
            base = composites[base.text].extends
    for name, composite in composites.items():
        if not composite.spoilt:
            _add_unused(composite, declared[name].parameters, used[name], composites, actor_types, problems)
    if not text.root.spoilt:
        names = _names(_nodes((text.root, text.run, text.metrics, text.monitors, text.figures)))
        _add_unused(text.root, text.root.parameters, names, composites, actor_types, problems)


def check_own_usage(composite: CompositeText, problems: Problems) -> None:
    """Add a problem for every parameter that nothing in the same text uses."""
    _add_unused(composite, composite.parameters, _names(_nodes(composite)), {}, {}, problems)


def _add_unused(
    composite: CompositeText,
    parameters: Iterable[str],
    used: frozenset[str],
    composites: Mapping[str, CompositeText],
    actor_types: Mapping[str, type[Actor]],
    problems: Problems,
) -> None:
    unused = [name for name in parameters if name not in used]
    strange = sorted(used - composite.parameters.keys())[:_MAX_STRANGE]
    misspelled = {nearest(each, unused) for each in strange}  # which is reported where they are
    for name in unused:
        if name in misspelled:
            continue
        meant = [
            actor
            for actor, part in composite.actors.items()
            if name not in part.values and name in _parameters(part, composites, actor_types)
        ]
        hints = [f"{actor} has a parameter {name!r}: write '{name}: ${{{name}}}' there" for actor in meant[:3]]
        problems.add(
            f"{composite.name}: nothing uses the parameter {name!r}",
            composite.parameters[name].position,
            *(hints or [f"write ${{{name}}} where its value belongs, or remove it"]),
        )


def _parameters(
    part: PartText, composites: Mapping[str, CompositeText], actor_types: Mapping[str, type[Actor]]
) -> Iterable[str]:
    if part.type.text in composites:
        return composites[part.type.text].parameters
    try:
        return declared_parameters(actor_types[part.type.text])
    except (KeyError, CatalogueError):
        return ()


def _nodes(part: object) -> Iterator[Node]:
    """Every node of the declarations that may contain an expression."""
    waiting = [part]
    while waiting:  # by class, not by pattern: a model may have a hundred thousand parts
        each: Any = waiting.pop()
        kind = type(each)
        if kind in (Scalar, Sequence, MappingNode):
            yield each
        elif kind is Text:
            if "${" in each.text:
                yield Scalar(each.text, each.text, True, each.position)
        elif kind is Entry:
            yield each.value
        elif kind is tuple:
            waiting += each
        elif kind is dict:
            waiting += each.values()
        elif kind is not Position:
            waiting += (getattr(each, name) for name in getattr(kind, "__dataclass_fields__", ()))


def _names(nodes: Iterable[Node]) -> frozenset[str]:
    """The names that expressions use, at any depth; what is wrong with an expression is reported elsewhere."""
    found: set[str] = set()
    waiting = list(nodes)
    while waiting:
        node = waiting.pop()
        if isinstance(node, Scalar):
            if isinstance(node.value, str) and "${" in node.value:
                try:
                    found |= names_in(node.value)
                except ExpressionError:
                    found |= set(_WORD.findall(node.value))  # what it would use if it were right
        else:
            waiting += node.items if isinstance(node, Sequence) else (each.value for each in node.entries.values())
    return frozenset(found)
