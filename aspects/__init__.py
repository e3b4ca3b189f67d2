"""Aspects, which are woven around a model, and the join points at which they act."""

from typing import TYPE_CHECKING

from .core import *

if TYPE_CHECKING:
    from .clock import ClockAspect
    from .constructors import *  # the same classes, each with a constructor that names its parameters
    from .measurement import Alteration
    from .media import Medium
    from .observation import InvariantError
    from .situation import SituationError
    from .trace import Trace, TraceError, TraceFile
else:
    from .clock import ClockAspect, ClockDrift, ClockOffset
    from .communication import Corrupt, Duplicate, GilbertElliott, Latency, PacketLoss, Reorder, Throttle
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
    from .trace import Trace, TraceError, TraceFile, TraceReplay

__all__ = [
    "STAMP", "ActorPoint", "Alteration", "Aspect", "AspectContext", "Assert", "Bias", "Bus", "ByActorParameter",
    "ClockAspect", "ClockDrift", "ClockOffset", "CommunicationAspect", "CompositeAspect", "CompositeExecutionAspect",
    "Corrupt", "Count", "CrashRestart", "Decoration", "Drift", "Duplicate", "Duration", "DurationParameter",
    "ExecutionAspect", "ExecutionTime", "FieldError", "FiringRequest", "FiringTime", "FiringTimeParameter",
    "GilbertElliott", "GroupsParameter", "InvariantError", "Job", "JoinPoint", "JoinPointAspect", "Latency",
    "LossAspect", "MeasurementAspect", "MeasurementFailure", "Medium", "Memory", "Noise", "ObservationAspect",
    "Occlusion", "OutOfRange", "Outage", "Outlier", "PacketLoss", "Place", "PortAspect", "PortsParameter", "Probe",
    "Processor", "Quantise", "RadioMedium", "RandomLoss", "RangeLoss", "Reading", "Reorder", "Replace", "Request",
    "Saturate", "Selection", "SelectionParameter", "Server", "SituationError", "SkipFiring", "StuckAt", "Target",
    "Task", "Throttle", "Trace", "TraceError", "TraceFile", "TraceReplay", "Transform", "aspect_stream",
    "class_decorations", "decorations", "time_needed",
]  # fmt: skip
