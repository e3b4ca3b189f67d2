"""Sources of tokens: Clock, PoissonClock and SingleEvent, and Random for triggers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from .core import (
    NEVER,
    Actor,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    PortParameter,
    Wake,
    any_parameter,
    array_parameter,
    declared_parameters,
    did_you_mean,
    texts_parameter,
    to_nanoseconds,
    token_type,
)
from .distributions import Distribution
from .triggered import times


class _Ticking(Actor):
    """The common part of clocks: a counted series of tokens up to a stop time."""

    output = OutputPort(doc="the values in turn; without values, the number of the tick, from 0")

    values = any_parameter(None, shape=(None,), doc="values of the ticks, used in turn and repeated")
    stop_time = Parameter(float, None, unit="s", min=0, doc="time after which there are no more ticks")

    def check(self) -> None:
        if self.values is not None and not self.values:
            raise ParameterError("values: the list is empty; give at least one value")
        self.output.type = int if self.values is None else token_type(self.values)

    @property
    def is_endless(self) -> bool:
        return self.stop_time is None and not any(port.name == "stop" and port.width for port in self.inputs.values())

    def _send(self, tick: int) -> None:
        self.output.send(tick if self.values is None else self.values[tick % len(self.values)])

    def _wake_at(self, time: int) -> Wake | None:
        """The wake-up for the next tick at ``time`` ns, if there is another one."""
        if self.stop_time is not None and time > to_nanoseconds(self.stop_time):
            return None
        return self.context.wake(self, time)


class Clock(_Ticking):
    """Ticks at fixed times without drift: in cycle k at ``offset + k * period`` plus each of ``offsets``.

    Times are counted in whole nanoseconds from the start of the run, or from the latest ``start`` token if that port
    is connected.  Ticks at the same time, from equal offsets or from an offset equal to the period, come at successive
    microsteps.  After an infinite period there is no further cycle.  A new period applies from the next cycle on, or
    ``at once``: already to the wait from the last tick of a cycle to the next, unless that would be over by then.

    With ``trigger`` connected, the first tick is sent, and then those for which a trigger has come since the previous
    tick, or comes with them; the others are left out.  Ptolemy: ``DiscreteClock``; with ``new_period: at once`` and
    ``late_trigger`` its ``Clock``.
    """

    is_source: ClassVar[bool] = True

    start = InputPort(required=False, doc="starts the cycles; if connected, there are none before")
    stop = InputPort(required=False, doc="stops the ticks until the next start")
    trigger = InputPort(multi=True, required=False, doc="enables the next tick; if not connected, all are enabled")

    period = PortParameter(float, unit="s", above=0, doc="length of a cycle, rounded to whole nanoseconds")
    offset = Parameter(float, 0.0, unit="s", min=0, doc="time from the start to the first cycle")
    offsets = array_parameter((None,), [0.0], unit="s", min=0, doc="times of the ticks in a cycle, ascending")
    cycles = Parameter(int, None, min=1, doc="number of cycles; unlimited if left out")
    new_period = Parameter(
        str, "next cycle", choices=("next cycle", "at once"), doc="from when on a new period applies"
    )
    reset_period = Parameter(bool, False, doc="whether a start restores the period given in the model")
    late_trigger = Parameter(
        bool, False, doc="whether a trigger still enables a tick that was left out at an earlier microstep"
    )

    def check(self) -> None:
        super().check()
        if not self.offsets.size or any(self.offsets[1:] < self.offsets[:-1]):
            raise ParameterError(f"offsets: {self.offsets.tolist()} is not an ascending list of times")
        self._check_period(self.period)

    def _check_period(self, period: float) -> None:
        if self.offsets[-1] > period:
            raise ParameterError(f"offsets: {self.offsets[-1]:g} s is not within the period of {period:g} s")

    @property
    def is_endless(self) -> bool:
        return super().is_endless and self.cycles is None and Clock.period.port_of(self).given < math.inf

    def initialize(self) -> None:
        self._offsets = [to_nanoseconds(offset) for offset in self.offsets]
        self._wake: Wake | None = None
        self._left_out: tuple[int, int] | None = None  # the latest tick that was not sent, and its time
        if not self.start.width:
            self._begin()
            self._wake = self._wake_at(self._next)

    def _begin(self) -> None:
        """Begin the first cycle now."""
        self._cycle = self._before = self.tag.time + to_nanoseconds(self.offset)
        self._tick = 0
        self._may_tick = True

    @property
    def _next(self) -> int:
        """The time of the next tick."""
        return self._cycle + self._offsets[self._tick % len(self._offsets)]

    def _wake_for_next(self) -> Wake | None:
        if self.cycles is not None and self._tick >= self.cycles * len(self._offsets):
            return None
        return self._wake_at(self._next) if self._cycle < NEVER else None

    def fire(self) -> None:
        due = self._wake is not None and self._wake.due
        if self.start.present or self.stop.present:
            self._call_off()
            due = False
        if self.start.present and not self.stop.present:
            if self.reset_period and not self.inputs["period"].present:
                Clock.period.port_of(self).reset()
            self._begin()
            due = self._next == self.tag.time
            if not due:
                self._wake = self._wake_at(self._next)
        elif self.inputs["period"].present and self.new_period == "at once" and self._wake is not None:
            due = self._lay_anew(due)
        if self.trigger.present:
            self._may_tick = True
        if due:
            self._pass()
        elif self.late_trigger and self.trigger.present and self._left_out is not None:
            tick, time = self._left_out
            if time == self.tag.time:
                self._send(tick)
                self._left_out, self._may_tick = None, False

    def _call_off(self) -> None:
        if self._wake is not None:
            self._wake.cancel()
        self._wake = None

    def _lay_anew(self, due: bool) -> bool:
        """Let the next cycle begin a new period after the previous one, if it has not begun; returns whether it is
        due."""
        begin = self._after(self._before)
        if self._tick == 0 or self._tick % len(self._offsets) or begin < self.tag.time:
            return due
        self._call_off()
        self._cycle = begin
        if self._next == self.tag.time:
            return True
        self._wake = self._wake_for_next()
        return False

    def _after(self, begin: int) -> int:
        """When the cycle after one with the given begin starts."""
        # Counted in integers, so that no rounding accumulates over a long run.
        return NEVER if math.isinf(self.period) else begin + to_nanoseconds(self.period)

    def _pass(self) -> None:
        """Tick, and wait for the next tick."""
        if self._may_tick or not self.trigger.width:
            self._send(self._tick)
        else:
            self._left_out = self._tick, self.tag.time
        self._may_tick = False
        self._tick += 1
        if self._tick % len(self._offsets) == 0:
            self._check_period(self.period)
            self._before, self._cycle = self._cycle, self._after(self._cycle)
        self._wake = self._wake_for_next()


class PoissonClock(_Ticking):
    """Ticks at random: the times between ticks are independent and exponentially distributed.

    A trigger causes a tick at once, from which the time to the next one is drawn.  Ptolemy: ``PoissonClock``.
    """

    is_source: ClassVar[bool] = True
    refused: ClassVar[Mapping[str, str]] = {
        "rate": "PoissonClock has no parameter 'rate': give 'mean_interval', which is 1 / rate"
    }

    trigger = InputPort(multi=True, required=False, doc="causes a tick at once")

    mean_interval = Parameter(float, 1.0, unit="s", above=0, doc="mean time between two ticks")
    fire_at_start = Parameter(bool, True, doc="whether the first tick comes at the start")

    def initialize(self) -> None:
        self._tick = 0
        self._wake = self._wake_at(self.tag.time + (0 if self.fire_at_start else self.interval()))

    def interval(self) -> int:
        """The time to the next tick (ns)."""
        return to_nanoseconds(self.random.exponential(self.mean_interval))

    def fire(self) -> None:
        if self.trigger.width and self.stop_time is not None and self.tag.time > to_nanoseconds(self.stop_time):
            return
        if self._wake is not None and not self._wake.due:
            self._wake.cancel()
        self._send(self._tick)
        self._tick += 1
        self._wake = self._wake_at(self.context.time + self.interval())


class SingleEvent(Actor):
    """Sends one token at a given time.

    Ptolemy: ``SingleEvent``.
    """

    output = OutputPort(doc="the value")

    time = Parameter(float, 0.0, unit="s", min=0, doc="when to send it")
    value = any_parameter(True, doc="the token to send")

    def check(self) -> None:
        self.output.type = token_type([self.value])

    def initialize(self) -> None:
        self.wake_at(self.time)

    def restart(self) -> None:
        if to_nanoseconds(self.time) >= self.tag.time:
            self.initialize()

    def fire(self) -> None:
        self.output.send(self.value)


class Random(Actor):
    """Sends a token drawn from ``distribution`` for each trigger, independently of all others.

    Ptolemy: ``Gaussian``, ``Uniform``, ``ColtExponential``, ``Bernoulli``, ``DiscreteRandomSource`` and others.
    """

    trigger = InputPort(multi=True, doc="when to send")
    output = OutputPort(doc="the drawn token")

    distribution = Parameter(Distribution, doc="the distribution to draw from")

    def check(self) -> None:
        self.output.type = self.distribution.token_type

    def fire(self) -> None:
        for _ in range(times(self.trigger)):
            self.output.send(self.distribution.draw(self.random))


class VaryingRandom(Random):
    """A ``Random`` whose distribution changes during the run: some of its parameters have inputs with their names.

    Their latest tokens are used; before the first ones, the parameters of the distribution.  Ptolemy: the ports of
    ``Gaussian`` and the others.
    """

    varying = texts_parameter(doc="names of the parameters that have inputs")

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        known = declared_parameters(type(self.distribution))
        for name in self.varying:
            if name not in known:
                raise ParameterError(
                    f"varying: {type(self.distribution).__name__} has no parameter {name!r}{did_you_mean(name, known)}"
                )
        return {name: InputPort(doc="a parameter of the distribution") for name in dict.fromkeys(self.varying)}

    def initialize(self) -> None:
        self._law = self.distribution

    def fire(self) -> None:
        came = {name: port.value for name in self.varying if (port := self.inputs[name]).present}
        if came:
            said = {name: getattr(self._law, name) for name in declared_parameters(type(self._law))}
            self._law = type(self._law)(**{**said, **came})
        for _ in range(times(self.trigger)):
            self.output.send(self._law.draw(self.random))
