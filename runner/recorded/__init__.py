"""What was recorded outside of runs: channels fitted to measured traces, and recordings that pass disturbances."""

from .delays import DelayLaw, delay_laws
from .files import RecordingError
from .fitting import Fitted, fitted
from .losses import Goodness, LossModel, loss_models
from .passing import Passed, pass_recording

__all__ = [
    "DelayLaw",
    "Fitted",
    "Goodness",
    "LossModel",
    "Passed",
    "RecordingError",
    "delay_laws",
    "fitted",
    "loss_models",
    "pass_recording",
]
