"""Robots that observe and avoid a moving obstacle: bodies, sensors, estimators, controllers, messages."""

from .controller import FlyingController, RobustController
from .estimator import UnscentedEstimator
from .filterpy_estimator import FilterError, FilterPyEstimator
from .messages import BodyState, Estimate, Measurement, Plan
from .monitors import DistanceMonitor, GoalMonitor, SeparationMonitor
from .planning import Barrier, Casadi, Inform, Objective, ReachGoal, Solver
from .world import BroadcastChannel, ChannelError, CircularMotion, FlyingVehicle, Sensor, Vehicle

__all__ = [
    "Barrier", "BodyState", "BroadcastChannel", "Casadi", "ChannelError", "CircularMotion", "DistanceMonitor",
    "Estimate", "FilterError", "FilterPyEstimator", "FlyingController", "FlyingVehicle", "GoalMonitor", "Inform",
    "Measurement", "Objective", "Plan", "ReachGoal", "RobustController", "Sensor", "SeparationMonitor", "Solver",
    "UnscentedEstimator", "Vehicle",
]  # fmt: skip
