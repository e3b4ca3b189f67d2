"""The parts of every aspect: kinds, join points, and parameters for selections and durations."""

from .aspect import Aspect, Decoration, class_decorations, decorations
from .fields import STAMP, FieldError, altered, field_of, numbers_in, stamped_as
from .join_point import (
    TOKEN,
    AspectContext,
    JoinPoint,
    JoinPointAspect,
    Memory,
    Place,
    Reading,
    Selection,
    aspect_stream,
)
from .kinds import (
    ActorPoint,
    CommunicationAspect,
    CompositeAspect,
    CompositeExecutionAspect,
    ExecutionAspect,
    FiringRequest,
    Job,
    LossAspect,
    MeasurementAspect,
    ObservationAspect,
    PortAspect,
    RandomLoss,
    Request,
    Target,
    is_bad,
)
from .parameters import (
    ByActorParameter,
    Duration,
    DurationParameter,
    FiringTime,
    FiringTimeParameter,
    GroupsParameter,
    LawParameter,
    PortsParameter,
    SelectionParameter,
    drawn,
    law,
    time_needed,
)
from .server import NEWEST, OLDEST, Server, Task, WaitingLine

__all__ = [
    "NEWEST", "OLDEST", "STAMP", "TOKEN", "ActorPoint", "Aspect", "AspectContext", "ByActorParameter",
    "CommunicationAspect", "CompositeAspect", "CompositeExecutionAspect", "Decoration", "Duration", "DurationParameter",
    "ExecutionAspect", "FieldError", "FiringRequest", "FiringTime", "FiringTimeParameter", "GroupsParameter", "Job",
    "JoinPoint", "JoinPointAspect", "LawParameter", "LossAspect", "MeasurementAspect", "Memory", "ObservationAspect",
    "Place", "PortAspect", "PortsParameter", "RandomLoss", "Reading", "Request", "Selection", "SelectionParameter",
    "Server", "Target", "Task", "WaitingLine", "altered", "aspect_stream", "class_decorations", "decorations", "drawn",
    "field_of", "is_bad", "law", "numbers_in", "stamped_as", "time_needed",
]  # fmt: skip
