"""Robots that observe and avoid a moving obstacle: bodies, sensors, estimators, controllers, messages."""

from .controller import RobustController
from .detecting import MultiTargetSensor
from .estimator import UnscentedEstimator
from .filterpy_estimator import FilterError, FilterPyEstimator
from .integrated_ou import IntegratedOUEstimator
from .messages import (
    BodyState,
    Detections,
    Estimate,
    Measurement,
    Plan,
    Tracks,
)
from .monitors import ClearanceMonitor, DistanceMonitor, GoalMonitor, SeparationMonitor
from .motion import WaypointMotion
from .planning import (
    Barrier,
    Casadi,
    Inform,
    Objective,
    ReachGoal,
    Solver,
    StayNear,
)
from .safe_controller import SafeController
from .tracker import JPDATracker
from .tracking_error import TrackingError
from .world import (
    BroadcastChannel,
    ChannelError,
    CircularMotion,
    Flooding,
    Sensor,
    Vehicle,
)

__all__ = [
    "Barrier", "BodyState", "BroadcastChannel", "Casadi", "ChannelError", "CircularMotion", "ClearanceMonitor",
    "Detections", "DistanceMonitor", "Estimate", "FilterError", "FilterPyEstimator", "Flooding", "GoalMonitor",
    "Inform", "IntegratedOUEstimator", "JPDATracker", "Measurement", "MultiTargetSensor", "Objective", "Plan",
    "ReachGoal", "RobustController", "SafeController", "Sensor", "SeparationMonitor", "Solver", "StayNear",
    "TrackingError", "Tracks", "UnscentedEstimator", "Vehicle", "WaypointMotion",
]  # fmt: skip
