"""The parts of a model graph: the actor contract, the library of actors, and the robots of the example."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .compiled import CORE, CORE_MODULES, CORE_REASON

# isort: split
# The import above decides what all later imports find: compiled modules, or their sources.
from .core import *

if TYPE_CHECKING:
    from .constructors import *  # the same classes, each with a constructor that names its parameters
    from .control import FilterDesign
    from .distributions import Distribution
    from .functions import FunctionParameter
    from .modes import Mode, on_entry, on_exit, transition
    from .replay import ReplayError
    from .robotics import (
        BodyState,
        ChannelError,
        Detections,
        Estimate,
        FilterError,
        Measurement,
        Objective,
        Plan,
        Solver,
        Tracks,
    )
    from .vehicles import Pose

__all__ = [
    "ABSENT", "CORE", "CORE_MODULES", "CORE_REASON", "FOLDERS", "FORMER", "MAX_DEPTH", "NANOSECONDS_PER_SECOND",
    "NEVER", "NO_TOKENS", "ODE", "PID", "REQUIRED", "Accumulator", "Ackermann", "Actor", "AddSubtract", "ArqReceiver",
    "ArqSender", "Barrier", "Batch", "Beliefs", "Bernoulli", "Binomial", "BlockExpression", "BodyState",
    "BooleanSelect", "BooleanSwitch", "BroadcastChannel", "Butterworth", "Casadi", "Cauchy", "Changes",
    "ChannelError", "ChiSquare", "Choice", "CircularMotion", "ClearanceMonitor", "Clock", "Collect", "Commutator",
    "Comparator", "Configurable", "Const", "Constant", "Context", "Counter", "CurrentMicrostep", "CurrentTime",
    "DeadZone", "Default", "Derivative", "Detections", "Difference", "DiscreteFilter", "Display", "DistanceMonitor",
    "Distribution", "DoubleIntegrator", "Dynamics", "Emitter", "Environment", "EpicycleError", "Equals", "Estimate",
    "Estimator", "Events", "Exponential", "Expression", "ExtendedEstimator", "Extreme", "Fault", "FaultError", "Filter",
    "FilterDesign", "FilterError", "FilterPyEstimator", "FirstOfInstant", "FirstOrder", "Flooding", "Function",
    "FunctionParameter", "Gamma",
    "GoalMonitor", "Histogram", "HoldingExpression", "Host", "Hysteresis", "InertialSensor", "Inform", "Inhibit",
    "InputPort", "IntegratedOUEstimator", "Integrator", "IsPresent", "JPDATracker", "Latest", "LatestOfAll", "Limiter",
    "Link", "LogNormal", "LogicGate", "LookupTable", "Machine", "MappingParameter", "Match", "MathFunction",
    "Measurement", "Merge", "ModalActor", "Mode", "Moment", "MostRecent", "MotionState", "MovingAverage",
    "MovingStatistics", "MultiTargetSensor", "MultiplyDivide", "NegativeBinomial", "NetworkSwitch", "Normal",
    "Objective", "Observation", "OutputPort", "Parameter", "ParameterError", "ParticleEstimator", "Pending", "Plan",
    "Poisson", "PoissonClock", "Pool", "Pools", "PortError", "PortParameter", "Pose", "Previous", "Problem", "Process",
    "Pulse", "Quantity", "Quantizer", "Queue", "Queues", "Ramp", "Random", "RandomInteger", "RangeBearingSensor",
    "RangeScanner", "ReachGoal", "ReadyQueue", "Receiver", "RecordAssembler", "RecordDisassembler", "Recorder",
    "Register", "Repeat", "Replay", "ReplayError", "ResettableTimer", "RobustController", "Router", "SafeController",
    "SampledEstimate", "Sampler", "Scale", "Select", "Sensor", "SensorModel", "SeparationMonitor", "Sequence",
    "Sequencer", "Server", "SetFields", "SetVariable", "SharedQueue", "SingleEvent", "Solver", "Span", "Spread",
    "StateMachine", "StateSpace", "Station", "StayNear", "Stop", "Stream", "Streams", "StudentT", "Switch",
    "Synchronizer", "Tag", "Tally", "Test", "TextFunction", "TimeAverage", "TimeCompare", "TimeDelay", "TimeGap",
    "TimedQueue", "Timer", "TrackingError", "Tracks", "Trajectory", "TransferFunction", "Triangular", "Unbatch",
    "Unicycle", "Uniform", "UnitError", "UnscentedEstimator", "Variable", "VaryingRandom", "Vehicle", "VonMises",
    "WaitingLine", "WaitingTime", "Wake", "WaypointFollower", "WaypointMotion", "abridged", "accepts", "any_parameter",
    "array_parameter", "below_nanoseconds", "bounds_text", "brief", "check_allowed", "convert", "counted",
    "counted_in_si", "cut", "declared_parameters", "declared_ports",
    "did_you_mean", "digits", "elementary", "found_variants", "has_own_ports",
    "in_si", "irregular", "is_alone", "is_too_deep", "nearest", "new_tag", "new_wake", "normal_quantile",
    "on_entry", "on_exit", "open_regular", "parse_unit", "part_finders", "paths", "plain", "present",
    "quantity", "random_stream", "read_regular", "read_table", "readable", "rounds", "shaped", "shortened", "symbolic",
    "texts_parameter", "to_nanoseconds", "to_seconds", "token_type", "transition", "type_name", "units_like",
    "unknown_parameter", "variants", "visible", "visible_character", "visible_lines",
]  # fmt: skip


# Modules of the other names in __all__, which are imported on first use: a model needs few of them, and all together
# take as long as everything else.  What is not here is in ``robotics``.
_MODULES = {
    ".accumulation": ("Accumulator", "Counter", "Derivative", "Difference", "Integrator", "TimeAverage"),
    ".arithmetic": ("AddSubtract", "Extreme", "MathFunction", "MultiplyDivide", "Scale"),
    ".blocks": ("BlockExpression", "HoldingExpression"),
    ".continuous": ("ODE",),
    ".control": (
        "PID", "Butterworth", "DeadZone", "DiscreteFilter", "FilterDesign", "FirstOrder", "Hysteresis", "Limiter",
        "Quantizer", "StateSpace", "TransferFunction",
    ),
    ".distributions": (
        "Bernoulli", "Binomial", "Cauchy", "ChiSquare", "Choice", "Constant", "Distribution", "Exponential", "Gamma",
        "LogNormal", "NegativeBinomial", "Normal", "Poisson", "RandomInteger", "StudentT", "Triangular", "Uniform",
        "VonMises",
    ),
    ".entities": (
        "Batch", "Collect", "Match", "RecordAssembler", "RecordDisassembler", "SetFields", "Spread", "Unbatch",
    ),
    ".flow": (
        "BooleanSwitch", "Merge", "MostRecent", "Repeat", "Router", "Sampler", "Select", "Switch", "Synchronizer",
    ),
    ".functions": ("Expression", "Function", "FunctionParameter", "LookupTable"),
    ".links": ("ArqReceiver", "ArqSender", "Link", "NetworkSwitch"),
    ".logic": ("Comparator", "Equals", "LogicGate"),
    ".modes": ("ModalActor", "Mode", "StateMachine", "on_entry", "on_exit", "transition"),
    ".passing": (
        "BooleanSelect", "Changes", "Commutator", "Default", "Filter", "FirstOfInstant", "Inhibit", "IsPresent",
        "LatestOfAll", "Previous", "Register", "Sequencer",
    ),
    ".queues": ("Queue", "Server", "SharedQueue"),
    ".replay": ("Replay", "ReplayError"),
    ".resources": ("Machine", "Pool", "Pools", "Station", "WaitingLine"),
    ".sinks": ("Display", "Histogram", "Recorder", "Stop", "Test"),
    ".sources": ("Clock", "PoissonClock", "Random", "SingleEvent", "VaryingRandom"),
    ".statistics": ("MovingAverage", "MovingStatistics"),
    ".texts": ("TextFunction",),
    ".timing": ("ResettableTimer", "TimeCompare", "TimeDelay", "TimeGap", "Timer", "WaitingTime"),
    ".triggered": ("Const", "CurrentMicrostep", "CurrentTime", "Pulse", "Ramp", "Sequence"),
    ".variables": ("SetVariable", "Variable"),
    ".vehicles": (
        "Ackermann", "InertialSensor", "Pose", "RangeBearingSensor", "RangeScanner", "Unicycle", "WaypointFollower",
    ),
}  # fmt: skip


# Types that are others now: the message for a model or a program that names one.
FORMER = {
    "FlyingController": "write RobustController with 'dimensions: 3'",
    "FlyingVehicle": "write Vehicle; it flies if its 'start' has a height",
    "RoamingEstimator": "write IntegratedOUEstimator",
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        former = f": {FORMER[name]}" if name in FORMER else ""
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{former}")
    module = next((module for module, names in _MODULES.items() if name in names), ".robotics")
    found = globals()[name] = getattr(import_module(module, __name__), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
