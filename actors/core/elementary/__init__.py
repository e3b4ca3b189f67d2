"""Elementary functions with the same bits on every machine.

They use + - * / and square roots, which IEEE 754 rounds in one way only, and exact operations, but no C library.
Python runs this source and numba compiles it, to the same results.
"""

from .arcs import acos, asin, atan, atan2
from .circle import cos, sin, tan
from .exponential import cosh, exp, expm1, sinh, tanh
from .gamma import log_gamma
from .length import distance, hypot
from .logarithm import log, log1p, log2, log10
from .powers import pow, power  # noqa: A004 (as in the module math)
from .sums import total

__all__ = [
    "acos", "asin", "atan", "atan2", "cos", "cosh", "distance", "exp", "expm1", "hypot", "log", "log1p", "log2",
    "log10", "log_gamma", "pow", "power", "sin", "sinh", "tan", "tanh", "total",
]  # fmt: skip
