"""What a model may name: types of actors, aspects and ports, kinds of metrics, and packaged files."""

from .figure import Figure, figure_types
from .measure import MSER5, TAKES, TIME, TOKENS, Measure, conversion_problem, take_problem
from .own_types import TypesError, types_of_file
from .packaged import (
    find,
    is_path,
    model_folders,
    packaged_disturbances,
    packaged_files,
    packaged_models,
    packaged_ones,
    packaged_studies,
    unreadable,
)
from .port_types import PortTypeError, read_type, token_types
from .reference import (
    ParameterReference,
    PortReference,
    TypeReference,
    as_written,
    describe,
    doc_of,
    first_sentence,
    is_part,
    parts_of,
    shown,
)
from .types import Catalogue, CatalogueError, Types, built_in, installed, load_all

__all__ = [
    "MSER5",
    "TAKES",
    "TIME",
    "TOKENS",
    "Catalogue",
    "CatalogueError",
    "Figure",
    "Measure",
    "ParameterReference",
    "PortReference",
    "PortTypeError",
    "TypeReference",
    "Types",
    "TypesError",
    "as_written",
    "built_in",
    "conversion_problem",
    "describe",
    "doc_of",
    "figure_types",
    "find",
    "first_sentence",
    "installed",
    "is_part",
    "is_path",
    "load_all",
    "model_folders",
    "packaged_disturbances",
    "packaged_files",
    "packaged_models",
    "packaged_ones",
    "packaged_studies",
    "parts_of",
    "read_type",
    "shown",
    "take_problem",
    "token_types",
    "types_of_file",
    "unreadable",
]
