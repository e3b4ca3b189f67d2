"""What is to be run: the conditions of a study, the identity of every run, and what the columns of its table are."""

from .described import Column
from .metrics import MetricError, value_of
from .plan import Condition, Plan, PlanError, epicycle_version, index_of

__all__ = ["Column", "Condition", "MetricError", "Plan", "PlanError", "epicycle_version", "index_of", "value_of"]
