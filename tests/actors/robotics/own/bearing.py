"""A camera: it sees where the target is, and not how far."""

from typing import Any

from epicycle.actors import Parameter, SensorModel, elementary


class Bearing(SensorModel):
    """The direction of the target, from the x axis to the left."""

    deviation = Parameter(float, 0.05, unit="rad", above=0, doc="standard deviation")

    def h(self, target: Any, observer: Any) -> Any:
        return [elementary.atan2(target[1] - observer[1], target[0] - observer[0])]

    def noise(self, target: Any, observer: Any) -> Any:
        return [[self.deviation * self.deviation]]

    def difference(self, one: Any, other: Any) -> Any:
        return [elementary.atan2(elementary.sin(one[0] - other[0]), elementary.cos(one[0] - other[0]))]
