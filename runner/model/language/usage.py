"""Parameters that are declared but never used: usually a name is misspelled somewhere."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from epicycle.actors import Actor, declared_parameters, nearest
from epicycle.actors.expression import ExpressionError, names_in

from ..catalogue.types import CatalogueError
from ..text.document import Node, Scalar, Sequence
from ..text.kinds import UNUSED
from ..text.problems import POISON, Poison, Problems
from .models import CompositeText, ModelText
from .parts import PartText

ALL = "all"  # in place of the names of what a part inherits
_WORD = re.compile(r"[A-Za-z_]\w*")
_MAX_STRANGE = 50  # comparing names takes time


def check_usage(
    text: ModelText,
    declared: Mapping[str, CompositeText],
    composites: Mapping[str, CompositeText | Poison],
    actor_types: Mapping[str, type[Actor]],
    problems: Problems,
) -> None:
    """Add a problem for every parameter of the model or of a class that no expression uses.

    ``declared`` are the classes as written, ``composites`` with what they inherit.  What a class declares may be used
    by its bases, and by the classes that extend it.
    """
    whole = {name: composite for name, composite in composites.items() if composite}
    own = {name: used_names(whole.get(name, composite).written) for name, composite in declared.items()}
    used = dict(own)
    for name, composite in whole.items():
        base = composite.extends
        while base:
            used[base.text] = used[base.text] | own[name]
            used[name] = used[name] | own[base.text]
            base = whole[base.text].extends
    for name, composite in whole.items():
        _add_unused(composite, declared[name].parameters, used[name], whole, actor_types, problems)
    _add_unused(text.root, text.root.parameters, used_names(text.root.written), whole, actor_types, problems)


def check_own_usage(composite: CompositeText, problems: Problems) -> None:
    """Add a problem for every parameter that nothing in the same text uses, or takes by name."""
    if ALL not in (used := used_names(composite.written)):
        _add_unused(composite, composite.parameters, used, {}, {}, problems)


def _add_unused(
    composite: CompositeText,
    parameters: Iterable[str],
    used: frozenset[str | Poison],
    composites: Mapping[str, CompositeText],
    actor_types: Mapping[str, type[Actor]],
    problems: Problems,
) -> None:
    taken = (each.text for part in composite.actors.values() for each in part.inherit)  # by parts of unknown types
    if POISON in used or ALL in taken:  # perhaps by what is wrong
        return
    unused = [name for name in parameters if name not in used]
    strange = sorted(each for each in used if each and each not in composite.parameters)[:_MAX_STRANGE]
    misspelled = {nearest(each, unused) for each in strange}  # which is reported where they are
    for name in unused:
        if name in misspelled:
            continue
        meant = [
            actor
            for actor, part in composite.actors.items()
            if name not in part.values and name in _parameters(part, composites, actor_types)
        ]
        hints = [f"{actor} has a parameter {name!r}: write 'inherit: {name}' there" for actor in meant[:3]]
        problems.add(
            f"{composite.name}: nothing uses the parameter {name!r}",
            composite.parameters[name].position,
            *(hints or [f"write ${{{name}}} where its value belongs, or remove it"]),
            kind=UNUSED,
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


def used_names(nodes: Iterable[Node | Poison]) -> frozenset[str | Poison]:
    """The names that expressions use, at any depth; what is wrong with an expression is reported elsewhere."""
    found: set[str | Poison] = set()
    waiting = list(nodes)
    while waiting:
        node = waiting.pop()
        if node is POISON:
            found.add(POISON)
        elif isinstance(node, Scalar):
            if isinstance(node.value, str) and "${" in node.value:
                try:
                    found |= names_in(node.value)
                except ExpressionError:
                    found |= set(_WORD.findall(node.value))  # what it would use if it were right
        elif isinstance(node, Sequence):
            waiting += node.items
        else:
            waiting += (each.value for each in node.entries.values())
            if (taken := node.entries.get("inherit")) is not None:
                items = taken.value.items if isinstance(taken.value, Sequence) else (taken.value,)
                found |= {each.text for each in items if isinstance(each, Scalar)}
    return frozenset(found)
