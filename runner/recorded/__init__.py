"""What was recorded outside of runs: channels fitted to measured traces, and recordings that pass disturbances."""

from .files import Message, RecordingError, Writing

__all__ = ["Message", "RecordingError", "Writing"]  # what readers of other packages need
