"""Control: linear systems, filters and controllers that are driven by tokens, and what limits them."""

from .filters import Butterworth, DiscreteFilter, FilterDesign, FirstOrder
from .limits import DeadZone, Limiter, Quantizer, Relay
from .linear import StateSpace, TransferFunction
from .pid import PID

__all__ = [
    "PID", "Butterworth", "DeadZone", "DiscreteFilter", "FilterDesign", "FirstOrder", "Limiter", "Quantizer", "Relay",
    "StateSpace", "TransferFunction",
]  # fmt: skip
