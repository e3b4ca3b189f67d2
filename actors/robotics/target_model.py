"""What robots assume of the target's motion, eq. (1)."""

from __future__ import annotations

import numpy as np

from ..core import Configurable, Parameter
from .messages import Array


class TargetModel(Configurable):
    """The parameters that a filter and whoever looks ahead from its estimates have in common."""

    position_noise = Parameter(float, 0.002, unit="m^2", min=0, doc="Qp: variance a position gains in one period")
    velocity_noise = Parameter(
        float,
        0.4,
        unit="m^2/s^2",
        min=0,
        doc="Qv: variance a velocity gains in one period; Table II's 0.004 is in (m per 0.1 s)^2",
    )
    kappa = Parameter(float, 0.0, unit="1", min=0, doc="spread of the 9 sigma points; 0 gives the centre no weight")

    @property
    def process_noise(self) -> Array:
        """The covariance (4, 4) that the state (x, y, vx, vy) gains in one period."""
        return np.diag([self.position_noise] * 2 + [self.velocity_noise] * 2)
