"""Positioned text: YAML as nodes that know where they stand, problems with places, and limits; it knows no language."""

from .document import MAX_BYTES, Entry, Mapping, Node, Scalar, Sequence, Value, parse, plain, read
from .files import COMMAND_LINE, Noted, data_file, note_file, note_package, noting
from .limits import NORMAL, RAISE_IT, Limits
from .problems import (
    MAX_PROBLEMS,
    ModelError,
    Position,
    Problem,
    Problems,
    did_you_mean,
    marked,
    nearest,
    told_raised,
    visible,
)
from .reading import NAME, SURE, NodeReader, Text, inside, is_empty, split, within
from .site import call_site, entries_of, node_of

__all__ = [
    "COMMAND_LINE",
    "MAX_BYTES",
    "MAX_PROBLEMS",
    "NAME",
    "NORMAL",
    "RAISE_IT",
    "SURE",
    "Entry",
    "Limits",
    "Mapping",
    "ModelError",
    "Node",
    "NodeReader",
    "Noted",
    "Position",
    "Problem",
    "Problems",
    "Scalar",
    "Sequence",
    "Text",
    "Value",
    "call_site",
    "data_file",
    "did_you_mean",
    "entries_of",
    "inside",
    "is_empty",
    "marked",
    "nearest",
    "node_of",
    "note_file",
    "note_package",
    "noting",
    "parse",
    "plain",
    "read",
    "split",
    "told_raised",
    "visible",
    "within",
]
