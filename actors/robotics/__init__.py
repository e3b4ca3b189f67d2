"""Robots that observe and avoid a moving obstacle: bodies, sensors, estimators, controllers, messages."""

from .channel import BroadcastChannel, ChannelError
from .controller import RobustController
from .estimator import UnscentedEstimator
from .filterpy_estimator import FilterError, FilterPyEstimator
from .messages import BodyState, Estimate, Measurement, Plan
from .monitors import DistanceMonitor, GoalMonitor, SeparationMonitor
from .objectives import Inform, Objective, ReachGoal
from .obstacle import CircularMotion
from .sensor import Sensor
from .solvers import Barrier, Casadi, Solver
from .vehicle import Vehicle

__all__ = [
    "Barrier", "BodyState", "BroadcastChannel", "Casadi", "ChannelError", "CircularMotion", "DistanceMonitor",
    "Estimate", "FilterError", "FilterPyEstimator", "GoalMonitor", "Inform", "Measurement", "Objective", "Plan",
    "ReachGoal", "RobustController", "Sensor", "SeparationMonitor", "Solver", "UnscentedEstimator", "Vehicle",
]  # fmt: skip
