"""Media that ports share: what passes at one port is felt at the others."""

from .medium import Bus, Medium
from .radio import RadioMedium

__all__ = ["Bus", "Medium", "RadioMedium"]
