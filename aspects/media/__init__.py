"""Media that ports share: what passes at one port is felt at the others."""

from .bus import Bus
from .medium import Medium
from .radio import RadioMedium

__all__ = ["Bus", "Medium", "RadioMedium"]
