"""Ground vehicles: motion, sensors and guidance."""

from .following import WaypointFollower
from .motion import Ackermann, Unicycle
from .pose import Pose
from .sensing import InertialSensor, RangeBearingSensor, RangeScanner

__all__ = ["Ackermann", "InertialSensor", "Pose", "RangeBearingSensor", "RangeScanner", "Unicycle", "WaypointFollower"]
