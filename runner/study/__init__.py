"""Studies: many runs of a model under many conditions, which survive whatever happens to them."""

from .claims import CONFIRMED, NOT_REPRODUCED, REPRODUCED, REVERSED, UNDECIDED, Finding, Judgement, ranked
from .declaration import MAX_STUDY_SEED, Study, find_study, is_study, read_study
from .dimensions import Dimension, Factor, in_si, split_number
from .executor import WorkerError
from .guideline import Recommendation
from .manifest import StoreError
from .metrics import MetricError, StudyMetric
from .one_run import again
from .plan import Condition, Plan
from .progress import progress as progress_bar
from .questions import ALWAYS
from .replays import Replay, repeat
from .results import StudyResults, open_study
from .schedule import OK, Schedule
from .session import Outcome, TooManyRunsError, available_cores, check_size, plan_of_folder, run_study
from .statistics import Estimate, half_width, mean
from .store import WriteError, is_running, replace_file

__all__ = [
    "ALWAYS",
    "CONFIRMED",
    "MAX_STUDY_SEED",
    "NOT_REPRODUCED",
    "OK",
    "REPRODUCED",
    "REVERSED",
    "UNDECIDED",
    "Condition",
    "Dimension",
    "Estimate",
    "Factor",
    "Finding",
    "Judgement",
    "MetricError",
    "Outcome",
    "Plan",
    "Recommendation",
    "Replay",
    "Schedule",
    "StoreError",
    "Study",
    "StudyMetric",
    "StudyResults",
    "TooManyRunsError",
    "WorkerError",
    "WriteError",
    "again",
    "available_cores",
    "check_size",
    "find_study",
    "half_width",
    "in_si",
    "is_running",
    "is_study",
    "mean",
    "open_study",
    "plan_of_folder",
    "progress_bar",
    "ranked",
    "read_study",
    "repeat",
    "replace_file",
    "run_study",
    "split_number",
]
