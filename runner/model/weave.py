"""From aspect declarations to aspects that stand at ports."""

from __future__ import annotations

from dataclasses import dataclass

from epicycle.aspects import Aspect

from .graph import ModelGraph
from .patterns import PathIndex, PatternError
from .problems import Problems, nearest
from .reading import Text


@dataclass
class WovenAspect:
    """An aspect of a model and the ports at which it stands, in the graph's order."""

    name: str
    aspect: Aspect
    ports: list[str]


def select_ports(
    graph: ModelGraph,
    ports: PathIndex,
    name: str,
    aspect: type[Aspect],
    scope: str,
    pointcuts: list[Text],
    problems: Problems,
) -> list[str]:
    """The ports that the pointcuts of an aspect select; a pointcut that selects none is a problem.

    ``ports`` is the index of all ports; ``scope`` is the composite in which the aspect is declared, whose inside its
    pointcuts are relative to.
    """
    chosen: dict[str, None] = {}
    for pointcut in pointcuts:
        full = f"{scope}.{pointcut.text}" if scope else pointcut.text
        try:
            found = ports.select(full)
        except PatternError as error:
            problems.add(f"aspect {name}: {pointcut.text!r} is no pointcut: {error}", pointcut.position, scope=scope)
            continue
        fitting = [port for port in found if graph.direction(port) in aspect.stands_at]
        if not found and not graph.is_excused(full):
            close = nearest(full, [path for path in ports if graph.direction(path) in aspect.stands_at])
            problems.add(
                f"aspect {name}: {pointcut.text!r} matches no port" + (f", did you mean {close!r}?" if close else ""),
                pointcut.position,
                _valid_ends(full, ports),
                scope=scope,
            )
        elif found and not fitting:
            problems.add(
                f"aspect {name}: {aspect.__name__} stands at {' or '.join(sorted(aspect.stands_at))} ports, "
                f"but {found[0]} is an {graph.direction(found[0])} port",
                pointcut.position,
                scope=scope,
            )
        chosen.update(dict.fromkeys(fitting))
    return ports.in_order(chosen)


def _valid_ends(pattern: str, ports: PathIndex) -> str:
    """Port names that exist at the pattern's depth, to choose from."""
    depth = pattern.count(".")
    ends = sorted({path.rpartition(".")[2] for path in ports if path.count(".") == depth})
    return f"ports at this depth: {', '.join(ends)}" if ends else "no port has so many dots"
