"""Weather: a thermometer, and ice on it."""

from __future__ import annotations

from typing import ClassVar

from epicycle.actors import Actor, InputPort, OutputPort, Parameter
from epicycle.aspects import JoinPoint, MeasurementAspect


class Thermometer(Actor):
    """Measures a temperature that rises evenly."""

    trigger = InputPort(object, doc="measure now")
    temperature = OutputPort(float, doc="in K")

    start = Parameter(float, 280.0, unit="K", min=0.0, doc="temperature at the start")
    rise = Parameter(float, 1.0, unit="K/s", doc="how fast it rises")

    def fire(self) -> None:
        self.temperature.send(self.start + self.rise * self.now)


class Icing(MeasurementAspect):
    """Keeps a thermometer from showing less than the freezing point of water."""

    events: ClassVar[tuple[str, ...]] = ("frozen",)
    freezing = Parameter(float, 273.15, unit="K", min=0.0, doc="what it shows at least")

    def pass_token(self, token: float, point: JoinPoint) -> None:
        if token < self.freezing:
            point.act("frozen", token)
        point.forward(max(token, self.freezing))
