"""The size at which a model counts as a mistake."""

from __future__ import annotations

from dataclasses import dataclass

MAX_SEED = 2**63 - 1


class _ForEachActor:
    """A limit proportional to the limit of actors."""

    def __init__(self, number: int) -> None:
        self.number = number

    def __get__(self, limits: Limits, _: type[Limits]) -> int:
        return self.number * limits.actors


@dataclass(frozen=True)
class Limits:
    """``actors`` counts composites as well.

    A model as large as this loads in seconds and takes about 200 MB.  A typing error that asks for a million is refused
    before it fills the memory; a million must be requested explicitly.
    """

    actors: int = 20_000

    connections = _ForEachActor(5)
    wires = _ForEachActor(10)  # paths from actor to actor, through composites
    watched = _ForEachActor(10)  # ports from which metrics take their numbers, a port counted for each metric
    comparisons = _ForEachActor(250)  # of patterns with paths, after a preselection by the names in them
    inherited = _ForEachActor(5)  # actors, aspects, connections, ports and parameters that classes inherit
    places = _ForEachActor(5)  # ports and actors that aspects attach to
    tokens = _ForEachActor(10)  # and acts of aspects at one tag of a run
    times = _ForEachActor(50)  # times at which something is pending in a run


NORMAL = Limits()
RAISE_IT = "if this is intended, raise the limit: --max-actors N, or load_model(..., max_actors=N)"
