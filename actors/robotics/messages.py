"""The tokens that robots and their parts exchange.  All are immutable; their arrays are read-only.

Vectors have d numbers: two in the plane, and three in space, with the height above the plane last.

Each has the ``time`` (s) of what it describes, not of when it was sent or received.  The source sets it, and users of
the token rely on it, however long it was on the way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .arrays import Array, floats
from .sensor_models import RANGE, SensorModel, model_of
from .tokens import Numbers, Token, array, part, token


@token()
class BodyState(Token):
    """Position and velocity of a body at ``time``."""

    position: Numbers = array("d")  # m
    velocity: Numbers = array("d")  # m/s
    time: float  # s


@token()
class MotionState(BodyState):
    """The whole state of a robot with another ``Dynamics`` than the paper's.  It is also a ``BodyState``."""

    rest: Numbers = array("n")  # the numbers of its state after the position


@token(RANGE=RANGE)
class Measurement(Token):
    """A measurement of the target by a robot's sensor at ``time``, with all data to fuse it elsewhere and later."""

    robot: str  # dotted path of the measuring robot
    observer: Numbers = array("d")  # m, where the sensor was
    kind: str  # "relative_position" or "range"
    value: Numbers = array("1 if self.kind == RANGE else d")  # m from observer to target
    along: float  # standard deviation along the line of sight, m
    across: float  # standard deviation across it, m; not used for a range
    time: float  # s, when it was made

    def usable(self) -> bool:
        """Whether the deviations are those of a sensor."""
        return 0.0 < self.along < math.inf and (self.kind == RANGE or 0.0 < self.across < math.inf)

    @property
    def sensor(self) -> SensorModel:
        """What the sensor measures."""
        return model_of(self.kind, self.along, self.across)

    @property
    def seen_from(self) -> Array:
        """The observer as the sensor's model takes it."""
        return self.observer

    def expected(self, target: Sequence[float]) -> Sequence[float]:
        """What would be measured without noise if the state of the target (2 d) were this one."""
        return self.sensor.h(target, floats(self.seen_from))

    def noise(self, target: Sequence[float]) -> Sequence[Sequence[float]]:
        """The covariance of the measurement if the state of the target were this one."""
        return self.sensor.noise(target, floats(self.seen_from))

    def innovation(self, target: Sequence[float]) -> Sequence[float]:
        """What was measured, minus what is expected of a state of the target."""
        return self.sensor.difference(floats(self.value), self.expected(target))


@token()
class Observation(Measurement):
    """A ``Measurement`` by a ``SensorModel``, whose name is its kind; it goes along, so that any filter can fuse it."""

    value: Numbers = array("n")  # as many numbers as the model has
    model: SensorModel
    state: Numbers = array("n")  # of the robot, as the model takes it

    def usable(self) -> bool:
        """All that is said of the noise is in the model."""
        return True

    @property
    def sensor(self) -> SensorModel:
        """What the sensor measures."""
        return self.model

    @property
    def seen_from(self) -> Array:
        """The state of the robot."""
        return self.state


@token(RANGE=RANGE)
class Detections(Token):
    """One scan of a sensor that does not know which body it sees, with all data to fuse it elsewhere and later."""

    robot: str  # dotted path of the measuring robot
    observer: Numbers = array("d")  # m, where the sensor was
    kind: str  # "relative_position" or "range"
    values: Numbers = array("n", "1 if self.kind == RANGE else d")  # m from observer to what was detected; n may be 0
    along: float  # standard deviation along the line of sight, m
    across: float  # standard deviation across it, m; not used for a range
    probability: float  # of detecting a body in range
    clutter: float  # expected number of false detections in a scan
    max_range: float  # m
    time: float  # s, when it was made

    def usable(self) -> bool:
        """Whether the numbers are those of a sensor."""
        return (
            0.0 < self.along < math.inf
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


@token()
class Estimate(Token):
    """A robot's estimate of the target at ``time``: a normal distribution over (x, y, vx, vy), or six in space."""

    mean: Numbers = array("2 * d")  # m and m/s
    covariance: Numbers = array("2 * d", "2 * d")
    time: float  # s
    sources: tuple[str, ...] = ()  # robots whose measurements were fused at this step, sorted


@token()
class SampledEstimate(Estimate):
    """An ``Estimate`` that is more than a normal distribution: samples of the state, with their weights.

    ``Inform`` takes the information that measurements give about them.
    """

    samples: Numbers = array("n > 0", "2 * d", kw_only=True)
    weights: Numbers = array("len(self.samples)", kw_only=True)  # of the samples; together 1

    def usable(self) -> bool:
        """Whether no weight is negative."""
        return min(floats(self.weights)) >= 0.0


@token()
class Tracks(Token):
    """A robot's estimates of several targets at ``time``, each with the number of its track."""

    numbers: tuple[int, ...]  # rising; a number is given once
    estimates: tuple[Estimate, ...] = part(several=True)
    time: float  # s


@token()
class Plan(Token):
    """A robot's plan: its state at ``time`` and its accelerations from then on, one per period."""

    robot: str  # dotted path of the robot
    time: float  # s, that of ``state``
    state: BodyState = part()
    controls: Numbers = array("n > 0", "d")  # m/s^2: the one being applied now, then the planned ones


def state_of(body: BodyState) -> list[float]:
    """The state of a robot as a ``SensorModel`` takes it: its position and what else its token tells."""
    if isinstance(body, MotionState):
        return [*floats(body.position), *floats(body.rest)]
    heading = getattr(body, "heading", None)
    return [*floats(body.position), *(floats(body.velocity) if heading is None else (heading,))]


def enclosing(path: str) -> str:
    """The dotted path of the composite that contains an actor: the robot, for a part of it; at the top, the actor's own
    path."""
    return path.rpartition(".")[0] or path
