"""Execution times by input port: whether the actors that they are for have such ports."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from epicycle.actors import declared_parameters
from epicycle.aspects import ByActorParameter, FiringTime, FiringTimeParameter

from ..graph import ModelGraph, WovenAspect
from ..text import did_you_mean

Found = tuple[str, tuple[str, ...], str]  # what is wrong, the keys that lead there, and advice


def unknown_inputs(woven: WovenAspect, graph: ModelGraph) -> Iterator[Found]:
    """Ports that an aspect's parameters name, and no actor has that these are for."""
    for name, parameter in declared_parameters(type(woven.aspect)).items():
        value = getattr(woven.aspect, name)
        if isinstance(parameter, FiringTimeParameter):
            yield from without_port((name,), value, woven.actors, graph)
        elif isinstance(parameter, ByActorParameter) and isinstance(parameter.item, FiringTimeParameter):
            for pattern, each in value.items():
                chosen = {pattern: woven.selections[name].get(pattern, ())}
                actors = [path for path in woven.actors if ByActorParameter.of({pattern: True}, chosen, path)]
                yield from without_port((name, pattern), each, actors, graph)


def without_port(keys: tuple[str, ...], times: FiringTime, actors: Iterable[str], graph: ModelGraph) -> Iterator[Found]:
    """The ports in execution times that none of these actors has."""
    inputs = dict.fromkeys(port for path in actors for port in graph.actors[path].inputs)
    for port in times if isinstance(times, Mapping) and inputs else ():
        if port not in inputs:
            yield (
                f"{': '.join(keys)}: no actor that this is for has an input {port!r}{did_you_mean(port, inputs)}",
                (*keys, port),
                f"their inputs: {', '.join(inputs)}",
            )
