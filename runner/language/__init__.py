"""What files declare: models, composites, disturbances, studies and settings from outside, as constructs."""

from .acts import ActText
from .claims import ALWAYS, FALLS, GREATER, RISES, Claim, Guideline, Selection
from .dimensions import (
    RANGE,
    Dimension,
    DimensionReader,
    Factor,
    Level,
    Listed,
    as_factor,
    in_si,
    kind_of,
    number_node,
    split_number,
)
from .disturbance import (
    COMPOSITE_THERE,
    EXACTLY,
    PARAMETER_THERE,
    Disturbance,
    add_disturbances,
    joined,
    load_disturbance,
    load_disturbances,
    only_acts,
)
from .fields import Computed, nanoseconds
from .files import read_library, read_model
from .inheritance import inherit
from .metrics import MetricText
from .models import CompositeText, ModelText
from .monitors import MonitorText
from .parts import PartText, beside
from .places import ConnectionText, Endpoint, PointcutText, connection, endpoints
from .ports import ParameterText, PortText
from .sampling import MORRIS, SOBOL, Design
from .schema import CONSTRUCTS, json_schema, schema_text
from .settings import (
    Setting,
    Settings,
    change_aspect,
    parse_setting,
    parse_settings,
    read_overrides,
    settings_in,
    settings_of,
    without,
)
from .study import MAX_REPLICATIONS, MAX_STUDY_SEED, RESERVED, Study, is_study, read_study, study_of_text
from .study_metric import ASPECTS, NUMBERS, SIGNALS, StudyMetric, asks_for_none
from .surroundings import Surroundings
from .usage import check_usage
from .values import OUTSIDE, Locals, Values

__all__ = [
    "ALWAYS",
    "ASPECTS",
    "COMPOSITE_THERE",
    "CONSTRUCTS",
    "EXACTLY",
    "FALLS",
    "GREATER",
    "MAX_REPLICATIONS",
    "MAX_STUDY_SEED",
    "MORRIS",
    "NUMBERS",
    "OUTSIDE",
    "PARAMETER_THERE",
    "RANGE",
    "RESERVED",
    "RISES",
    "SIGNALS",
    "SOBOL",
    "ActText",
    "Claim",
    "CompositeText",
    "Computed",
    "ConnectionText",
    "Design",
    "Dimension",
    "DimensionReader",
    "Disturbance",
    "Endpoint",
    "Factor",
    "Guideline",
    "Level",
    "Listed",
    "Locals",
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
    "Surroundings",
    "Values",
    "add_disturbances",
    "as_factor",
    "asks_for_none",
    "beside",
    "change_aspect",
    "check_usage",
    "connection",
    "endpoints",
    "in_si",
    "inherit",
    "is_study",
    "joined",
    "json_schema",
    "kind_of",
    "load_disturbance",
    "load_disturbances",
    "nanoseconds",
    "number_node",
    "only_acts",
    "parse_setting",
    "parse_settings",
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
