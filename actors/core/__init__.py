"""The parts of every actor: ports, parameters, time, random streams, and the firing contract."""

from . import elementary, paths
from .actor import Actor, Context, declared_ports, has_own_ports
from .authoring import ABSENT, Latest, Pending, Queues, Tally, present, rounds
from .environment import Environment, Events, Host
from .errors import EpicycleError, Fault, FaultError, ParameterError, Span
from .files import FOLDERS, check_allowed, irregular, open_regular, read_regular, read_table
from .laws import normal_quantile
from .messages import (
    abridged,
    bounds_text,
    brief,
    counted,
    cut,
    did_you_mean,
    digits,
    nearest,
    readable,
    shortened,
    visible,
    visible_character,
    visible_lines,
)
from .order import NEVER, ReadyQueue, TimedQueue
from .parameter import REQUIRED, Configurable, Parameter, declared_parameters, unknown_parameter
from .parameter_kinds import MappingParameter, any_parameter, array_parameter, texts_parameter
from .port_parameter import PortParameter
from .port_types import accepts, shaped, token_type, type_name
from .ports import NO_TOKENS, Emitter, InputPort, OutputPort, PortError, Receiver
from .primitives import is_alone
from .process import Process
from .quantity import MAX_DEPTH, Quantity, counted_in_si, is_too_deep, plain
from .random import Stream, Streams, random_stream
from .tag import (
    NANOSECONDS_PER_SECOND,
    Moment,
    Tag,
    Wake,
    below_nanoseconds,
    new_tag,
    new_wake,
    to_nanoseconds,
    to_seconds,
)
from .units import UnitError, convert, in_si, parse_unit, quantity, units_like
from .variants import found_variants, part_finders, variants

__all__ = [
    "ABSENT", "FOLDERS", "MAX_DEPTH", "NANOSECONDS_PER_SECOND", "NEVER", "NO_TOKENS", "REQUIRED", "Actor",
    "Configurable", "Context", "Emitter", "Environment", "EpicycleError", "Events", "Fault", "FaultError",
    "Host", "InputPort", "Latest", "MappingParameter", "Moment", "OutputPort", "Parameter", "ParameterError", "Pending",
    "PortError", "PortParameter", "Process", "Quantity", "Queues", "ReadyQueue", "Receiver", "Span", "Stream",
    "Streams", "Tag", "Tally", "TimedQueue", "UnitError", "Wake", "abridged", "accepts", "any_parameter",
    "array_parameter", "below_nanoseconds", "bounds_text", "brief", "check_allowed", "convert", "counted",
    "counted_in_si", "cut", "declared_parameters", "declared_ports",
    "did_you_mean", "digits", "elementary", "found_variants", "has_own_ports",
    "in_si", "irregular", "is_alone", "is_too_deep", "nearest", "new_tag", "new_wake", "normal_quantile",
    "open_regular", "parse_unit", "part_finders", "paths", "plain", "present", "quantity", "random_stream",
    "read_regular", "read_table", "readable", "rounds", "shaped", "shortened", "texts_parameter", "to_nanoseconds",
    "to_seconds", "token_type", "type_name", "units_like", "unknown_parameter", "variants", "visible",
    "visible_character", "visible_lines",
]  # fmt: skip
