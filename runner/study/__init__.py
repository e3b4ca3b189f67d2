"""Studies: many runs of a model under many conditions, which survive whatever happens to them.

``plan`` says what is to be run, ``run`` makes the runs and keeps what came of them, ``judge`` says what that means.
"""

from .inference import Estimate, half_width, mean
from .judge import (
    CONFIRMED,
    NOT_REPRODUCED,
    REPRODUCED,
    REVERSED,
    UNDECIDED,
    Finding,
    Judgement,
    Recommendation,
    StudyResults,
    open_study,
    ranked,
)
from .plan import Column, Condition, MetricError, Plan
from .run import (
    OK,
    Backlog,
    Replay,
    ReplayError,
    StoreError,
    WorkerError,
    WriteError,
    again,
    is_running,
    progress,
    repeat,
    replace_file,
)
from .session import Outcome, TooManyRunsError, available_cores, check_size, plan_of_folder, run_study

__all__ = [
    "CONFIRMED",
    "NOT_REPRODUCED",
    "OK",
    "REPRODUCED",
    "REVERSED",
    "UNDECIDED",
    "Backlog",
    "Column",
    "Condition",
    "Estimate",
    "Finding",
    "Judgement",
    "MetricError",
    "Outcome",
    "Plan",
    "Recommendation",
    "Replay",
    "ReplayError",
    "StoreError",
    "StudyResults",
    "TooManyRunsError",
    "WorkerError",
    "WriteError",
    "again",
    "available_cores",
    "check_size",
    "half_width",
    "is_running",
    "mean",
    "open_study",
    "plan_of_folder",
    "progress",
    "ranked",
    "repeat",
    "replace_file",
    "run_study",
]
