"""What is to be run: the conditions of a study, the identity of every run, and what the columns of its table are."""

from .described import Column
from .plan import Condition, Plan, PlanError, epicycle_version, index_of

__all__ = ["Column", "Condition", "Plan", "PlanError", "epicycle_version", "index_of"]
