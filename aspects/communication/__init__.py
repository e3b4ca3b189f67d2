"""Disturbances of communication: they stand at input ports, and decide whether, when and how a message arrives."""

from .loss import GilbertElliott, PacketLoss
from .messages import Corrupt, Duplicate, Latency, Reorder, Throttle

__all__ = ["Corrupt", "Duplicate", "GilbertElliott", "Latency", "PacketLoss", "Reorder", "Throttle"]
