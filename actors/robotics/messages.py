"""The tokens that robots and their parts exchange.  All are immutable; their arrays are read-only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

RELATIVE_POSITION = "relative_position"
RANGE = "range"


def _keep(token: object, **arrays: ArrayLike) -> None:
    """Store read-only float copies in a frozen token."""
    for name, value in arrays.items():
        array = np.array(value, dtype=np.float64)
        array.flags.writeable = False
        object.__setattr__(token, name, array)


@dataclass(frozen=True, slots=True, eq=False)
class BodyState:
    """Where a body is and how it moves."""

    position: Array  # (2,) m
    velocity: Array  # (2,) m/s

    def __post_init__(self) -> None:
        _keep(self, position=self.position, velocity=self.velocity)

    @property
    def finite(self) -> bool:
        """Whether every number in it is finite."""
        return bool(np.isfinite(self.position).all() and np.isfinite(self.velocity).all())


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """What a robot's sensor saw of the target, with what is needed to fuse it elsewhere."""

    robot: str  # dotted path of the robot that measured
    observer: Array  # (2,) m, where the sensor was
    kind: str  # "relative_position" or "range"
    value: Array  # (2,) m from observer to target, or (1,) m
    along: float  # standard deviation along the line of sight, m
    across: float  # standard deviation across it, m; no part of a range

    def __post_init__(self) -> None:
        _keep(self, observer=self.observer, value=self.value)

    @property
    def finite(self) -> bool:
        """Whether it can be fused: finite values of the shape that its kind asks for, positive deviations."""
        shape = (1,) if self.kind == RANGE else (2,)
        return bool(
            self.value.shape == shape
            and np.isfinite(self.value).all()
            and np.isfinite(self.observer).all()
            and 0.0 < self.along < np.inf
            and (self.kind == RANGE or 0.0 < self.across < np.inf)
        )


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """What a robot believes about the target: a normal distribution over (x, y, vx, vy)."""

    mean: Array  # (4,) m and m/s
    covariance: Array  # (4, 4)
    sources: tuple[str, ...] = ()  # robots whose measurements were fused at this step, sorted

    def __post_init__(self) -> None:
        _keep(self, mean=self.mean, covariance=self.covariance)

    @property
    def finite(self) -> bool:
        """Whether every number in it is finite."""
        return bool(np.isfinite(self.mean).all() and np.isfinite(self.covariance).all())


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What a robot intends: its state at ``time`` and its accelerations from then on, one per period."""

    robot: str  # dotted path of the robot
    time: float  # s
    state: BodyState
    controls: Array  # (N + 1, 2) m/s^2: the one being applied now, then the planned ones

    def __post_init__(self) -> None:
        _keep(self, controls=self.controls)

    @property
    def finite(self) -> bool:
        """Whether it can be rolled out: finite numbers, one control at least."""
        controls = self.controls
        shaped = controls.ndim == 2 and controls.shape[1] == 2 and len(controls) > 0
        return bool(shaped and np.isfinite(controls).all() and np.isfinite(self.time) and self.state.finite)


def enclosing(path: str) -> str:
    """The dotted path of what an actor stands in: the robot, for a part of it; its own path at the top."""
    return path.rpartition(".")[0] or path
