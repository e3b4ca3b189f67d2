"""Where bodies are, who sends, and how far it is from one to the other.

A body is known by the output port that sends where it is: ``main.state`` stands for whatever belongs to ``main``.  Such
a port sends positions in m, as arrays, lists or (on a line) numbers, or tokens with such a field ``position``.
"""

from __future__ import annotations

from typing import Any

from epicycle.actors import EpicycleError, elementary
from epicycle.actors.expression import PortFormula, PortFormulaParameter, operand

from ..core import TOKEN, JoinPoint, LossAspect, PortsParameter

Position = list[float]


class SituationError(EpicycleError):
    """Something of which cannot be told where or who it is."""


class SenderParameter(PortFormulaParameter):
    """Who sent a message."""

    def __init__(self) -> None:
        super().__init__(
            None,
            given=(TOKEN,),
            doc="expression for the path of who sent the message, such as token.robot; none: whose port the connection "
            "leaves",
        )


def sender_of(token: Any, sender: PortFormula | None, point: JoinPoint) -> str:
    """The path of who sent a token, by a ``SenderParameter``."""
    if sender is None:
        return point.source.rpartition(".")[0]
    path = point.value_of(sender, token=token)
    if not isinstance(path, str) or not path:
        raise SituationError(f"sender: {sender.source} is {path!r}, but the path of the sender is needed")
    return path


class SituatedLoss(LossAspect):
    """A loss that depends on where bodies are."""

    positions = PortsParameter(doc="output ports that send where the bodies are, one for each")

    def body(self, path: str, point: JoinPoint) -> str:
        """The port of the body to which a path belongs: the one whose own path has most of its segments in common."""
        known: dict[str, str] = point.memory.setdefault("bodies", {})
        if path not in known:
            ports = ports_of(point, "positions")
            common = {port: _common(path, port) for port in ports}
            most = max(common.values(), default=0)
            nearest = [port for port in ports if common[port] == most > 0]
            if len(nearest) != 1:
                several = f"several ports tell where it may be: {', '.join(nearest)}"
                none = f"no port tells where it is; 'positions' selects {', '.join(ports) or 'none'}"
                raise SituationError(f"{path}: {several if nearest else none}")
            known[path] = nearest[0]
        return known[path]


def ports_of(point: JoinPoint, parameter: str) -> list[str]:
    """All ports that the patterns in a parameter select, once each."""
    return list(dict.fromkeys(port for ports in point.selected(parameter).values() for port in ports))


def position_of(port: str, point: JoinPoint) -> Position | None:
    """Where a body is, by what its port has sent last; None before that."""
    token = operand(point.latest(port))
    if token is None:
        return None
    position = token.get("position") if isinstance(token, dict) else token
    position = [position] if _is_number(position) else position
    if not (isinstance(position, list) and position and all(_is_number(each) for each in position)):
        raise SituationError(f"{port} sends no position: numbers, or a token with such a field 'position'")
    return [float(each) for each in position]


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _common(path: str, other: str) -> int:
    """How many segments two paths begin with in common."""
    count = 0
    for one, two in zip(path.split("."), other.split("."), strict=False):
        if one != two:
            break
        count += 1
    return count


def distance_to_line(place: Position, start: Position, end: Position) -> float:
    """From a place to the segment between two others."""
    along = [b - a for a, b in zip(start, end, strict=True)]
    length = elementary.total(step * step for step in along)
    there = elementary.total((x - a) * step for x, a, step in zip(place, start, along, strict=True))
    share = 0.0 if length == 0.0 else min(1.0, max(0.0, there / length))
    return elementary.distance(place, [a + share * step for a, step in zip(start, along, strict=True)])
