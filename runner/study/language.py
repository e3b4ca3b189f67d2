"""What studies need of the language and of models, by one door."""

from ..model import Model, ModelError, Position, Problems, did_you_mean, load_model, packaged_studies, select
from ..model.document import plain
from ..model.files import Noted, noting
from ..model.own_types import types_of_file
from ..model.settings import Setting
from .declaration import (
    MAX_REPLICATIONS,
    MAX_STUDY_SEED,
    RESERVED,
    Study,
    find_study,
    is_study,
    read_study,
    study_of_text,
)
from .dimensions import Dimension, Factor, Level, in_si, split_number
from .metrics import MetricError, StudyMetric, asks_for_none
from .questions import ALWAYS, FALLS, GREATER, RISES, Claim, Guideline, Selection

__all__ = [
    "ALWAYS",
    "FALLS",
    "GREATER",
    "MAX_REPLICATIONS",
    "MAX_STUDY_SEED",
    "RESERVED",
    "RISES",
    "Claim",
    "Dimension",
    "Factor",
    "Guideline",
    "Level",
    "MetricError",
    "Model",
    "ModelError",
    "Noted",
    "Position",
    "Problems",
    "Selection",
    "Setting",
    "Study",
    "StudyMetric",
    "asks_for_none",
    "did_you_mean",
    "find_study",
    "in_si",
    "is_study",
    "load_model",
    "noting",
    "packaged_studies",
    "plain",
    "read_study",
    "select",
    "split_number",
    "study_of_text",
    "types_of_file",
]
