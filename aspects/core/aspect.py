"""Aspect: what is woven around a model from outside, or comes with an actor.

``@Noise(deviation=0.1).at("output")`` before a class of actors, or called with an actor, lets an aspect come with it:
the same object that a model declares.  Those of a class stand at every instance of it, in every model; each instance
has random streams and counts of its own, under the name ``PATH.NAME`` (``robot[2].sensor.noise``).  To all others they
are a part of the actor: at an output they stand before the aspects of the model, at an input or at the actor's firings
behind these.
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

_OF_CLASS, _OF_INSTANCE = "_decorations", "_own_decorations"  # attributes that keep them


class Aspect(Configurable, ABC):
    """Root of all aspects; derive from one of its kinds: ``PortAspect``, ``ExecutionAspect`` or ``ClockAspect``.

    ``at_ports`` and ``stands_at`` say where: at "input" ports, "output" ports, or both, or else at an "actor".
    ``events`` names what it may note, so that summaries show a zero where nothing happened; ``reports`` names the
    figures that it gives at the end of a run, with their units.
    """

    reserved: ClassVar[frozenset[str]] = frozenset({"type", "at", "enabled"})
    at_ports: ClassVar[bool] = False
    stands_at: ClassVar[frozenset[str]] = frozenset({"actor"})
    events: ClassVar[tuple[str, ...]] = ()
    reports: ClassVar[dict[str, str]] = {}
    alters_parameters: ClassVar[bool] = False  # a kind of port aspects does
    alters_numbers: ClassVar[bool] = True  # and nothing else

    def __init_subclass__(cls, **keywords: object) -> None:
        super().__init_subclass__(**keywords)
        if "pass_token" in vars(cls) and not cls.at_ports:
            raise TypeError(f"{cls.__name__} has a pass_token(): derive it from PortAspect, not from Aspect")

    def at(self, *ports: str, name: str = "") -> Decoration:
        """Let it come with actors: ``@Noise(deviation=0.1).at("output")`` before a class, or called with an instance.

        It then stands at these ports of every actor of the class, or of this one; an aspect of execution stands at the
        actor itself, without ports.  The ``name`` is that of the type unless given.  Raises ``EpicycleError``.
        """
        kind = type(self).__name__
        if bool(ports) != self.at_ports:
            raise EpicycleError(
                f"{kind} stands at actors: write at() without ports"
                if ports
                else f"{kind} stands at ports: say at which"
            )
        name = name or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", kind).lower()
        if not name.isidentifier() or not name.isascii():
            raise EpicycleError(f"{name!r} is not a name: use letters, digits and _, no digit first")
        return Decoration(self, name, ports)

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        """The figures that it ``reports``, from ``point.shared`` and the time (ns) at which the run ended.

        None is for a figure of which there is nothing to say, such as the mean of nothing.
        """
        return {}


@dataclass(frozen=True)
class Decoration:
    """An aspect, its name, and the ports (or parameter) of an actor where it is to stand; none: at its firings."""

    aspect: Aspect
    name: str
    ports: tuple[str, ...]

    def __call__(self, target: T) -> T:
        """Let the aspect stand at an actor, or at all actors of a class; returns what was given.

        Raises ``EpicycleError`` if it cannot stand there.
        """
        if isinstance(target, Actor):
            if target.is_part:
                raise EpicycleError(
                    f"{target.path} is part of a model: weave it there, with model.weave({self.name!r}, ..., at=...)"
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
                f"{where} has an aspect {self.name!r} already: give this one another name with name=..."
            )
        own: tuple[Decoration, ...] = vars(target).get(attribute, ())
        setattr(target, attribute, (*own, self))
        return target

    def _check_ports(self, where: str, directions: dict[str, str], parameters: Iterable[str]) -> None:
        """Whether the aspect can stand at its ports, of those that there are, or at a parameter."""
        kind, stands_at = type(self.aspect).__name__, self.aspect.stands_at
        elsewhere = set(parameters) - set(directions)
        if self.aspect.alters_parameters and len(self.ports) == 1 and self.ports[0] in elsewhere:
            return
        for port in self.ports:
            if port not in directions:
                raise EpicycleError(
                    f"{kind}: {where} has no port {port!r}{did_you_mean(port, directions)}; "
                    f"its ports: {', '.join(directions) or 'none'}"
                )
            if directions[port] not in stands_at:
                raise EpicycleError(
                    f"{kind} stands at {' or '.join(sorted(stands_at))} ports, "
                    f"but {port} is an {directions[port]} port of {where}"
                )
        if len({directions[port] for port in self.ports}) > 1:
            raise EpicycleError(
                f"{kind} stands at inputs or at outputs of {where}, not at both: decorate it twice, with two names"
            )


def class_decorations(cls: type) -> tuple[Decoration, ...]:
    """The aspects that come with an actor class, those of its bases first, in the order in which they were given."""
    return tuple(each for base in reversed(cls.__mro__) for each in vars(base).get(_OF_CLASS, ()))


def decorations(actor: Actor) -> tuple[Decoration, ...]:
    """The aspects that come with an actor, those of its class first."""
    own: tuple[Decoration, ...] = getattr(actor, _OF_INSTANCE, ())
    return (*class_decorations(type(actor)), *own)
