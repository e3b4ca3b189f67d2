"""From YAML text to a checked model: document, declarations, elaboration, graph."""

from ..text import NORMAL, RAISE_IT, Limits, ModelError, Position, Problem, Problems, did_you_mean, told_raised
from .catalogue import Catalogue, installed, load_all
from .clock import Clock
from .composite_class import CompositeClass, load_composite
from .configuration import place_of
from .culprit import describe, raised_at
from .declarations import PartText
from .disturbance import load_disturbance
from .ends import CompositePort, Instance
from .graph import Hop, ModelGraph, Wire
from .load import load_model
from .measure import TAKES, Measure
from .model import Model
from .observation import Metric
from .own_types import types_of_file
from .packaged import is_path, packaged_disturbances, packaged_models, packaged_studies
from .patterns import PatternError, select
from .reference import ParameterReference, PortReference, TypeReference, as_written, parts_of
from .reference import describe as describe_type
from .reference import shown as as_yaml
from .schedule import firing_order
from .schema import json_schema, schema_text
from .scope import Composite
from .woven import WovenAspect, extent

__all__ = [
    "NORMAL",
    "RAISE_IT",
    "TAKES",
    "Catalogue",
    "Clock",
    "Composite",
    "CompositeClass",
    "CompositePort",
    "Hop",
    "Instance",
    "Limits",
    "Measure",
    "Metric",
    "Model",
    "ModelError",
    "ModelGraph",
    "ParameterReference",
    "PartText",
    "PatternError",
    "PortReference",
    "Position",
    "Problem",
    "Problems",
    "TypeReference",
    "Wire",
    "WovenAspect",
    "as_written",
    "as_yaml",
    "describe",
    "describe_type",
    "did_you_mean",
    "extent",
    "firing_order",
    "installed",
    "is_path",
    "json_schema",
    "load_all",
    "load_composite",
    "load_disturbance",
    "load_model",
    "packaged_disturbances",
    "packaged_models",
    "packaged_studies",
    "parts_of",
    "place_of",
    "raised_at",
    "schema_text",
    "select",
    "told_raised",
    "types_of_file",
]
