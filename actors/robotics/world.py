"""The world around the robots' software: bodies that are driven or move by themselves, sensors, and a radio channel."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core import (
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    array_parameter,
    brief,
    counted,
    shaped,
)
from ..core.elementary import cos, hypot, sin
from .arrays import all_finite, floats
from .dynamics import DoubleIntegrator, Dynamics
from .messages import BodyState, Measurement, Observation, Plan, enclosing, state_of
from .own import covariance_of, numbers_of
from .receiving import PlaceParameter, latest
from .sensor_models import RANGE, RELATIVE_POSITION, SensorModel, root_of
from .sight import disturbed, is_hidden


class Vehicle(Actor):
    """A double integrator in the paper's discrete form: ``P += dt * V``, ``V += dt * U`` at every trigger.

    ``dt`` is the time since the last trigger and U the acceleration held over it.  A control that arrives at
    the time of a trigger acts from that time on, so the state sent there does not depend on it; one that
    arrives between two triggers acts from the next one.  Without a new control, the last one is held.  A control that
    is not finite is ignored.

    If its ``start`` has a height, it flies, and may climb and sink more slowly than it flies level: its velocity stays
    in the ellipsoid ``(vx^2 + vy^2) / max_speed^2 + vz^2 / climb_speed^2 <= 1``, and its acceleration in that of the
    other two limits; what leaves one is shortened in its direction.

    With other ``dynamics``, their ``step`` over dt moves it, and the controls are theirs.
    """

    trigger = InputPort(object, doc="moves to the present time and sends the state")
    acceleration = InputPort(np.ndarray, shape=(None,), triggers=False, doc="m/s^2, control to apply from now on")
    state = OutputPort(BodyState, depends_on=("trigger",), doc="position and velocity at this time")

    dynamics = Parameter(Dynamics, None, doc="how it moves; if left out, as a DoubleIntegrator with the limits below")
    start = PlaceParameter(doc="position at the first trigger; with the height last for a vehicle that flies")
    start_velocity = PlaceParameter(None, unit="m/s", doc="velocity at the first trigger; at rest if left out")
    max_speed = Parameter(float, 8.0, unit="m/s", min=0, doc="limit of the speed")
    max_acceleration = Parameter(float, 8.0, unit="m/s^2", min=0, doc="limit of the acceleration")
    climb_speed = Parameter(float, 4.0, unit="m/s", above=0, doc="in space, limit of the vertical speed, up and down")
    climb_acceleration = Parameter(
        float, 4.0, unit="m/s^2", above=0, doc="in space, limit of the vertical acceleration"
    )

    def check(self) -> None:
        count = len(self.start)
        if self.start_velocity is not None and len(self.start_velocity) != count:
            raise ParameterError(f"start_velocity: it has {len(self.start_velocity)} numbers, and 'start' has {count}")
        self._motion: Any = self.dynamics or DoubleIntegrator(
            dimensions=count,
            max_speed=self.max_speed,
            max_acceleration=self.max_acceleration,
            climb_speed=self.climb_speed,
            climb_acceleration=self.climb_acceleration,
        )
        name, d = type(self._motion).__name__, self._motion.dimensions
        if d != count:
            raise ParameterError(f"start: it has {count} numbers; expected {d} for a {name}")
        self._motion.try_out(floats(self.start))
        if self.start_velocity is not None and not isinstance(self._motion, DoubleIntegrator):
            raise ParameterError(f"start_velocity: a {name} starts as its parameters say; leave it out")
        self.acceleration.change("type", shaped(np.ndarray, (self._motion.controls,)))

    def initialize(self) -> None:
        motion, place = self._motion, floats(self.start)
        start = motion.at_rest(place) if self.start_velocity is None else (*place, *floats(self.start_velocity))
        self._state = motion.limited_state(start)
        self._held = self._next = (0.0,) * motion.controls
        self._moved_at: int | None = None

    def fire(self) -> None:
        now, motion = self.tag.time, self._motion
        if self.trigger.present:
            if self._moved_at is not None:
                self._state = motion.limited_state(motion.step(self._state, self._held, (now - self._moved_at) / 1e9))
            self._held = self._next
            self._moved_at = now
            self.state.send(motion.body(self._state, self.now))
        if self.acceleration.present and all_finite(wanted := floats(self.acceleration.value)):
            self._next = motion.limited_control(wanted)
            if self._moved_at == now:
                self._held = self._next


class CircularMotion(Actor):
    """A body on a circle of radius ``speed / turn_rate`` (Table III), computed from the time alone.

    The circle's centre lies to the left of the first heading: with the defaults, the body starts at the top of a circle
    around (12, 0) and turns counter-clockwise.
    """

    trigger = InputPort(object, doc="sends the state now")
    state = OutputPort(BodyState, doc="position and velocity at this time")

    start = array_parameter((2,), (12.0, 2.0), unit="m", doc="position at the start of the run")
    speed = Parameter(float, 1.26, unit="m/s", min=0, doc="constant speed")
    turn_rate = Parameter(float, 0.628, unit="rad/s", doc="positive turns left; 0 is a straight line")
    heading = Parameter(float, math.pi, unit="rad", doc="direction of motion at the start, from the x axis")

    def initialize(self) -> None:
        self._began = self.now

    def fire(self) -> None:
        now = self.now
        elapsed = now - self._began
        turned = self.turn_rate * elapsed
        # The chord of the arc travelled: correct for any turn rate, including 0.
        chord = self.speed * elapsed * _sinc(turned / (2.0 * math.pi))
        direction, heading = self.heading + turned / 2.0, self.heading + turned
        x, y = floats(self.start)
        position = x + chord * cos(direction), y + chord * sin(direction)
        velocity = self.speed * cos(heading), self.speed * sin(heading)
        self.state.send(BodyState(position, velocity, now))


def _sinc(x: float) -> float:
    """sin(pi x) / (pi x), 1 at 0; np.sinc takes 10 us for one number."""
    angle = math.pi * x
    return sin(angle) / angle if angle else 1.0


class Sensor(Actor):
    """Measures the target's relative position, or its distance, with normal noise (Table II).

    The noise of a relative position is an ellipse: ``along`` the true line of sight and ``across`` it; seen from a
    flying robot, it is an ellipsoid, as wide in both directions across.  All of its components are drawn at every
    firing, used or not, so that neither ``kind`` nor ``max_range`` nor ``occluders`` change the noise of later
    measurements.  A measurement has the time of the robot's own state, by the robot's own clock.

    Robot and target are on the ground, at height 0, unless their positions have a third number.  What hides the target
    stands on the ground: upright cylinders up to a height.  No line of sight goes through one, and a measurement behind
    it is not sent.

    With a ``model`` it measures what that says, and sends an ``Observation``, with errors of that model's covariance.
    """

    robot = InputPort(BodyState, doc="where the robot that carries the sensor is")
    location = InputPort(
        BodyState,
        required=False,
        doc="where the robot believes it is, used in the measurement; without a connection, where it is",
    )
    target = InputPort(BodyState, doc="where the target is")
    measurement = OutputPort(
        Measurement, doc="measurement, sent at tags where both are known, and the target is in range and in sight"
    )

    model = Parameter(SensorModel, None, doc="what is measured; if left out, 'kind' with its deviations")
    kind = Parameter(str, RELATIVE_POSITION, choices=(RELATIVE_POSITION, RANGE), doc="what is measured")
    along = Parameter(float, 0.2, unit="m", min=0, doc="standard deviation along the line of sight, sigma_d")
    across = Parameter(float, 2.0, unit="m", min=0, doc="standard deviation across the line of sight, sigma_b")
    max_range = Parameter(
        float, None, unit="m", min=0, doc="no measurement beyond this distance; unlimited if left out"
    )
    occluders = array_parameter(
        (None, 4), (), doc="cylinders that hide the target: x, y, radius and height of each, in m"
    )
    robot_name = Parameter(
        str, "", doc="name in the measurement; if empty, the path of the composite that contains the sensor"
    )

    def initialize(self) -> None:
        self._draw = self.random_stream("noise").standard_normal
        self._draw_upright = self.random_stream("upright noise").standard_normal  # of a flying robot
        self._draw_of_model = self.random_stream("noise of the model").standard_normal
        self._hidden_by = [tuple(each) for each in self.occluders.tolist()]
        self._name = self.robot_name or enclosing(self.path)

    def fire(self) -> None:
        error_along, error_across, error_upright = self._draw(), self._draw(), self._draw_upright()
        if not (self.robot.present and self.target.present):
            return
        robot = latest(self.robot)
        position = robot.position
        believed = latest(self.location).position if self.location.present else position
        # Floats: arithmetic on arrays of two takes ten times as long.
        there, here = floats(latest(self.target).position), floats(position)
        flies = len(here) > 2
        dx, dy, dz = there[0] - here[0], there[1] - here[1], 0.0
        distance = level = hypot(dx, dy)
        if flies or len(there) > 2:
            here, there = (*here, 0.0)[:3], (*there, 0.0)[:3]
            dz = there[2] - here[2]
            distance = hypot(level, dz)
        if self.max_range is not None and distance > self.max_range:
            return
        if self._hidden_by and is_hidden((*here, 0.0)[:3], (*there, 0.0)[:3], self._hidden_by):
            return
        if self.model is not None:
            self.measurement.send(self._observed(robot, latest(self.location) if self.location.present else robot))
            return
        along, across = self.along * error_along, self.across * error_across
        if self.kind == RANGE:
            value: tuple[float, ...] = (distance + along,)
        else:
            offset = (dx, dy, dz) if flies else (dx, dy)
            value = disturbed(offset, level, distance, along, across, self.across * error_upright)
        self.measurement.send(Measurement(self._name, believed, self.kind, value, self.along, self.across, robot.time))

    def _observed(self, robot: BodyState, believed: BodyState) -> Observation:
        """What the model says, with an error of its covariance."""
        model: Any = self.model
        body = latest(self.target)
        target, observer = [*floats(body.position), *floats(body.velocity)], state_of(robot)
        value = numbers_of(model, "h", model.h(target, observer))
        root = root_of(covariance_of(model, "noise", model.noise(target, observer), len(value)))
        drawn = [self._draw_of_model() for _ in value]
        for i, row in enumerate(root):
            for k in range(i + 1):
                value[i] += row[k] * drawn[k]
        kind = type(model).__name__
        return Observation(self._name, believed.position, kind, value, 0.0, 0.0, robot.time, model, state_of(believed))


class ChannelError(EpicycleError):
    """The ends of a broadcast channel do not match."""


class BroadcastChannel(Actor):
    """Passes the messages of each participant to all the others.

    The n-th connection into ``input`` and the n-th out of ``output`` belong to the same participant.
    """

    input = InputPort(Any, multi=True, doc="messages from each participant")
    output = OutputPort(Any, multi=True, doc="to each participant, the messages of the others")

    def initialize(self) -> None:
        if self.input.width != self.output.width:
            raise ChannelError(
                f"{self.path} has {counted(self.input.width, 'connection')} into 'input' "
                f"but {self.output.width} out of 'output'; "
                "connect both once for each participant, in the same order"
            )

    def fire(self) -> None:
        send, listeners = self.output.send, range(self.output.width)
        for speaker, token in self.input.arrivals():
            for listener in listeners:
                if listener != speaker:
                    send(token, listener)


class Flooding(Actor):
    """Sends the messages of its robot, and repeats those of others for the robots that are out of their reach.

    A message is repeated once: its ``time`` serves as a sequence number, and only a message later than all earlier ones
    of the same robot passes.  Messages that are not finite are dropped.
    """

    own = InputPort(Any, doc="plans or measurements of this robot")
    heard = InputPort(
        Any, multi=True, required=False, doc="plans or measurements of other robots, sent or repeated by any of them"
    )
    output = OutputPort(Any, doc="the messages that this robot sends")

    def initialize(self) -> None:
        self._latest: dict[str, float] = {}  # the time of the latest message of each robot

    def fire(self) -> None:
        for message in (*self.own.tokens, *self.heard.tokens):
            if not isinstance(message, (Measurement, Plan)):
                raise EpicycleError(f"{self.path} takes plans and measurements, not {brief(message)}")
            if message.finite and message.time > self._latest.get(message.robot, -math.inf):
                self._latest[message.robot] = message.time
                self.output.send(message)
