"""Control: linear systems, filters and controllers driven by tokens, and nonlinear elements."""

from .filters import Butterworth, DiscreteFilter, FilterDesign, FirstOrder
from .limits import DeadZone, Hysteresis, Limiter, Quantizer
from .linear import StateSpace, TransferFunction
from .pid import PID

__all__ = [
    "PID", "Butterworth", "DeadZone", "DiscreteFilter", "FilterDesign", "FirstOrder", "Hysteresis", "Limiter",
    "Quantizer", "StateSpace", "TransferFunction",
]  # fmt: skip
