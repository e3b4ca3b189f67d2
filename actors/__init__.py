"""What can stand in a model graph: the actor contract, the library of actors, and the robots of the example."""

from .compiled import CORE, CORE_MODULES, CORE_REASON

# isort: split
# What comes before decides what all imports behind find: compiled modules, or their sources.
from .accumulation import Accumulator, Counter, Difference, Integrator
from .arithmetic import AddSubtract, MathFunction, MultiplyDivide, Scale
from .continuous import ODE
from .core import *
from .distributions import (
    Bernoulli,
    Choice,
    Constant,
    Distribution,
    Exponential,
    Gamma,
    LogNormal,
    Normal,
    RandomInteger,
    Triangular,
    Uniform,
)
from .entities import Batch, Match, RecordAssembler, RecordDisassembler, SetFields, Unbatch
from .flow import BooleanSwitch, Merge, MostRecent, Repeat, Router, Sampler, Select, Switch, Synchronizer
from .functions import Expression, Function, LookupTable
from .links import ArqReceiver, ArqSender, Link, NetworkSwitch
from .logic import Comparator, LogicGate
from .modes import ModalActor, Mode, StateMachine, on_entry, on_exit, transition
from .queues import Queue, Server
from .replay import Replay, ReplayError
from .resources import Machine, Pool, Station, WaitingLine
from .robotics import *
from .sinks import Display, Histogram, Recorder, Stop, Test
from .sources import Clock, Const, CurrentMicrostep, CurrentTime, PoissonClock, Ramp, Random, Sequence, SingleEvent
from .statistics import MovingAverage, MovingStatistics
from .timing import ResettableTimer, TimeDelay, TimeGap, Timer

__all__ = [
    "ABSENT", "CORE", "CORE_MODULES", "CORE_REASON", "MAX_DEPTH", "NANOSECONDS_PER_SECOND", "NEVER", "ODE", "REQUIRED",
    "Accumulator", "Actor", "AddSubtract", "ArqReceiver", "ArqSender", "Barrier", "Batch", "Bernoulli", "BodyState",
    "BooleanSwitch", "BroadcastChannel", "Casadi", "ChannelError", "Choice", "CircularMotion", "Clock", "Comparator",
    "Configurable", "Const", "Constant", "Context", "Counter", "CurrentMicrostep", "CurrentTime", "Difference",
    "Display", "DistanceMonitor", "Distribution", "Emitter", "EpicycleError", "Estimate", "Exponential", "Expression",
    "FilterError", "FilterPyEstimator", "Function", "Gamma", "GoalMonitor", "Histogram", "Inform", "InputPort",
    "Integrator", "Latest", "Line", "Link", "LogNormal", "LogicGate", "LookupTable", "Machine", "MappingParameter",
    "Match", "MathFunction", "Measurement", "Merge", "ModalActor", "Mode", "Moment", "MostRecent", "MovingAverage",
    "MovingStatistics", "MultiplyDivide", "NetworkSwitch", "Normal", "Objective", "OutputPort", "Parameter",
    "ParameterError", "Pending", "Plan", "PoissonClock", "Pool", "PortError", "PortParameter", "Process", "Quantity",
    "Queue", "Ramp", "Random", "RandomInteger", "Ranks", "ReachGoal", "RecordAssembler", "RecordDisassembler",
    "Recorder", "Repeat", "Replay", "ReplayError", "ResettableTimer", "RobustController", "Router", "Sampler", "Scale",
    "Select", "Sensor", "SeparationMonitor", "Sequence", "Server", "SetFields", "SingleEvent", "Solver", "StateMachine",
    "Station", "Stop", "Stream", "Switch", "Synchronizer", "Tag", "Test", "TimeDelay", "TimeGap", "Timer", "Times",
    "Triangular", "Unbatch", "Uniform", "UnitError", "UnscentedEstimator", "Vehicle", "WaitingLine", "Wake", "Way",
    "When", "abridged", "accepts", "array_parameter", "bounds_text", "brief", "convert", "counted", "counted_in_si",
    "cut", "declared_parameters", "declared_ports", "did_you_mean", "digits", "elementary", "has_own_ports",
    "irregular", "is_too_deep", "nearest", "new_tag", "new_wake", "normal_quantile", "normal_share", "on_entry",
    "on_exit", "open_regular", "parse_unit", "paths", "plain", "present", "random_stream", "read_regular", "read_table",
    "readable", "rounds", "shaped", "shortened", "texts_parameter", "to_nanoseconds", "to_seconds", "token_type",
    "transition", "type_name", "unknown_parameter", "variants", "visible", "visible_character", "visible_lines",
]  # fmt: skip
