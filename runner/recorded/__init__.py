"""What was recorded outside of runs: channels fitted to measured traces, and recordings that pass disturbances."""

from .files import Message, RecordingError, Writing, topics_like

__all__ = ["Message", "RecordingError", "Writing", "topics_like"]  # what readers of other packages need
