"""Tests that an aspect does not interfere with anything outside its join points, for any aspects and models.

Each function runs a model a few times and raises an ``AssertionError`` that names the first event of the log that
differs.  A *trial* says how to run the model: a function that weaves aspects around the model in addition to its own,
runs it, and returns the records of the event log.  ``epicycle.runner.Trial`` makes one from a model:

>>> trial = Trial("collision_avoidance", until=2.0)
>>> def test_offset():
...     assert_silent_at_zero(Offset(by=0.0), trial, at="**.measurement")
...     assert_removal_moves_nothing(Offset(by=0.3), trial, at="**.measurement")
...     assert_streams_are_its_own(Offset(by=0.3), trial, at="**.measurement")

If no token passes the aspect, a test shows nothing, and fails for that reason.
"""

from __future__ import annotations

import copy
import random  # noqa: TID251 (to check that it is not used)
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar

import numpy as np

from . import Aspect, ExecutionAspect, JoinPoint, JoinPointAspect, PortAspect, Target

__all__ = [
    "Event", "RunModel", "Woven", "assert_observes_only", "assert_order_of_unrelated_aspects_is_free",
    "assert_removal_moves_nothing", "assert_silent_at_zero", "assert_streams_are_its_own",
]  # fmt: skip

NAME = "tested"
OTHER = "other"
P = TypeVar("P", bound=JoinPoint)


@dataclass(frozen=True)
class Woven:
    """An aspect, its name, and the pointcuts to which it attaches."""

    name: str
    aspect: Aspect
    at: str | Sequence[str] = "**"


class Event(Protocol):
    """A record of the event log, such as ``Record`` of ``epicycle.runner``."""

    @property
    def actor(self) -> str:
        """The actor or composite at whose port it happened."""

    @property
    def port(self) -> str:
        """The name of the port."""

    @property
    def aspect(self) -> str:
        """The name of the aspect that acted, empty for a send."""

    def encoded(self, *, microstep: bool = True) -> bytes:
        """The whole record, to the bit; without the microstep if ``microstep`` is false."""


class RunModel(Protocol):
    """Runs a model with some aspects woven in addition to its own, and returns the records of the event log."""

    def __call__(self, *woven: Woven) -> Sequence[Event]: ...


def assert_silent_at_zero(aspect: Aspect, trial: RunModel, at: str | Sequence[str] = "**") -> None:
    """With a strength of zero, the event log is, to the bit, that of the model without the aspect.

    ``aspect`` is made with that strength: ``Noise(deviation=0)``.
    """
    visits = _Visits(aspect)
    log = trial(Woven(NAME, visits.aspect, at))
    visits.demand_some(at)
    _compare(f"{aspect!r} at {at} is not silent", trial(), "without it", log, "with it")


def assert_observes_only(aspect: Aspect, trial: RunModel, at: str | Sequence[str] = "**") -> None:
    """The event log without the aspect's own events is, to the bit, that of the model without the aspect."""
    visits = _Visits(aspect)
    log = [event for event in trial(Woven(NAME, visits.aspect, at)) if event.aspect != NAME]
    visits.demand_some(at)
    what = f"{aspect!r} at {at} does more than observe"
    _compare(what, trial(), "without it", log, "with it, its own events left out")


def assert_removal_moves_nothing(
    aspect: Aspect, trial: RunModel, at: str | Sequence[str] = "**", beside: Sequence[Woven] = ()
) -> None:
    """Adding or removing the aspect moves no random stream of an actor or of an aspect of the model or ``beside`` it.

    The aspect is woven at full strength and decides on every token, but its decisions are not carried out: each token
    passes unchanged.  So the log may not differ, unless the aspect draws from a stream that is not its own, changes a
    token in place, or affects the model in another way.  (Microsteps are not compared: delayed actions of the aspect
    take some, and move those of SimPy processes at that time.)
    """
    visits = _Visits(aspect, acts=False, tells=False)
    log = trial(Woven(NAME, visits.aspect, at), *beside)
    visits.demand_some(at)
    what = f"{aspect!r} at {at} changes more than its own events, although none of its decisions was carried out"
    _compare(what, trial(*beside), "without it", log, "with it", microstep=False)


def assert_streams_are_its_own(aspect: Aspect, trial: RunModel, at: str | Sequence[str] = "**") -> None:
    """Each join point has its own random stream, which nothing moves, and no randomness comes from elsewhere.

    No two join points share a stream; at each one, the stream and the decisions of the aspect stay the same when it is
    attached to half of them, beside another one of its kind; of processors, which an actor has one of, that is at the
    other half.  (Decisions may depend on other join points if the aspect uses ``point.shared``.)  The global generators
    of ``random`` and NumPy are not used, and the same aspect decides the same in a second run.
    """
    before = _shared_generators()
    alone = _Visits(aspect, acts=False)
    acts = _acts(trial(Woven(NAME, alone.aspect, at)))
    alone.demand_some(at)
    if _shared_generators() != before:
        raise AssertionError(f"{aspect!r} draws from a global generator; use point.random")

    once, again = trial(Woven(NAME, aspect, at)), trial(Woven(NAME, aspect, at))
    _compare(f"{aspect!r} at {at} acts differently in a second run", once, "the first", again, "the second")

    ports: dict[str, str] = {}  # by the state of their streams
    for port, stream in alone.streams.items():
        if stream in ports:
            raise AssertionError(f"{aspect!r} has the same random stream for {ports[stream]} and {port}")
        ports[stream] = port

    half, rest = list(alone.streams)[::2], list(alone.streams)[1::2]
    others = rest if isinstance(aspect, ExecutionAspect) and aspect.is_processor else at
    here, beside = _Visits(aspect, acts=False), _Visits(aspect, acts=False, tells=False)
    other = [Woven(OTHER, beside.aspect, others)] if others else []
    acts_of_half = _acts(trial(*other, Woven(NAME, here.aspect, half)))
    for port in half:
        if here.streams.get(port) != alone.streams[port]:
            raise AssertionError(f"{aspect!r}: its random stream at {port} depends on where else it is attached")
    if shared := set(beside.streams.values()) & set(alone.streams.values()):
        raise AssertionError(
            f"{aspect!r} shares the random stream at {ports[shared.pop()]} with another one of its kind"
        )
    if not alone.shares:
        what = f"{aspect!r}: what it decides at a port depends on where else it is attached"
        acts = [event for event in acts if ".".join(filter(None, (event.actor, event.port))) in half]
        _compare(what, acts, f"at {at}", acts_of_half, "at half of that")


def assert_order_of_unrelated_aspects_is_free(first: Woven, second: Woven, trial: RunModel) -> None:
    """Two aspects at different ports can be declared in either order: the event log is the same."""
    visits = _Visits(first.aspect), _Visits(second.aspect)
    woven = Woven(first.name, visits[0].aspect, first.at), Woven(second.name, visits[1].aspect, second.at)
    log = trial(*woven)
    for each, one in zip(visits, (first, second), strict=True):
        each.demand_some(one.at)
    if common := [port for port in visits[0].streams if port in visits[1].streams]:
        raise AssertionError(f"{first.name} and {second.name} are both attached to {common[0]}, so their order matters")
    what = f"{first.aspect!r} and {second.aspect!r} depend on the order of their declaration"
    _compare(what, log, f"{first.name} first", trial(*reversed(woven)), f"{second.name} first")


def _shared_generators() -> str:
    state = np.random.get_state(legacy=False)  # noqa: NPY002 (to check that it is not used)
    return repr((random.getstate(), state["state"]["key"].tolist(), state["state"]["pos"]))


def _acts(log: Sequence[Event]) -> list[Event]:
    return [event for event in log if event.aspect == NAME]


def _compare(
    what: str, one: Sequence[Event], which: str, other: Sequence[Event], which_other: str, *, microstep: bool = True
) -> None:
    """Raise ``AssertionError`` at the first event that differs."""
    for place in range(max(len(one), len(other))):
        pair = [log[place] if place < len(log) else None for log in (one, other)]
        encoded = [None if event is None else event.encoded(microstep=microstep) for event in pair]
        if encoded[0] != encoded[1]:
            told = ["nothing more" if event is None else str(event) for event in pair]
            if told[0] == told[1]:  # up to the sixth digit
                told = [repr(event) for event in pair]
            raise AssertionError(f"{what}: event {place + 1} differs\n  {which}: {told[0]}\n  {which_other}: {told[1]}")


class _Visits:
    """A monitored aspect: what passes it, and the random streams that it uses.

    With ``acts`` false, its decisions are not carried out: each token passes unchanged, at once.  With ``tells`` false,
    it leaves no trace in the log and the results.
    """

    def __init__(self, aspect: Aspect, *, acts: bool = True, tells: bool = True) -> None:
        self.count = 0
        self.streams: dict[str, str] = {}  # their states when the first token came, by port
        self.shares = False
        self.aspect = copy.copy(aspect)
        self._original = aspect
        self._acts = acts
        self._mutes = (*(() if acts else ("forward", "stop")), *(() if tells else ("act", "count", "record")))
        self._points: dict[JoinPoint, JoinPoint] = {}
        # Each run has a copy of the original, which reports here.
        decides = "pass_token" if isinstance(aspect, PortAspect) else "schedule"
        if isinstance(aspect, JoinPointAspect):
            setattr(self.aspect, decides, partial(self._pass, aspect, decides))
            setattr(self.aspect, "pass_by", partial(self._pass, aspect, "pass_by"))  # noqa: B010 (they are methods)
        if isinstance(aspect, ExecutionAspect):
            setattr(self.aspect, "begin", partial(self._begin, aspect))  # noqa: B010

    def demand_some(self, at: str | Sequence[str]) -> None:
        """Raise ``AssertionError`` if nothing has passed."""
        if self.count == 0:
            raise AssertionError(
                f"nothing has passed {self._original!r} at {at}, so the test shows nothing: let the model run longer"
            )

    def _begin(self, original: ExecutionAspect, target: Target) -> None:
        original.begin(self._muted(target, () if self._acts else ("suspend", "resume", "kill", "restart")))

    def _pass(self, original: Aspect, method: str, passing: Any, point: JoinPoint) -> None:
        """Let the aspect handle a token or a firing."""
        if method != "pass_by":
            self.count += 1
            if point.port not in self.streams:
                self.streams[point.port] = repr(point.random)
        known = self._points.get(point)
        if known is None:
            known = self._points[point] = self._muted(point)
        getattr(original, method)(passing, known)
        self.shares = self.shares or bool(point.shared)
        if not self._acts:
            point.forward(passing)

    def _muted(self, point: P, more: Sequence[str] = ()) -> P:
        if not self._mutes:
            return point
        muted = copy.copy(point)
        for method in (*self._mutes, *more):
            setattr(muted, method, _do_nothing)
        if not self._acts:
            setattr(muted, "hold", lambda token: _do_nothing)  # noqa: B010
        return muted


def _do_nothing(*_: object, **__: object) -> None:
    pass
