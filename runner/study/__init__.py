"""Studies: many runs of a model under many conditions, whose results survive any interruption.

``plan`` determines the runs, ``run`` makes them and keeps their results, ``judge`` evaluates these.
"""

from .inference import Estimate, half_width, holm, mean, paired_difference, with_interval
from .judge.claims import CONFIRMED, NOT_REPRODUCED, REPRODUCED, REVERSED, UNDECIDED, Finding, Judgement, ranked
from .judge.guideline import Recommendation
from .judge.study_results import StudyResults, open_study
from .plan.columns import Column
from .plan.plan import Plan, Search
from .run.backlog import OK
from .run.manifest import StoreError
from .run.processes import DONE, Processes, WorkerError
from .run.pulse import progress
from .run.runner import Replay, ReplayError, again, repeat
from .run.store import WriteError, is_running, replace_file
from .session import available_cores, check_size, plan_of_folder, run_study
from .trials import Trials, open_trials

__all__ = [
    "CONFIRMED",
    "DONE",
    "NOT_REPRODUCED",
    "OK",
    "REPRODUCED",
    "REVERSED",
    "UNDECIDED",
    "Column",
    "Estimate",
    "Finding",
    "Judgement",
    "Plan",
    "Processes",
    "Recommendation",
    "Replay",
    "ReplayError",
    "Search",
    "StoreError",
    "StudyResults",
    "Trials",
    "WorkerError",
    "WriteError",
    "again",
    "available_cores",
    "check_size",
    "half_width",
    "holm",
    "is_running",
    "mean",
    "open_study",
    "open_trials",
    "paired_difference",
    "plan_of_folder",
    "progress",
    "ranked",
    "repeat",
    "replace_file",
    "run_study",
    "with_interval",
]
