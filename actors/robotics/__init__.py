"""Robots that observe and avoid a moving obstacle: bodies, sensors, estimators, controllers, messages."""

from .controller import RobustController
from .estimator import UnscentedEstimator
from .filterpy_estimator import FilterError, FilterPyEstimator
from .messages import BodyState, Estimate, Measurement, Plan
from .monitors import DistanceMonitor, GoalMonitor, SeparationMonitor
from .planning import Barrier, Casadi, Inform, Objective, ReachGoal, Solver
from .roaming import RoamingEstimator
from .safe_controller import SafeController
from .world import BroadcastChannel, ChannelError, CircularMotion, Sensor, Vehicle

__all__ = [
    "Barrier", "BodyState", "BroadcastChannel", "Casadi", "ChannelError", "CircularMotion", "DistanceMonitor",
    "Estimate", "FilterError", "FilterPyEstimator", "GoalMonitor", "Inform", "Measurement", "Objective", "Plan",
    "ReachGoal", "RoamingEstimator", "RobustController", "SafeController", "Sensor", "SeparationMonitor", "Solver",
    "UnscentedEstimator", "Vehicle",
]  # fmt: skip
