"""How large a model may be before it counts as a mistake."""

from __future__ import annotations

from dataclasses import dataclass

MAX_SEED = 2**63 - 1


class _ForEachActor:
    """A limit of so many for each actor that there may be."""

    def __init__(self, number: int) -> None:
        self.number = number

    def __get__(self, limits: Limits, _: type[Limits]) -> int:
        return self.number * limits.actors


@dataclass(frozen=True)
class Limits:
    """``actors`` counts composites as well.

    A model as large as this loads in seconds and takes about 200 MB.  A slip of the pen that asks for a million is
    refused before it has filled the memory; who wants a million says so.
    """

    actors: int = 20_000

    connections = _ForEachActor(5)
    wires = _ForEachActor(10)  # ways from actor to actor, through composites
    watched = _ForEachActor(10)  # ports from which metrics take their numbers, a port counted for each metric
    comparisons = _ForEachActor(250)  # of patterns with paths, once these have been chosen by the names in them
    inherited = _ForEachActor(
        5
    )  # actors, aspects, connections, ports and parameters that classes take over from others
    places = _ForEachActor(5)  # ports and actors at which aspects stand
    tokens = _ForEachActor(10)  # and acts of aspects at one tag of a run
    times = _ForEachActor(50)  # at which something is still to come in a run


NORMAL = Limits()
RAISE_IT = "if it is to be so large, say so: --max-actors N, or load_model(..., max_actors=N)"
