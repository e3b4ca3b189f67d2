"""Vehicles on the ground: how they roll, what they measure, and how they are guided."""

from .following import WaypointFollower
from .motion import Ackermann, Unicycle
from .pose import Pose
from .sensing import InertialSensor, RangeBearingSensor, RangeScanner

__all__ = ["Ackermann", "InertialSensor", "Pose", "RangeBearingSensor", "RangeScanner", "Unicycle", "WaypointFollower"]
