"""Listeners to what leaves a port: the recorder of a signal, and metrics."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from epicycle.actors import Receiver

if TYPE_CHECKING:
    from ..results import Samples
    from .director import Director
    from .measurement import Measurement


class Recording(Receiver):
    """Appends tokens to a signal."""

    __slots__ = ("director", "samples")

    def __init__(self, samples: Samples, director: Director) -> None:
        self.samples = samples
        self.director = director

    def put(self, token: Any) -> None:
        now = self.director.now()
        self.samples.add(now.time, now.microstep, token)


class Measuring(Receiver):
    """Passes the tokens of a port to a metric."""

    __slots__ = ("director", "measurement", "port")

    def __init__(self, measurement: Measurement, port: str, director: Director) -> None:
        self.measurement = measurement
        self.port = port
        self.director = director

    def put(self, token: Any) -> None:
        self.measurement.add(self.port, self.director.now().time, token)
