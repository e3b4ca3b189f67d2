"""Aspect: woven around a model from outside, or part of an actor.

``@Noise(deviation=0.1).at("output")`` before a class of actors, or called with an actor, makes an aspect part of it; it
is the same object that a model declares.  Aspects of a class attach to every instance of it, in every model; each
instance has its own random streams and counts, under the name ``PATH.NAME`` (``robot[2].sensor.noise``).  From outside,
they are part of the actor: at an output they act before the aspects of the model, at an input or at the actor's firings
after these.
"""

from __future__ import annotations

import re
from abc import ABC
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

from epicycle.actors import (
    Actor,
    Configurable,
    EpicycleError,
    declared_parameters,
    declared_ports,
    did_you_mean,
    has_own_ports,
)

T = TypeVar("T")

_OF_CLASS, _OF_INSTANCE = "_decorations", "_own_decorations"  # attributes that hold them


class Aspect(Configurable, ABC):
    """Root of all aspects; derive from one of its kinds: ``PortAspect``, ``ExecutionAspect`` or ``ClockAspect``.

    ``at_ports`` and ``stands_at`` say where it may attach: "input" ports, "output" ports, or both, or else an "actor".
    ``events`` names the events that it may note, so that summaries show a zero if none occurred; ``reports`` names the
    figures that it gives at the end of a run, with their units.
    """

    reserved: ClassVar[frozenset[str]] = frozenset({"type", "at", "enabled", "inherit"})
    at_ports: ClassVar[bool] = False
    stands_at: ClassVar[frozenset[str]] = frozenset({"actor"})
    events: ClassVar[tuple[str, ...]] = ()
    reports: ClassVar[dict[str, str]] = {}
    alters_parameters: ClassVar[bool] = False  # a kind for port aspects sets it
    alters_numbers: ClassVar[bool] = True  # and nothing else

    def __init_subclass__(cls, **keywords: object) -> None:
        super().__init_subclass__(**keywords)
        if "pass_token" in vars(cls) and not cls.at_ports:
            raise TypeError(f"{cls.__name__} has a pass_token(); derive it from PortAspect, not from Aspect")

    def at(self, *ports: str, name: str = "") -> Decoration:
        """Make it part of actors: ``@Noise(deviation=0.1).at("output")`` before a class, or called with an instance.

        It then attaches to these ports of every actor of the class, or of this one; an execution aspect attaches to the
        actor itself, without ports.  The default of ``name`` is that of the type.  Raises ``EpicycleError``.
        """
        kind = type(self).__name__
        if bool(ports) != self.at_ports:
            raise EpicycleError(
                f"{kind} attaches to actors, not to ports: write at() without ports"
                if ports
                else f"{kind} attaches to ports: give their names in at()"
            )
        name = name or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", kind).lower()
        if not name.isidentifier() or not name.isascii():
            raise EpicycleError(f"{name!r} is not a name: use letters, digits and _, and no digit first")
        return Decoration(self, name, ports)

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        """The figures that it ``reports``, from ``point.shared`` and the time (ns) at which the run ended.

        None for a figure without a value, such as the mean of nothing.
        """
        return {}


@dataclass(frozen=True)
class Decoration:
    """An aspect, its name, and the ports (or parameter) of an actor to which it attaches; without ports, its
    firings."""

    aspect: Aspect
    name: str
    ports: tuple[str, ...]

    def __call__(self, target: T) -> T:
        """Attach the aspect to an actor, or to all actors of a class; returns the argument.

        Raises ``EpicycleError`` if it cannot attach there.
        """
        if isinstance(target, Actor):
            if target.is_part:
                raise EpicycleError(
                    f"{target.path} is part of a model: weave the aspect there, with model.weave({self.name!r}, ..., "
                    "at=...)"
                )
            known, where, attribute = decorations(target), target.path, _OF_INSTANCE
            directions = {n: p.direction for n, p in {**target.inputs, **target.outputs}.items()}
            self._check_ports(where, directions, declared_parameters(type(target)))
        elif isinstance(target, type) and issubclass(target, Actor):
            known, where, attribute = class_decorations(target), target.__name__, _OF_CLASS
            if not has_own_ports(target):
                directions = {name: port.direction for name, port in declared_ports(target).items()}
                self._check_ports(where, directions, declared_parameters(target))
        else:
            raise EpicycleError(f"{target!r} is neither an actor nor a class of actors")
        if any(each.name == self.name for each in known):
            raise EpicycleError(
                f"{where} already has an aspect {self.name!r}: give this one another name with name=..."
            )
        own: tuple[Decoration, ...] = vars(target).get(attribute, ())
        setattr(target, attribute, (*own, self))
        return target

    def _check_ports(self, where: str, directions: dict[str, str], parameters: Iterable[str]) -> None:
        """Whether the aspect can attach to its ports, given the existing ones, or to a parameter."""
        kind, stands_at = type(self.aspect).__name__, self.aspect.stands_at
        elsewhere = set(parameters) - set(directions)
        if self.aspect.alters_parameters and len(self.ports) == 1 and self.ports[0] in elsewhere:
            return
        for port in self.ports:
            if port not in directions:
                raise EpicycleError(
                    f"{kind}: {where} has no port {port!r}{did_you_mean(port, directions)}; its ports: "
                    f"{', '.join(directions) or 'none'}"
                )
            if directions[port] not in stands_at:
                raise EpicycleError(
                    f"{kind} attaches to {' or '.join(sorted(stands_at))} ports, but {port} is an {directions[port]} "
                    f"port of {where}"
                )
        if len({directions[port] for port in self.ports}) > 1:
            raise EpicycleError(
                f"{kind} attaches to inputs or to outputs of {where}, not to both: decorate it twice, with two names"
            )


def class_decorations(cls: type) -> tuple[Decoration, ...]:
    """The aspects that are part of an actor class, those of its bases first, in the order in which they were given."""
    return tuple(each for base in reversed(cls.__mro__) for each in vars(base).get(_OF_CLASS, ()))


def decorations(actor: Actor) -> tuple[Decoration, ...]:
    """The aspects that are part of an actor, those of its class first."""
    own: tuple[Decoration, ...] = getattr(actor, _OF_INSTANCE, ())
    return (*class_decorations(type(actor)), *own)
