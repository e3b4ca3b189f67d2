"""A car, for the controllers and vehicles of Epicycle."""

from typing import Any

from epicycle.actors import Dynamics, Parameter, symbolic


class Bicycle(Dynamics):
    """The kinematic bicycle: states (x, y, heading, speed), controls (acceleration, steering)."""

    wheelbase = Parameter(float, 1.5, unit="m", above=0, doc="distance between the axles")
    heading = Parameter(float, 0.0, unit="rad", doc="heading at the start")
    max_speed = Parameter(float, 8.0, unit="m/s", above=0, doc="largest speed")
    max_acceleration = Parameter(float, 4.0, unit="m/s^2", above=0, doc="largest acceleration, and deceleration")
    max_steering = Parameter(float, 0.5, unit="rad", above=0, max=1.5, doc="largest angle of the front wheels")

    def at_rest(self, place: Any) -> Any:
        return [*place, self.heading, 0.0]

    def step(self, state: Any, control: Any, period: float) -> Any:
        x, y, heading, speed = state
        acceleration, steering = control
        return [
            x + period * speed * symbolic.cos(heading),
            y + period * speed * symbolic.sin(heading),
            heading + period * speed * symbolic.tan(steering) / self.wheelbase,
            speed + period * acceleration,
        ]

    def velocity(self, state: Any) -> Any:
        return [state[3] * symbolic.cos(state[2]), state[3] * symbolic.sin(state[2])]

    def state_limits(self, state: Any) -> Any:
        return [state[3] - self.max_speed, -2.0 - state[3]]

    def control_limits(self, control: Any) -> Any:
        acceleration, steering = control
        return [
            acceleration - self.max_acceleration,
            -self.max_acceleration - acceleration,
            steering - self.max_steering,
            -self.max_steering - steering,
        ]

    def braking(self, state: Any, period: float) -> Any:
        most = 0.95 * self.max_acceleration
        return [max(-most, min(most, -state[3] / period)), 0.0]
