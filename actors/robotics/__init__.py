"""Robots that observe and avoid a moving obstacle: bodies, sensors, estimators, controllers, messages."""

from . import symbolic
from .controller import RobustController
from .detecting import MultiTargetSensor
from .dynamics import DoubleIntegrator, Dynamics
from .estimator import Estimator, ExtendedEstimator, UnscentedEstimator
from .filterpy_estimator import FilterError, FilterPyEstimator
from .integrated_ou import IntegratedOUEstimator
from .messages import (
    BodyState,
    Detections,
    Estimate,
    Measurement,
    MotionState,
    Observation,
    Plan,
    SampledEstimate,
    Tracks,
)
from .monitors import ClearanceMonitor, DistanceMonitor, GoalMonitor, SeparationMonitor
from .motion import WaypointMotion
from .particle_estimator import ParticleEstimator
from .planning import (
    Barrier,
    Casadi,
    Inform,
    ReachGoal,
    Solver,
    StayNear,
)
from .problem import Beliefs, Objective, Problem, Trajectory
from .safe_controller import SafeController
from .sensor_models import SensorModel
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
    "Barrier", "Beliefs", "BodyState", "BroadcastChannel", "Casadi", "ChannelError", "CircularMotion",
    "ClearanceMonitor", "Detections", "DistanceMonitor", "DoubleIntegrator", "Dynamics", "Estimate", "Estimator",
    "ExtendedEstimator", "FilterError", "FilterPyEstimator", "Flooding", "GoalMonitor", "Inform",
    "IntegratedOUEstimator", "JPDATracker", "Measurement", "MotionState", "MultiTargetSensor", "Objective",
    "Observation", "ParticleEstimator", "Plan", "Problem", "ReachGoal", "RobustController", "SafeController",
    "SampledEstimate", "Sensor", "SensorModel", "SeparationMonitor", "Solver", "StayNear", "TrackingError", "Tracks",
    "Trajectory", "UnscentedEstimator", "Vehicle", "WaypointMotion", "symbolic",
]  # fmt: skip
