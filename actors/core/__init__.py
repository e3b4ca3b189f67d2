"""What every actor is made of: ports, parameters, time, random streams, and the firing contract."""

from . import elementary
from .actor import Actor, Context, Wake, declared_ports, has_own_ports
from .errors import EpicycleError
from .files import irregular, open_regular, read_regular, read_table
from .laws import normal_quantile, normal_share
from .mapping import MappingParameter
from .nearest import did_you_mean, nearest
from .parameter import (
    REQUIRED,
    Configurable,
    Parameter,
    ParameterError,
    array_parameter,
    declared_parameters,
    texts_parameter,
    unknown_parameter,
    variants,
)
from .port_parameter import PortParameter
from .port_types import accepts, shaped, token_type, type_name
from .ports import Emit, InputPort, OutputPort, PortError
from .process import Process
from .quantity import MAX_DEPTH, Quantity, counted_in_si, is_too_deep, plain
from .random import Stream, random_stream
from .tag import NANOSECONDS_PER_SECOND, Tag, to_nanoseconds, to_seconds
from .units import UnitError, convert, parse_unit
from .visible import abridged, readable, shortened, visible, visible_character, visible_lines
from .words import counted

__all__ = [
    "MAX_DEPTH",
    "NANOSECONDS_PER_SECOND",
    "REQUIRED",
    "Actor",
    "Configurable",
    "Context",
    "Emit",
    "EpicycleError",
    "InputPort",
    "MappingParameter",
    "OutputPort",
    "Parameter",
    "ParameterError",
    "PortError",
    "PortParameter",
    "Process",
    "Quantity",
    "Stream",
    "Tag",
    "UnitError",
    "Wake",
    "abridged",
    "accepts",
    "array_parameter",
    "convert",
    "counted",
    "counted_in_si",
    "declared_parameters",
    "declared_ports",
    "did_you_mean",
    "elementary",
    "has_own_ports",
    "irregular",
    "is_too_deep",
    "nearest",
    "normal_quantile",
    "normal_share",
    "open_regular",
    "parse_unit",
    "plain",
    "random_stream",
    "read_regular",
    "read_table",
    "readable",
    "shaped",
    "shortened",
    "texts_parameter",
    "to_nanoseconds",
    "to_seconds",
    "token_type",
    "type_name",
    "unknown_parameter",
    "variants",
    "visible",
    "visible_character",
    "visible_lines",
]
