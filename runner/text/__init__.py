"""Positioned text: YAML as nodes with positions, problems with places, and limits; it does not know the language."""

from epicycle.actors import did_you_mean, nearest

from .document import Entry, Mapping, Node, Scalar, Sequence, parse, plain, read
from .files import COMMAND_LINE, Noted, data_file, note_package, noting
from .limits import MAX_SEED, NORMAL, RAISE_IT, Limits
from .patterns import (
    Comparisons,
    PathIndex,
    PatternError,
    TooManyError,
    check_pattern,
    compile_pattern,
    could_be_within,
    in_general,
    matches,
    names_asked,
    names_of,
    select,
)
from .problems import MAX_PROBLEMS, ModelError, Position, Problem, Problems, told_raised
from .program import call_site, describe, entries_of, node_of, raised_at
from .reading import NAME, NAMES_HAVE, SURE, NodeReader, Text, inside, is_empty, split, within

__all__ = [
    "COMMAND_LINE",
    "MAX_PROBLEMS",
    "MAX_SEED",
    "NAME",
    "NAMES_HAVE",
    "NORMAL",
    "RAISE_IT",
    "SURE",
    "Comparisons",
    "Entry",
    "Limits",
    "Mapping",
    "ModelError",
    "Node",
    "NodeReader",
    "Noted",
    "PathIndex",
    "PatternError",
    "Position",
    "Problem",
    "Problems",
    "Scalar",
    "Sequence",
    "Text",
    "TooManyError",
    "call_site",
    "check_pattern",
    "compile_pattern",
    "could_be_within",
    "data_file",
    "describe",
    "did_you_mean",
    "entries_of",
    "in_general",
    "inside",
    "is_empty",
    "matches",
    "names_asked",
    "names_of",
    "nearest",
    "node_of",
    "note_package",
    "noting",
    "parse",
    "plain",
    "raised_at",
    "read",
    "select",
    "split",
    "told_raised",
    "within",
]
