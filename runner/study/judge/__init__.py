"""What the runs of a study say: its table, estimates of every condition, verdicts on claims, and what to choose."""

from .claims import (
    CONFIRMED,
    NOT_REPRODUCED,
    REPRODUCED,
    REVERSED,
    UNDECIDED,
    Finding,
    Judgement,
    ranked,
)
from .guideline import Recommendation
from .study_results import StudyResults, open_study

__all__ = [
    "CONFIRMED",
    "NOT_REPRODUCED",
    "REPRODUCED",
    "REVERSED",
    "UNDECIDED",
    "Finding",
    "Judgement",
    "Recommendation",
    "StudyResults",
    "open_study",
    "ranked",
]
