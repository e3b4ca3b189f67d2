"""What can be woven around a model: aspects, and the join points that they act at."""

from .communication import Corrupt, Duplicate, GilbertElliott, Latency, PacketLoss, Reorder, Throttle
from .core import Aspect, CommunicationAspect, JoinPoint, MeasurementAspect, Weaver
from .measurement import (
    Alteration,
    Bias,
    Drift,
    MeasurementFailure,
    Noise,
    Outlier,
    Quantise,
    Saturate,
    StuckAt,
)
from .tokens import FieldError

__all__ = [
    "Alteration",
    "Aspect",
    "Bias",
    "CommunicationAspect",
    "Corrupt",
    "Drift",
    "Duplicate",
    "FieldError",
    "GilbertElliott",
    "JoinPoint",
    "Latency",
    "MeasurementAspect",
    "MeasurementFailure",
    "Noise",
    "Outlier",
    "PacketLoss",
    "Quantise",
    "Reorder",
    "Saturate",
    "StuckAt",
    "Throttle",
    "Weaver",
]
