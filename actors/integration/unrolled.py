"""A step of a Runge-Kutta method as Python functions, for a few states whose derivatives are known as texts.

They compute what ``RungeKutta`` does, in the same order and so to the same bits, but on the way from stage to stage
they call nothing and make no lists.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from .runge_kutta import Stage, Tableau, Weights

_MOST_STATES: Final = 8
_MOST_TEXT: Final = 2_000  # characters of all derivatives, which are written once for each stage


def unrolled(tableau: Tableau, rates: Sequence[str], times: int, held: int) -> str:
    """The text of ``attempt`` and ``dense``; empty if there is too much of it.

    The derivatives are over ``v0``, ``v1``, ...: some times, the states, and what is held.  A time is one of
    ``origins``, and ``fraction`` plus the time of the solution.  ``attempt`` gives the derivatives at the stages, the
    last state, and the norms of the errors; ``dense`` the rows of the polynomial.  They give None where a derivative
    raises one of ``UNDECIDED``.
    """
    if len(rates) > _MOST_STATES or len("".join(rates)) > _MOST_TEXT:
        return ""
    writer = _Writer(rates, times, held)
    late = 1 + len(tableau.stages)
    used = {stage for weights in (*tableau.dense, *(each for _, each in tableau.extra)) for stage, _ in weights}
    return "\n".join(
        [
            "def attempt(time, step, start, first, relative, absolute, fraction, origins, held):",
            *writer.begin({0: "first"}),
            *writer.stages(tableau.stages, 1),
            *writer.errors(tableau.errors),
            f" rates = [first, {', '.join(writer.list_of(f'k{stage}_') for stage in range(1, late))}]",
            f" return rates, {writer.list_of('v', times)}, [{', '.join(f'e{n}' for n in range(len(tableau.errors)))}]",
            "def dense(time, step, start, rates, fraction, origins, held):",
            *writer.begin({stage: f"rates[{stage}]" for stage in sorted(used) if stage < late}),
            *writer.stages(tableau.extra, late),
            f" return [{', '.join(map(writer.row, tableau.dense))}]",
        ]
    )


class _Writer:
    """Writes the parts of the functions."""

    def __init__(self, rates: Sequence[str], times: int, held: int) -> None:
        self._rates, self._times, self._held = rates, times, held
        self._states = range(len(rates))

    def list_of(self, name: str, first: int = 0) -> str:
        return f"[{', '.join(f'{name}{first + number}' for number in self._states)}]"

    def begin(self, stages: dict[int, str]) -> list[str]:
        """Take out the states, derivatives that are known, the parts of times, and what is held."""
        behind = self._times + len(self._rates)
        lines = [f" {self.list_of('x')} = start", f" [{', '.join(f'a{n}' for n in range(self._times))}] = origins"]
        lines += [f" {self.list_of(f'k{stage}_')} = {where}" for stage, where in stages.items()]
        return [*lines, f" [{', '.join(f'v{behind + number}' for number in range(self._held))}] = held"]

    def _sum(self, weights: Weights, state: int) -> str:
        return "0.0" + "".join(f" + {weight!r} * k{stage}_{state}" for stage, weight in weights)

    def stages(self, stages: Iterable[Stage], first: int) -> list[str]:
        """Find the derivatives at stages, of which the first has this number."""
        lines = [" try:"]
        for stage, (share, weights) in enumerate(stages, first):
            for state in self._states:
                lines.append(f"  v{self._times + state} = x{state} + step * ({self._sum(weights, state)})")
            lines += [f"  v{n} = a{n} + (fraction + (time + {share!r} * step))" for n in range(self._times)]
            lines += [f"  k{stage}_{state} = {text}" for state, text in enumerate(self._rates)]
        return [*lines, "  pass", " except UNDECIDED:", "  return None"]

    def errors(self, errors: Iterable[Weights]) -> list[str]:
        """Find the norms of the errors, for the larger one of the values of a state at both ends."""
        lines = []
        for state in self._states:
            lines.append(f" one, other = abs(x{state}), abs(v{self._times + state})")
            lines.append(f" s{state} = absolute + relative * (other if other > one else one)")
        for number, weights in enumerate(errors):
            lines.append(" squares = 0.0")
            for state in self._states:
                lines += [f" ratio = ({self._sum(weights, state)}) / s{state}", " squares += ratio * ratio"]
            lines.append(f" e{number} = sqrt(squares / {len(self._rates)})")
        return lines

    def row(self, weights: Weights) -> str:
        return f"({''.join(f'step * ({self._sum(weights, state)}), ' for state in self._states)})"
