"""What can be woven around a model: aspects, and the join points that they act at."""

from .clock import ClockAspect, ClockDrift, ClockOffset
from .communication import Corrupt, Duplicate, GilbertElliott, Latency, PacketLoss, Reorder, Throttle
from .composite import CompositeAspect, CompositeExecutionAspect, FiringRequest, Request
from .core import (
    Aspect,
    CommunicationAspect,
    JoinPoint,
    MeasurementAspect,
    ObservationAspect,
    Reading,
    Selection,
    Weaver,
)
from .crash import CrashRestart
from .decoration import Decoration, class_decorations, decorations
from .duration import Duration, DurationParameter, FiringTime, FiringTimeParameter, time_needed
from .execution import ActorPoint, ExecutionAspect, Job, Unit
from .firing import ExecutionTime, SkipFiring
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
    Transform,
)
from .media import Bus, Medium
from .observation import Assert, Count, InvariantError, Probe
from .processor import Processor
from .radio import RadioMedium
from .selection import ByActorParameter, GroupsParameter, PortsParameter, SelectionParameter
from .situation import Occlusion, Outage, OutOfRange, RangeLoss, SituationError
from .tokens import STAMP, FieldError

__all__ = [
    "STAMP",
    "ActorPoint",
    "Alteration",
    "Aspect",
    "Assert",
    "Bias",
    "Bus",
    "ByActorParameter",
    "ClockAspect",
    "ClockDrift",
    "ClockOffset",
    "CommunicationAspect",
    "CompositeAspect",
    "CompositeExecutionAspect",
    "Corrupt",
    "Count",
    "CrashRestart",
    "Decoration",
    "Drift",
    "Duplicate",
    "Duration",
    "DurationParameter",
    "ExecutionAspect",
    "ExecutionTime",
    "FieldError",
    "FiringRequest",
    "FiringTime",
    "FiringTimeParameter",
    "GilbertElliott",
    "GroupsParameter",
    "InvariantError",
    "Job",
    "JoinPoint",
    "Latency",
    "MeasurementAspect",
    "MeasurementFailure",
    "Medium",
    "Noise",
    "ObservationAspect",
    "Occlusion",
    "OutOfRange",
    "Outage",
    "Outlier",
    "PacketLoss",
    "PortsParameter",
    "Probe",
    "Processor",
    "Quantise",
    "RadioMedium",
    "RangeLoss",
    "Reading",
    "Reorder",
    "Request",
    "Saturate",
    "Selection",
    "SelectionParameter",
    "SituationError",
    "SkipFiring",
    "StuckAt",
    "Throttle",
    "Transform",
    "Unit",
    "Weaver",
    "class_decorations",
    "decorations",
    "time_needed",
]
