"""Steppers for systems of ordinary differential equations, in plain floats: the same bits on every processor."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from .bdf import BDF
from .exact import Exact
from .radau import Radau
from .runge_kutta import DOP853, RK23, RK45, RungeKutta
from .stepper import Bounds, Derivative, Limits, Piece, State, Stepper

STEPPERS: Final[Mapping[str, Callable[[Derivative, State, Limits], Stepper]]] = {
    "RK45": partial(RungeKutta, RK45),
    "RK23": partial(RungeKutta, RK23),
    "DOP853": partial(RungeKutta, DOP853),
    "Radau": Radau,
    "BDF": BDF,
}

__all__ = ["STEPPERS", "Bounds", "Derivative", "Exact", "Limits", "Piece", "State", "Stepper"]
