"""What files declare: models, composites, disturbances, studies and settings from outside, as constructs."""

from .claims import ALWAYS, FALLS, GREATER, RISES, Claim, Guideline, Selection
from .declarations import (
    ActText,
    CompositeText,
    ConnectionText,
    MetricText,
    ModelText,
    MonitorText,
    ParameterText,
    PartText,
    PointcutText,
    PortText,
)
from .dimensions import Dimension, Factor, Level, in_si, split_number
from .disturbance import (
    COMPOSITE_THERE,
    PARAMETER_THERE,
    Disturbance,
    add_disturbances,
    joined,
    load_disturbance,
    load_disturbances,
)
from .files import read_library, read_model
from .inheritance import inherit
from .places import connection
from .schema import CONSTRUCTS, json_schema, schema_text
from .settings import Setting, Settings, change_aspect, parse_setting, read_overrides, settings_in, settings_of, without
from .study import MAX_REPLICATIONS, MAX_STUDY_SEED, RESERVED, Study, is_study, read_study, study_of_text
from .study_metric import ASPECTS, NUMBERS, SIGNALS, StudyMetric, asks_for_none
from .usage import check_usage
from .values import Values

__all__ = [
    "ALWAYS",
    "ASPECTS",
    "COMPOSITE_THERE",
    "CONSTRUCTS",
    "FALLS",
    "GREATER",
    "MAX_REPLICATIONS",
    "MAX_STUDY_SEED",
    "NUMBERS",
    "PARAMETER_THERE",
    "RESERVED",
    "RISES",
    "SIGNALS",
    "ActText",
    "Claim",
    "CompositeText",
    "ConnectionText",
    "Dimension",
    "Disturbance",
    "Factor",
    "Guideline",
    "Level",
    "MetricText",
    "ModelText",
    "MonitorText",
    "ParameterText",
    "PartText",
    "PointcutText",
    "PortText",
    "Selection",
    "Setting",
    "Settings",
    "Study",
    "StudyMetric",
    "Values",
    "add_disturbances",
    "asks_for_none",
    "change_aspect",
    "check_usage",
    "connection",
    "in_si",
    "inherit",
    "is_study",
    "joined",
    "json_schema",
    "load_disturbance",
    "load_disturbances",
    "parse_setting",
    "read_library",
    "read_model",
    "read_overrides",
    "read_study",
    "schema_text",
    "settings_in",
    "settings_of",
    "split_number",
    "study_of_text",
    "without",
]
