"""What can be woven around a model: aspects, and the join points that they act at."""

from .communication import PacketLoss
from .core import Aspect, CommunicationAspect, JoinPoint, MeasurementAspect, Weaver
from .measurement import MeasurementFailure

__all__ = [
    "Aspect",
    "CommunicationAspect",
    "JoinPoint",
    "MeasurementAspect",
    "MeasurementFailure",
    "PacketLoss",
    "Weaver",
]
