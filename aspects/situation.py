"""Disturbances that depend on the positions and identities of bodies: distance, range, line of sight, partition.

A body is identified by the output port that sends its position: ``main.state`` represents everything in ``main``.  Such
a port sends positions in m, as arrays, lists or (on a line) numbers, or tokens with such a field ``position``.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable
from itertools import takewhile
from typing import Any, ClassVar

from epicycle.actors import EpicycleError, Parameter, counted, elementary
from epicycle.actors.expression import PortFormula, PortFormulaParameter, operand

from .core import (
    TOKEN,
    CommunicationAspect,
    GroupsParameter,
    JoinPoint,
    LossAspect,
    MeasurementAspect,
    PortsParameter,
)

Position = list[float]


class SituationError(EpicycleError):
    """The position or identity of something is unknown."""


class _SenderParameter(PortFormulaParameter):
    """The sender of a message."""

    def __init__(self) -> None:
        super().__init__(
            None,
            given=(TOKEN,),
            doc="expression for the path of the sender, such as token.robot; if left out, the owner of the port that "
            "the connection leaves",
        )


def _sender(token: Any, sender: PortFormula | None, point: JoinPoint) -> str:
    """The path of the sender of a token, by a ``_SenderParameter``."""
    if sender is None:
        return point.source.rpartition(".")[0]
    path = point.value_of(sender, token=token)
    if not isinstance(path, str) or not path:
        raise SituationError(f"sender: {sender.source} gives {path!r}, expected the path of the sender")
    return path


class _SituatedLoss(LossAspect):
    """A loss that depends on the positions of bodies."""

    positions = PortsParameter(doc="output ports that send the positions of the bodies, one for each")

    def body(self, path: str, point: JoinPoint) -> str:
        """The port of the body to which a path belongs: the one whose own path shares the most segments with it."""
        known: dict[str, str] = point.memory.setdefault("bodies", {})
        if path not in known:
            ports = _ports(point, "positions")
            common = {port: _common(path, port) for port in ports}
            most = max(common.values(), default=0)
            nearest = [port for port in ports if common[port] == most > 0]
            if len(nearest) != 1:
                several = f"several ports could send its position: {', '.join(nearest)}"
                none = f"no port sends its position; 'positions' selects {', '.join(ports) or 'none'}"
                raise SituationError(f"{path}: {several if nearest else none}")
            known[path] = nearest[0]
        return known[path]


class RangeLoss(_SituatedLoss, CommunicationAspect):
    """Drops messages from far away: log-distance path loss with log-normal shadowing.

    At the distance d from sender to receiver the received power is 10 * exponent * log10(range / d) + X dB above the
    level that the receiver needs, with X ~ N(0, shadowing^2); below 0 dB the message is lost.  So the loss at d is
    Phi(10 * exponent * log10(d / range) / shadowing): half of the messages at ``range``, and a sharp edge there without
    shadowing.  X is new for every message; with ``correlation``, it changes as the two ends move: successive values
    have the correlation exp(-moved / correlation), where moved is the sum of the distances that both moved. Until both
    positions are known, messages pass.  Event: ``dropped``.  Source: Rappaport, Wireless Communications, 2nd ed.,
    section 4.9; correlation: Gudmundson, Electronics Letters 27, 1991.
    """

    sender = _SenderParameter()
    range = Parameter(float, above=0, unit="m", doc="distance at which half of the messages are lost")
    exponent = Parameter(
        float, 3.0, min=0.0, unit="1", doc="path-loss exponent: 2 in free space, 3 to 5 around obstacles"
    )
    shadowing = Parameter(float, 4.0, min=0.0, unit="1", doc="standard deviation of the received power, in dB")
    correlation = Parameter(
        float,
        None,
        above=0,
        unit="m",
        doc="distance over which shadowing changes; if left out, from message to message",
    )

    def loses(self, token: Any, point: JoinPoint) -> bool:
        draw = point.random.standard_normal()
        sender = self.body(_sender(token, self.sender, point), point)
        here, there = _position(sender, point), _position(self.body(point.owner, point), point)
        if here is None or there is None:
            return False
        if self.correlation is not None:
            draw = self._correlated(draw, here + there, point.memory.setdefault("links", {}), sender)
        distance = elementary.distance(here, there)
        margin = math.inf if distance == 0.0 else 10.0 * self.exponent * elementary.log10(self.range / distance)
        return bool(margin + self.shadowing * draw < 0.0)

    def _correlated(self, draw: float, ends: Position, links: dict[str, tuple[float, Position]], sender: str) -> float:
        """A standard normal number, correlated with the previous one of this link."""
        assert self.correlation is not None
        if sender in links:
            last, before = links[sender]
            half = len(ends) // 2
            moved = elementary.distance(ends[:half], before[:half]) + elementary.distance(ends[half:], before[half:])
            rho = elementary.exp(-moved / self.correlation)
            draw = rho * last + math.sqrt(1.0 - rho * rho) * draw
        links[sender] = draw, ends
        return draw


class _SightLoss(_SituatedLoss, MeasurementAspect):
    """Base of failures by position: a sensor at its body, and its target: write ``hides``."""

    target = PortsParameter(single=True, doc="output port that sends the position of the target")

    @abstractmethod
    def hides(self, sensor: Position, target: Position, others: Iterable[Position]) -> bool:
        """Whether the sensor does not see the target; ``others`` are the positions of all other bodies."""

    def loses(self, token: Any, point: JoinPoint) -> bool:
        own, targets = self.body(point.owner, point), _ports(point, "target")
        sensor, target = _position(own, point), next((_position(port, point) for port in targets), None)
        if sensor is None or target is None:
            return False
        others = (_position(port, point) for port in _ports(point, "positions") if port not in (own, *targets))
        return self.hides(sensor, target, (place for place in others if place is not None))


class OutOfRange(_SightLoss):
    """Makes measurements fail while the target is out of the sensor's range.

    The sensor is at the position of its body.  Until both positions are known, measurements pass.  The counterpart of
    ``RangeLoss`` without shadowing for measurements.  Event: ``failed``.
    """

    events: ClassVar[tuple[str, ...]] = ("failed",)

    range = Parameter(float, min=0.0, unit="m", doc="longest distance that can be measured")

    def hides(self, sensor: Position, target: Position, others: Iterable[Position]) -> bool:
        return elementary.distance(sensor, target) > self.range


class Occlusion(_SightLoss):
    """Makes measurements fail while another body blocks the line of sight.

    Every body in ``positions``, except the sensor's own and the target, is opaque within ``radius``: it occludes the
    target if it is nearer than that to the straight line from sensor to target.  Event: ``occluded``.
    """

    events: ClassVar[tuple[str, ...]] = ("occluded",)

    radius = Parameter(float, min=0.0, unit="m", doc="radius of the bodies; 0 occludes nothing")

    def hides(self, sensor: Position, target: Position, others: Iterable[Position]) -> bool:
        return any(_distance(place, sensor, target) < self.radius for place in others)


class Outage(LossAspect, CommunicationAspect):
    """Splits a network: drops every message from a member of one group to a member of another.

    Members of several groups talk with all of them; an actor in no group hears, and is heard by, all others.  ``from``,
    ``until`` and ``every`` say when.  Event: ``dropped``.
    """

    sender = _SenderParameter()
    groups = GroupsParameter(doc="the parts: {name: [actors or composites, as patterns], ...}")

    def loses(self, token: Any, point: JoinPoint) -> bool:
        sender = self._groups_of(_sender(token, self.sender, point), point)
        receiver = self._groups_of(point.owner, point)
        return bool(sender and receiver and not sender & receiver)

    def _groups_of(self, path: str, point: JoinPoint) -> frozenset[str]:
        """The groups of an actor or composite, or of one that contains it."""
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


def _ports(point: JoinPoint, parameter: str) -> list[str]:
    """All ports that the patterns in a parameter select, once each."""
    return list(dict.fromkeys(port for ports in point.selected(parameter).values() for port in ports))


def _position(port: str, point: JoinPoint) -> Position | None:
    """The position of a body from the latest token of its port; None before the first."""
    token = operand(point.latest(port))
    if token is None:
        return None
    position = token.get("position") if isinstance(token, dict) else token
    position = [position] if _is_number(position) else position
    if not (isinstance(position, list) and position and all(_is_number(each) for each in position)):
        raise SituationError(
            f"{port} does not send a position: expected numbers, or a token with such a field 'position'"
        )
    first, count = point.memory.setdefault("dimensions", (port, len(position)))
    if len(position) != count:
        raise SituationError(
            f"{port} sends positions of {counted(len(position), 'number')}, but {first} of {count}: they cannot be "
            "compared"
        )
    return [float(each) for each in position]


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _common(path: str, other: str) -> int:
    """The number of leading segments that two paths have in common."""
    pairs = zip(path.split("."), other.split("."), strict=False)
    return len(list(takewhile(lambda pair: pair[0] == pair[1], pairs)))


def _distance(place: Position, start: Position, end: Position) -> float:
    """The distance from a point to the segment between two others."""
    along = [b - a for a, b in zip(start, end, strict=True)]
    length = elementary.total(step * step for step in along)
    there = elementary.total((x - a) * step for x, a, step in zip(place, start, along, strict=True))
    share = 0.0 if length == 0.0 else min(1.0, max(0.0, there / length))
    return elementary.distance(place, [a + share * step for a, step in zip(start, along, strict=True)])
