"""Properties over time: their text, and whether signals have them.

``property_of`` reads one.  A ``PropertyMonitor`` is given the signals of its conditions, and says whether it
holds once it can.
"""

from .monitor import PropertyMonitor, PropertyVerdict
from .operators import Source
from .property import Condition, Property, Sends, leaves, looks_ahead, waits_for_tokens
from .requirement import HOLD, LINEAR, Requirement, RequirementOptions
from .signal import TINY, Line, Piece, moment, time_of
from .spread import Spread, spread_of
from .syntax import WORDS, PropertyError, property_of

__all__ = [
    "HOLD", "LINEAR", "TINY", "WORDS", "Condition", "Line", "Piece", "Property", "PropertyError", "PropertyMonitor",
    "PropertyVerdict", "Requirement", "RequirementOptions", "Sends", "Source", "Spread", "leaves", "looks_ahead",
    "moment", "property_of", "spread_of", "time_of", "waits_for_tokens",
]  # fmt: skip
