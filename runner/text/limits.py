"""How large a model may be before it is taken for a mistake."""

from __future__ import annotations

from dataclasses import dataclass

MAX_SEED = 2**63 - 1


@dataclass(frozen=True, slots=True)
class Limits:
    """``actors`` counts composites as well; of connections, and of places where aspects stand, five for each will do.

    A model as large as this loads in seconds and takes about 200 MB.  A slip of the pen that asks for a million is told
    before it has filled the memory; who wants a million says so.
    """

    actors: int = 20_000

    @property
    def connections(self) -> int:
        """How many there may be."""
        return 5 * self.actors

    @property
    def wires(self) -> int:
        """How many ways there may be from actor to actor, through composites."""
        return 10 * self.actors

    @property
    def watched(self) -> int:
        """From how many ports metrics may take their numbers, a port counted for each metric."""
        return 10 * self.actors

    @property
    def comparisons(self) -> int:
        """With how many paths patterns may be compared, once they have been chosen by the names in them."""
        return 250 * self.actors

    @property
    def tokens(self) -> int:
        """How many tokens and acts of aspects one tag may hold in a run."""
        return 10 * self.actors

    @property
    def times(self) -> int:
        """At how many times something may still be to come in a run."""
        return 50 * self.actors

    @property
    def inherited(self) -> int:
        """How many actors, aspects, connections, ports and parameters classes may take over from others."""
        return 5 * self.actors

    @property
    def places(self) -> int:
        """At how many ports and actors aspects may stand."""
        return 5 * self.actors


NORMAL = Limits()
RAISE_IT = "if it is to be so large, say so: --max-actors N, or load_model(..., max_actors=N)"
