"""Steppers for systems of ordinary differential equations, in plain floats: the same bits on every processor."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from ..core import ParameterError
from .bdf import BDF
from .euler import Euler
from .exact import Exact
from .radau import Radau
from .runge_kutta import DOP853, RK23, RK45, RungeKutta, Tableau, Unrolled
from .stepper import Bounds, Derivative, Limits, Piece, State, Stepper
from .unrolled import unrolled

STEPPERS: Final[Mapping[str, Callable[[Derivative, State, Limits], Stepper | Euler]]] = {
    "RK45": partial(RungeKutta, RK45),
    "RK23": partial(RungeKutta, RK23),
    "DOP853": partial(RungeKutta, DOP853),
    "Radau": Radau,
    "BDF": BDF,
    "Euler": Euler,
}


def check_step(method: str, max_step: float | None) -> None:
    """Raise ``ParameterError`` if a method takes steps of a length that is not given."""
    if method == "Euler" and max_step is None:
        raise ParameterError("max_step: it is missing; Euler takes steps of this length")


__all__ = [
    "STEPPERS", "Bounds", "Derivative", "Euler", "Exact", "Limits", "Piece", "RungeKutta", "State", "Stepper",
    "Tableau", "Unrolled", "check_step", "unrolled",
]  # fmt: skip
