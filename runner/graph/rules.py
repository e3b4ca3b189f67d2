"""Rules: the choices of a director."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from epicycle.actors import Parameter

Ties: TypeAlias = Literal["declared", "posted"]
Like: TypeAlias = Literal["epicycle", "ptolemy"]
POSTED, PTOLEMY = "posted", "ptolemy"
TIES: Parameter[str | None] = Parameter(
    str,
    None,
    choices=get_args(Ties),
    doc="the order in which actors with the same tag, depth and priority fire: as they are declared, or as their "
    "tokens and wake-ups were posted",
)
LIKE: Parameter[str | None] = Parameter(
    str,
    None,
    choices=get_args(Like),
    doc="whose rules and defaults apply inside; ptolemy: ties are posted, the outputs of a composite with a director "
    "depend on all its inputs, and parameters and ports are as in Ptolemy II unless given",
)


@dataclass(frozen=True)
class Rules:
    """The order of actors that could fire in any order, and whose rules and defaults apply."""

    ties: str = "declared"
    like: str = "epicycle"

    def inside(self, ties: str | None, like: str | None) -> Rules:
        """The rules of a director within, which are these unless it overrides them; ``like`` determines the ties."""
        if ties is None:
            ties = self.ties if like is None else POSTED if like == PTOLEMY else "declared"
        return Rules(ties, like or self.like)

    @property
    def are_posted(self) -> bool:
        """Whether what was posted first fires first."""
        return self.ties == POSTED

    @property
    def are_ptolemys(self) -> bool:
        """Whether Ptolemy's rules apply."""
        return self.like == PTOLEMY
