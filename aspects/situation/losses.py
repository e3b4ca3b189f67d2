"""Messages and measurements that are lost by where bodies are and who they are."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable
from typing import Any, ClassVar

from epicycle.actors import Parameter, elementary

from ..core import CommunicationAspect, GroupsParameter, JoinPoint, LossAspect, MeasurementAspect, PortsParameter
from .bodies import Position, SenderParameter, SituatedLoss, distance_to_line, ports_of, position_of, sender_of


class RangeLoss(SituatedLoss, CommunicationAspect):
    """Drops messages that come from afar: log-distance path loss with log-normal shadowing.

    At the distance d from sender to receiver the received power is 10 * exponent * log10(range / d) + X dB above what
    the receiver needs, with X ~ N(0, shadowing^2); below 0 dB the message is lost.  So the loss at d is
    Phi(10 * exponent * log10(d / range) / shadowing): half of the messages at ``range``, and a sharp edge there without
    shadowing.  X is new for every message, or with ``correlation`` changes as the two ends move: from one message to
    the next over this way by rho = exp(-moved / correlation), moved being the metres that both moved together.
    Before the places of both are known, messages pass.  Event: ``dropped``.  Source: Rappaport, Wireless
    Communications, 2nd ed., section 4.9; correlation: Gudmundson, Electronics Letters 27, 1991.
    """

    sender = SenderParameter()
    range = Parameter(float, min=1e-9, unit="m", doc="distance at which half of the messages are lost")
    exponent = Parameter(
        float, 3.0, min=0.0, unit="1", doc="path-loss exponent: 2 in free space, 3 to 5 around obstacles"
    )
    shadowing = Parameter(float, 4.0, min=0.0, unit="1", doc="standard deviation of the received power, in dB")
    correlation: Parameter[float | None] = Parameter(
        float, None, min=1e-9, unit="m", doc="way over which shadowing changes; none: from message to message"
    )

    def loses(self, token: Any, point: JoinPoint) -> bool:
        draw = point.random.standard_normal()
        sender = self.body(sender_of(token, self.sender, point), point)
        here, there = position_of(sender, point), position_of(self.body(point.owner, point), point)
        if here is None or there is None:
            return False
        if self.correlation is not None:
            draw = self._correlated(draw, here + there, point.memory.setdefault("links", {}), sender)
        distance = elementary.distance(here, there)
        margin = math.inf if distance == 0.0 else 10.0 * self.exponent * elementary.log10(self.range / distance)
        return bool(margin + self.shadowing * draw < 0.0)

    def _correlated(self, draw: float, ends: Position, links: dict[str, tuple[float, Position]], sender: str) -> float:
        """A standard normal number that has to do with the last one of this link."""
        assert self.correlation is not None
        if sender in links:
            last, before = links[sender]
            half = len(ends) // 2
            moved = elementary.distance(ends[:half], before[:half]) + elementary.distance(ends[half:], before[half:])
            rho = elementary.exp(-moved / self.correlation)
            draw = rho * last + math.sqrt(1.0 - rho * rho) * draw
        links[sender] = draw, ends
        return draw


class _SightLoss(SituatedLoss, MeasurementAspect):
    """A sensor, where the body is to which it belongs, and its target: write ``hides``."""

    target = PortsParameter(single=True, doc="output port that sends where the target is")

    @abstractmethod
    def hides(self, sensor: Position, target: Position, others: Iterable[Position]) -> bool:
        """Whether the sensor does not see the target; ``others`` are where all other bodies are."""

    def loses(self, token: Any, point: JoinPoint) -> bool:
        own, targets = self.body(point.owner, point), ports_of(point, "target")
        sensor, target = position_of(own, point), next((position_of(port, point) for port in targets), None)
        if sensor is None or target is None:
            return False
        others = (position_of(port, point) for port in ports_of(point, "positions") if port not in (own, *targets))
        return self.hides(sensor, target, (place for place in others if place is not None))


class OutOfRange(_SightLoss):
    """Lets measurements fail while the target is farther away than the sensor sees.

    The sensor is where the body is to which it belongs.  Before both places are known, measurements pass.  It is to
    measurements what a ``RangeLoss`` without shadowing is to messages.  Event: ``failed``.
    """

    events: ClassVar[tuple[str, ...]] = ("failed",)

    range = Parameter(float, min=0.0, unit="m", doc="greatest distance that can be measured")

    def hides(self, sensor: Position, target: Position, others: Iterable[Position]) -> bool:
        return elementary.distance(sensor, target) > self.range


class Occlusion(_SightLoss):
    """Lets measurements fail while another body stands in the line of sight.

    Every body that ``positions`` names but the sensor's own and the target is opaque within ``radius``: it occludes
    what it is nearer to than that, of the straight line from sensor to target.  Event: ``occluded``.
    """

    events: ClassVar[tuple[str, ...]] = ("occluded",)

    radius = Parameter(float, min=0.0, unit="m", doc="radius of the bodies; 0 occludes nothing")

    def hides(self, sensor: Position, target: Position, others: Iterable[Position]) -> bool:
        return any(distance_to_line(place, sensor, target) < self.radius for place in others)


class Outage(LossAspect, CommunicationAspect):
    """Cuts a network in parts: drops every message from a member of one group to a member of another alone.

    Who is in several groups talks with all of them; who is in none hears, and is heard by, everybody.  ``from``,
    ``until`` and ``every`` say when.  Event: ``dropped``.
    """

    sender = SenderParameter()
    groups = GroupsParameter(doc="the parts: {name: [actors or composites, as patterns], ...}")

    def loses(self, token: Any, point: JoinPoint) -> bool:
        sender = self._groups_of(sender_of(token, self.sender, point), point)
        receiver = self._groups_of(point.owner, point)
        return bool(sender and receiver and not sender & receiver)

    def _groups_of(self, path: str, point: JoinPoint) -> frozenset[str]:
        """The groups that an actor or composite, or what it stands in, belongs to."""
        known: dict[str, frozenset[str]] = point.memory.setdefault("groups", {})
        if path not in known:
            segments = path.split(".")
            around = {".".join(segments[:length]) for length in range(1, len(segments) + 1)}
            selected = point.selected("groups")
            known[path] = frozenset(
                name
                for name, patterns in self.groups.items()
                if any(not around.isdisjoint(selected[pattern]) for pattern in patterns)
            )
        return known[path]
