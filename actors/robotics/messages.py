"""The tokens that robots and their parts exchange.  All are immutable; their arrays are read-only.

Vectors have two numbers in the plane, and three in space, with the height above the plane last.

Each has the ``time`` (s) of what it describes, not of when it was sent or received.  The source sets it, and users of
the token rely on it, however long it was on the way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

from numpy.typing import ArrayLike

from ..core.tag import LATEST, to_seconds
from .arrays import Array, finite, read_only

RELATIVE_POSITION = "relative_position"
RANGE = "range"

_LATEST = to_seconds(LATEST)
_set = object.__setattr__  # in a frozen token; each has its own __init__, as the dataclass's would set arrays twice


SHAPES = (2,), (3,)  # of a vector
Shape: TypeAlias = tuple[int | str, ...]  # of an array; a text is a length that may vary
ANY, SOME = "n", "n > 0"


def is_time(seconds: float) -> bool:
    """Whether a number is a valid time."""
    return abs(seconds) <= _LATEST


@dataclass(frozen=True, slots=True, eq=False, init=False)
class BodyState:
    """Position and velocity of a body at ``time``."""

    position: Array  # (d,) m; d = 2 or 3
    velocity: Array  # (d,) m/s
    time: float  # s

    def __init__(self, position: ArrayLike, velocity: ArrayLike, time: float) -> None:
        _set(self, "position", read_only(position))
        _set(self, "velocity", read_only(velocity))
        _set(self, "time", time)

    def shapes(self, dimensions: int) -> tuple[tuple[str, Array, Shape], ...]:
        """Each array with its name, and the shape that it should have."""
        return ("position", self.position, (dimensions,)), ("velocity", self.velocity, (dimensions,))

    @property
    def finite(self) -> bool:
        """Whether it has as many numbers as it should, and every one is finite."""
        shaped = self.position.shape in SHAPES and self.velocity.shape == self.position.shape
        return shaped and is_time(self.time) and finite(self.position) and finite(self.velocity)


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Measurement:
    """A measurement of the target by a robot's sensor at ``time``, with all data to fuse it elsewhere and later."""

    robot: str  # dotted path of the measuring robot
    observer: Array  # (d,) m, where the sensor was
    kind: str  # "relative_position" or "range"
    value: Array  # (d,) m from observer to target, or (1,) m
    along: float  # standard deviation along the line of sight, m
    across: float  # standard deviation across it, m; not used for a range
    time: float  # s, when it was made

    def __init__(
        self, robot: str, observer: ArrayLike, kind: str, value: ArrayLike, along: float, across: float, time: float
    ) -> None:
        _set(self, "robot", robot)
        _set(self, "observer", read_only(observer))
        _set(self, "kind", kind)
        _set(self, "value", read_only(value))
        _set(self, "along", along)
        _set(self, "across", across)
        _set(self, "time", time)

    def shapes(self, dimensions: int) -> tuple[tuple[str, Array, Shape], ...]:
        """Each array with its name, and the shape that it should have."""
        length = 1 if self.kind == RANGE else dimensions
        return ("observer", self.observer, (dimensions,)), ("value", self.value, (length,))

    @property
    def finite(self) -> bool:
        """Whether it can be fused: finite values of the shape for its kind, and positive deviations."""
        shape = (1,) if self.kind == RANGE else self.observer.shape
        return (
            self.observer.shape in SHAPES
            and self.value.shape == shape
            and is_time(self.time)
            and finite(self.value)
            and finite(self.observer)
            and 0.0 < self.along < math.inf
            and (self.kind == RANGE or 0.0 < self.across < math.inf)
        )


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Detections:
    """One scan of a sensor that does not know which body it sees, with all data to fuse it elsewhere and later."""

    robot: str  # dotted path of the measuring robot
    observer: Array  # (2,) m, where the sensor was
    kind: str  # "relative_position" or "range"
    values: Array  # (m, 2) m from observer to whatever was detected, or (m, 1) m; m may be 0
    along: float  # standard deviation along the line of sight, m
    across: float  # standard deviation across it, m; not used for a range
    probability: float  # of detecting a body in range
    clutter: float  # expected number of false detections in a scan
    max_range: float  # m
    time: float  # s, when it was made

    def __init__(
        self, robot: str, observer: ArrayLike, kind: str, values: ArrayLike, along: float, across: float,
        probability: float, clutter: float, max_range: float, time: float,
    ) -> None:  # fmt: skip
        _set(self, "robot", robot)
        _set(self, "observer", read_only(observer))
        _set(self, "kind", kind)
        _set(self, "values", read_only(values))
        _set(self, "along", along)
        _set(self, "across", across)
        _set(self, "probability", probability)
        _set(self, "clutter", clutter)
        _set(self, "max_range", max_range)
        _set(self, "time", time)

    def shapes(self, dimensions: int) -> tuple[tuple[str, Array, Shape], ...]:
        """Each array with its name, and the shape that it should have."""
        length = 1 if self.kind == RANGE else dimensions
        return ("observer", self.observer, (dimensions,)), ("values", self.values, (ANY, length))

    @property
    def finite(self) -> bool:
        """Whether it can be fused: finite values of the shape for its kind, and numbers that describe a sensor."""
        return (
            self.observer.shape == (2,)
            and self.values.ndim == 2
            and self.values.shape[1] == (1 if self.kind == RANGE else 2)
            and is_time(self.time)
            and finite(self.values)
            and finite(self.observer)
            and 0.0 < self.along < math.inf
            and (self.kind == RANGE or 0.0 < self.across < math.inf)
            and 0.0 <= self.probability <= 1.0
            and 0.0 <= self.clutter < math.inf
            and 0.0 < self.max_range < math.inf
        )

    @property
    def clutter_density(self) -> float:
        """Expected number of false detections per m^2, or per m of range."""
        space = self.max_range if self.kind == RANGE else math.pi * self.max_range * self.max_range
        return self.clutter / space


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Estimate:
    """A robot's estimate of the target at ``time``: a normal distribution over (x, y, vx, vy), or six in space."""

    mean: Array  # (2 d,) m and m/s
    covariance: Array  # (2 d, 2 d)
    time: float  # s
    sources: tuple[str, ...]  # robots whose measurements were fused at this step, sorted

    def __init__(self, mean: ArrayLike, covariance: ArrayLike, time: float, sources: tuple[str, ...] = ()) -> None:
        _set(self, "mean", read_only(mean))
        _set(self, "covariance", read_only(covariance))
        _set(self, "time", time)
        _set(self, "sources", sources)

    def shapes(self, dimensions: int) -> tuple[tuple[str, Array, Shape], ...]:
        """Each array with its name, and the shape that it should have."""
        size = 2 * dimensions
        return ("mean", self.mean, (size,)), ("covariance", self.covariance, (size, size))

    @property
    def finite(self) -> bool:
        """Whether it has as many numbers as it should, and every one is finite."""
        size = self.mean.size
        shaped = size in (4, 6) and self.mean.shape == (size,) and self.covariance.shape == (size, size)
        return shaped and is_time(self.time) and finite(self.mean) and finite(self.covariance)


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Tracks:
    """A robot's estimates of several targets at ``time``, each with the number of its track."""

    numbers: tuple[int, ...]  # rising; a number is given once
    estimates: tuple[Estimate, ...]
    time: float  # s

    def __init__(self, numbers: tuple[int, ...], estimates: tuple[Estimate, ...], time: float) -> None:
        _set(self, "numbers", numbers)
        _set(self, "estimates", estimates)
        _set(self, "time", time)

    def shapes(self, dimensions: int) -> tuple[tuple[str, Array, Shape], ...]:
        """Each array with its name, and the shape that it should have."""
        return tuple(
            (f"estimates[{place}].{name}", array, shape)
            for place, estimate in enumerate(self.estimates)
            for name, array, shape in estimate.shapes(dimensions)
        )

    @property
    def finite(self) -> bool:
        """Whether every number in it is finite."""
        return is_time(self.time) and all(each.finite for each in self.estimates)


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Plan:
    """A robot's plan: its state at ``time`` and its accelerations from then on, one per period."""

    robot: str  # dotted path of the robot
    time: float  # s, that of ``state``
    state: BodyState
    controls: Array  # (N + 1, d) m/s^2: the one being applied now, then the planned ones

    def __init__(self, robot: str, time: float, state: BodyState, controls: ArrayLike) -> None:
        _set(self, "robot", robot)
        _set(self, "time", time)
        _set(self, "state", state)
        _set(self, "controls", read_only(controls))

    def shapes(self, dimensions: int) -> tuple[tuple[str, Array, Shape], ...]:
        """Each array with its name, and the shape that it should have."""
        state = tuple((f"state.{name}", array, shape) for name, array, shape in self.state.shapes(dimensions))
        return (*state, ("controls", self.controls, (SOME, dimensions)))

    @property
    def finite(self) -> bool:
        """Whether it can be rolled out: finite numbers, and at least one control."""
        controls = self.controls
        shaped = controls.ndim == 2 and controls.shape[1:] == self.state.position.shape and len(controls) > 0
        return shaped and is_time(self.time) and finite(controls) and self.state.finite


def enclosing(path: str) -> str:
    """The dotted path of the composite that contains an actor: the robot, for a part of it; at the top, the actor's own
    path."""
    return path.rpartition(".")[0] or path
