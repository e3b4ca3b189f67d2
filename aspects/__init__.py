"""What can be woven around a model: aspects, and the join points that they act at."""

from .clock import ClockAspect, ClockDrift, ClockOffset
from .communication import Corrupt, Duplicate, GilbertElliott, Latency, PacketLoss, Reorder, Throttle
from .core import *
from .execution import CrashRestart, ExecutionTime, Processor, SkipFiring
from .measurement import (
    Alteration,
    Bias,
    Drift,
    MeasurementFailure,
    Noise,
    Outlier,
    Quantise,
    Replace,
    Saturate,
    StuckAt,
    Transform,
)
from .media import Bus, Medium, RadioMedium
from .observation import Assert, Count, InvariantError, Probe
from .situation import Occlusion, Outage, OutOfRange, RangeLoss, SituationError

__all__ = [
    "STAMP", "ActorPoint", "Alteration", "Aspect", "AspectContext", "Assert", "Bias", "Bus", "ByActorParameter",
    "ClockAspect", "ClockDrift", "ClockOffset", "CommunicationAspect", "CompositeAspect", "CompositeExecutionAspect",
    "Corrupt", "Count", "CrashRestart", "Decoration", "Drift", "Duplicate", "Duration", "DurationParameter",
    "ExecutionAspect", "ExecutionTime", "FieldError", "FiringRequest", "FiringTime", "FiringTimeParameter",
    "GilbertElliott", "GroupsParameter", "InvariantError", "Job", "JoinPoint", "JoinPointAspect", "Latency",
    "LossAspect", "MeasurementAspect", "MeasurementFailure", "Medium", "Noise", "ObservationAspect", "Occlusion",
    "OutOfRange", "Outage", "Outlier", "PacketLoss", "PortAspect", "PortsParameter", "Probe", "Processor", "Quantise",
    "RadioMedium", "RandomLoss", "RangeLoss", "Reading", "Reorder", "Replace", "Request", "Saturate", "Selection",
    "SelectionParameter", "SituationError", "SkipFiring", "StuckAt", "Throttle", "Transform", "Unit", "aspect_stream",
    "class_decorations", "decorations", "time_needed",
]  # fmt: skip
