"""An objective: keep the target in sight."""

from typing import Any

from epicycle.actors import Objective, Parameter, array_parameter, symbolic


class KeepSight(Objective):
    """Stay at a distance of the target, with no pillar between it and the robot."""

    pillars = array_parameter((None, 3), doc="x, y and radius of each, in m")
    away = Parameter(float, 6.0, unit="m", above=0, doc="the distance")

    def cost(self, trajectory: Any, beliefs: Any) -> Any:
        total = 0.0
        for target in beliefs.targets:
            for robot, there in zip(trajectory.positions, target, strict=True):
                way, far = there - robot, symbolic.norm(there - robot)
                total += (far - self.away) * (far - self.away)
                for x, y, radius in self.pillars.tolist():
                    beside = (way[0] * (y - robot[1]) - way[1] * (x - robot[0])) / far
                    inside = trajectory.positive(1.5 * radius - symbolic.norm([beside]))
                    total += 50.0 * inside * inside
        return total
