"""The agenda: the activations of actors at a tag, and the work of future tags."""

from __future__ import annotations

from typing import Any

from epicycle.actors import Actor, InputPort, Moment, Receiver, Wake, is_alone

_NOTHING: list[Any] = []  # shown by a port whose tokens are for a later activation


class Activation:
    """The place of an actor in the firing order, for its wake-ups or for the tokens of some inputs.

    ``ports`` are these inputs, ``later`` those whose tokens are taken in a later activation of the same actor;
    unconnected ports are left out.  ``wakes`` are the wake-ups of the present tag.
    """

    __slots__ = ("actor", "form", "is_scheduled", "later", "ports", "rank", "wake", "wakes")

    def __init__(self, actor: Actor, rank: int, ports: list[InputPort[Any]], later: list[InputPort[Any]]) -> None:
        self.actor = actor
        self.form: Form | None = None
        self.rank = rank
        self.ports = ports
        self.later: list[InputPort[Any]] = later or _NOTHING
        self.is_scheduled = False  # whether the actor has this activation at the present tag
        self.wake: Wake | None = None  # the first one of the present tag
        self.wakes: list[Wake] | None = None  # the others

    def add(self, wake: Wake) -> None:
        """Add a reason for this activation."""
        if self.wake is None:
            self.wake = wake
        elif self.wakes is None:
            self.wakes = [wake]
        else:
            self.wakes.append(wake)

    def use_wakes(self) -> bool:
        """Make the wake-ups due; false if all were cancelled and there is no other reason to fire."""
        due, wake = False, self.wake
        if wake is not None and not wake.cancelled:
            wake.due = due = True
        if self.wakes is not None:
            for wake in self.wakes:
                if not wake.cancelled:
                    wake.due = due = True
        self.wake = self.wakes = None
        return due or self.new() > 0

    def new(self) -> int:
        """How many tokens have arrived for it."""
        found = 0
        for port in self.ports:
            found += len(port.arrived)
        return found

    def hold(self) -> None:
        """The actor fires: it does not yet see tokens for a later activation."""
        for port in self.later:
            port.shown = _NOTHING

    def clear(self) -> None:
        """The actor has fired: unread tokens are dropped."""
        for port in self.ports:
            if port.arrived:
                port.clear()
        for port in self.later:
            port.shown = port.arrived


class Form:
    """An actor in C, which fires in place of the actor and works on its state; in Python there are none."""

    __slots__ = ()

    def fire(self) -> None:
        """What the actor does when it fires."""
        raise NotImplementedError


class Instant(Moment):
    """The work of one tag: tokens to deliver, then wake-ups.

    The first wake-up is ``wake``, for the actor of ``activation``; most instants have no other.
    """

    __slots__ = ("activation", "activations", "pending", "wake", "wakes")

    pending: list[Delivery] | None
    activation: Activation | None
    wake: Wake | None
    activations: list[Activation] | None
    wakes: list[Wake | None] | None  # of each of these activations

    def add(self, activation: Activation, wake: Wake | None) -> None:
        """Give an actor an activation, for a wake-up if there is one."""
        if self.activation is None:
            self.activation, self.wake = activation, wake
        elif self.activations is None or self.wakes is None:
            self.activations, self.wakes = [activation], [wake]
        else:
            self.activations.append(activation)
            self.wakes.append(wake)

    def join(self, other: Instant) -> None:
        """Add the work of a later entry for the same tag."""
        if other.activation is not None:
            self.add(other.activation, other.wake)
        if other.activations is not None and other.wakes is not None:
            for place in range(len(other.activations)):
                self.add(other.activations[place], other.wakes[place])
        if self.pending is None:
            self.pending = other.pending
        elif other.pending is not None:
            self.pending.extend(other.pending)


def new_instant(time: int, microstep: int, past: Instant | None = None) -> Instant:
    """An instant without work yet; a past one is reused if nobody has kept it."""
    instant = past if past is not None and is_alone(past) else Instant.__new__(Instant)
    instant.time, instant.microstep = time, microstep
    instant._tag = instant.pending = instant.activation = instant.wake = instant.activations = instant.wakes = None
    return instant


class Delivery:
    """A token on its way: what to do with it when its time has come."""

    __slots__ = ("token", "way")

    def __init__(self, way: Receiver, token: Any) -> None:
        self.way = way
        self.token = token

    def arrive(self) -> None:
        """Send it onward."""
        self.way.put(self.token)
