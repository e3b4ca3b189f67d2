"""Disturbances that depend on where bodies are and who they are: distance, range, line of sight, partition."""

from .bodies import SituationError
from .losses import Occlusion, Outage, OutOfRange, RangeLoss

__all__ = ["Occlusion", "OutOfRange", "Outage", "RangeLoss", "SituationError"]
