"""Composite classes that a model does not use: unfolded on trial, with parameters of unknown value."""

from __future__ import annotations

from collections.abc import Collection

from epicycle.actors import counted

from ..graph.model_graph import ModelGraph
from ..language.models import CompositeText
from ..language.values import Locals, Values
from ..text.kinds import ODD
from ..text.limits import RAISE_IT, Limits
from ..text.problems import POISON
from .checks import check
from .instantiate import Instantiator, PartTypes, TooLargeError
from .resolve import ParameterResolver
from .weave_all import weave_all

_OVERHEAD = 3  # the cost of a class besides its contents, in actors


def try_classes(known: PartTypes, used: Collection[str], values: Values, limits: Limits) -> None:
    """Check what can be checked of every class without an instance in the model.

    All trials together may cost as much as a model of half the maximum size; a warning names what remains.
    """
    tried, problems = set(used), values.problems
    composites = {name: composite for name, composite in known.composites.items() if composite}
    inner = {
        part.type.text
        for composite in composites.values()
        for entry in (*composite.actors.values(), *composite.aspects.values())
        for part in (entry, *entry.choices.values())
    }
    most = left = limits.actors // 2
    untried: list[str] = []
    # Classes that no other contains come first; the others are then tried as their parts.
    for name in sorted(composites, key=lambda name: name in inner):
        if name in tried:
            continue
        is_whole = False
        if left > 0:
            resolver = ParameterResolver(problems, budget=values.budget)
            made = Instantiator(known, resolver, ModelGraph(limits), left)
            is_whole = _try(composites[name], made)
            left -= _OVERHEAD + made.cost + (made.graph.connections + made.places) // 5
            tried |= made.classes
        if not is_whole:
            untried.append(name)
    if untried:
        names = (
            f"{untried[0]} is" if len(untried) == 1 else f"{untried[0]} and {counted(len(untried) - 1, 'other')} are"
        )
        why = f"checking all such classes takes more than {most:,} actors and composites"
        message = f"{names} not fully checked: the model has no instance of such a class, and {why}"
        problems.warn(message, composites[untried[0]].position, RAISE_IT, kind=ODD)


def _try(composite: CompositeText, made: Instantiator) -> bool:
    """Unfold one instance of a class, with its name and nothing around it; returns whether all of it was checked."""
    path, values, graph = composite.name, made.resolver, made.graph
    names: dict[str, object] = {}
    for name, declared in composite.parameters.items():
        if declared.value is not None:
            local = Locals(path, {**names, "index": POISON}, list(composite.parameters))
            values.declared(declared, declared.value, local, f"{path}.{name}")
        # The default is one value of many: what is computed from it is not checked.
        names[name] = POISON
    names.setdefault("index", POISON)
    try:
        made.composite(path, composite, names, None)
    except TooLargeError:
        return False
    inputs, outputs = graph.borders(path)
    graph.fed.update(inputs, outputs)  # anything may be connected to them
    weave_all(made)
    check(graph, made.problems, whole=False)
    return True
