"""What can be woven around a model: aspects, and the join points that they act at."""

from .communication import Corrupt, Duplicate, GilbertElliott, Latency, PacketLoss, Reorder, Throttle
from .core import Aspect, CommunicationAspect, JoinPoint, MeasurementAspect, ObservationAspect, Reading, Weaver
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
from .media import Bus, Medium
from .observation import Assert, Count, InvariantError, Probe
from .radio import RadioMedium
from .tokens import FieldError

__all__ = [
    "Alteration",
    "Aspect",
    "Assert",
    "Bias",
    "Bus",
    "CommunicationAspect",
    "Corrupt",
    "Count",
    "Drift",
    "Duplicate",
    "FieldError",
    "GilbertElliott",
    "InvariantError",
    "JoinPoint",
    "Latency",
    "MeasurementAspect",
    "MeasurementFailure",
    "Medium",
    "Noise",
    "ObservationAspect",
    "Outlier",
    "PacketLoss",
    "Probe",
    "Quantise",
    "RadioMedium",
    "Reading",
    "Reorder",
    "Saturate",
    "StuckAt",
    "Throttle",
    "Weaver",
]
