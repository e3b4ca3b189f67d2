"""Studies: many runs of a model under many conditions, which survive whatever happens to them."""

from ..language import Study, StudyMetric, find_study, is_study, read_study
from .executor import WorkerError
from .manifest import StoreError
from .metrics import MetricError
from .plan import Condition, Plan
from .results import StudyResults, open_study
from .schedule import Schedule
from .session import Outcome, TooManyRunsError, available_cores, check_size, plan_of_folder, run_study
from .store import WriteError

__all__ = [
    "Condition",
    "MetricError",
    "Outcome",
    "Plan",
    "Schedule",
    "StoreError",
    "Study",
    "StudyMetric",
    "StudyResults",
    "TooManyRunsError",
    "WorkerError",
    "WriteError",
    "available_cores",
    "check_size",
    "find_study",
    "is_study",
    "open_study",
    "plan_of_folder",
    "read_study",
    "run_study",
]
