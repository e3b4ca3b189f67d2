"""PID: the controller of most loops."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

from ..core import (
    Actor,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    PortParameter,
    to_seconds,
)
from ..core.elementary import exp, expm1
from ..readings import finite_number

# Other names of the gains and limits.
_REFUSED = {
    symbol: f"PID has no parameter {symbol!r}: {where}"
    for symbols, where in {
        ("kp", "Kp", "p", "P", "gain"): "the gain is 'proportional'",
        ("ki", "Ki", "i", "I"): "the gain of the integral part is 'integral'",
        ("kd", "Kd", "d", "D"): "the gain of the derivative part is 'derivative'",
        ("ti", "Ti"): "give 'integral', which is proportional / Ti",
        ("td", "Td"): "give 'derivative', which is proportional * Td",
        ("limits", "output_limits", "saturation"): "the limits of the output are 'low' and 'high'",
    }.items()
    for symbol in symbols
}


class _Sample(NamedTuple):
    """What the derivative needs to know about a sample."""

    time: int  # ns
    signal: float
    derivative: float


class PID(Actor):
    """A controller with a proportional, an integral and a derivative part, which acts at each measurement.

    ``u = P + I + D + feedforward``, limited to ``low`` and ``high``, with ``P = Kp (b r - y)``, ``dI/dt = Ki (r - y)``
    and ``D = Kd d(c r - y)/dt`` filtered by a lag of ``filter_time``; r is the setpoint, y the measurement.  For a gain
    K and times Ti and Td, give ``proportional: K``, ``integral: K / Ti``, ``derivative: K * Td``.  Measurements may
    come at any time.  Between them, I takes the error as constant, unless ``integration`` is ``trapezoid``, and D takes
    the signal as linear (ramp equivalence), which is right for any lag, including none.

    Anti-windup: with ``clamping``, I is held while it would drive the output further beyond a limit; with
    ``back_calculation``, it is drawn back with time constant ``tracking_time``, so that the output returns to the
    limit.  The actuator's actual output can be connected to ``tracking``; its difference from the controller's output
    then takes the place of the limits.

    Bumpless transfer: while ``automatic`` is false, the output is ``manual`` and I follows it, so that control resumes
    from there; when gains change, I compensates the jump of P.  Both need an integral part.

    The output does not depend on ``tracking`` within the same tag, so that connection may be part of a loop without
    delay.
    Source: K. J. Åström and T. Hägglund, Advanced PID Control, 2006, chapters 3 and 13; K. J. Åström and B. Wittenmark,
    Computer-Controlled Systems, 3rd ed., table 8.1.  Ptolemy: ``PID``.
    """

    refused: ClassVar[Mapping[str, str]] = _REFUSED

    measurement = InputPort(float, doc="y; an output is sent for each token")
    feedforward = InputPort(float, required=False, triggers=False, doc="added to the output, from the next output on")
    tracking = InputPort(
        float, required=False, triggers=False, doc="the actual output of the actuator, if it is measured"
    )
    automatic = InputPort(
        bool, required=False, triggers=False, doc="whether the controller is active; true until a token comes"
    )
    manual = InputPort(
        float,
        required=False,
        triggers=False,
        doc="the output while the controller is inactive; its last output until a token comes",
    )
    reset = InputPort(
        required=False, triggers=False, doc="resets I and forgets the slope, before the measurement of the tag"
    )
    output = OutputPort(float, independent_of=("tracking",), doc="u, for each measurement")
    error = OutputPort(float, depends_on=("measurement", "setpoint"), doc="r - y, for each measurement")

    setpoint = PortParameter(float, 0.0, doc="r, the desired value of y")
    proportional = PortParameter(float, 1.0, doc="Kp")
    integral = PortParameter(float, 0.0, doc="Ki, in 1/s times the unit of Kp")
    derivative = PortParameter(float, 0.0, doc="Kd, in s times the unit of Kp")
    integration = Parameter(
        str, "hold", choices=("hold", "trapezoid"), doc="how the error is taken between two measurements, for I"
    )
    filter_time = Parameter(float, 0.0, unit="s", min=0, doc="time constant of the lag on the derivative")
    setpoint_weight = Parameter(float, 1.0, unit="1", doc="b, the share of the setpoint in the proportional part")
    derivative_weight = Parameter(float, 0.0, unit="1", doc="c, the share of the setpoint in the derivative part")
    low = Parameter(float, -math.inf, doc="the lowest output")
    high = Parameter(float, math.inf, doc="the highest output")
    anti_windup = Parameter(
        str, "clamping", choices=("clamping", "back_calculation", "none"),
        doc="what keeps I from growing while the output is at a limit",
    )  # fmt: skip
    tracking_time = Parameter(
        float, None, unit="s", min=0,
        doc="time constant of back_calculation; sqrt(Kd / Ki) if left out, or Kp / Ki without Kd",
    )  # fmt: skip
    initial = Parameter(float, 0.0, doc="I at the start and after a reset")

    def check(self) -> None:
        if self.low > self.high:
            raise ParameterError(f"low is {self.low:g} and high is {self.high:g}: low must not be above high")
        if self.tracking_time is not None and self.anti_windup != "back_calculation":
            raise ParameterError(
                f"tracking_time: it is for 'anti_windup: back_calculation', but anti_windup is {self.anti_windup}"
            )

    def initialize(self) -> None:
        self._gains = self._present_gains()
        self._measured = self._error = 0.0
        self._weighted = 0.0  # b r - y, of the latest measurement
        self._wanted = self._sent = 0.0  # the latest output without limits, and with them
        self._added = 0.0
        self._done: float | None = None  # the actuator's output
        self._given: float | None = None  # the manual output
        self._is_automatic = True
        self._forget()

    def _forget(self) -> None:
        self._sum = self.initial  # I
        self._since: int | None = None  # the time up to which the error has been integrated
        self._weight = 0.0  # of the next error in I, less that of the one before, if the error is linear between them
        self._latest: _Sample | None = None
        self._before: _Sample | None = None  # the latest sample of an earlier time

    def _present_gains(self) -> tuple[float, float, float]:
        return self.proportional, self.integral, self.derivative

    def fire(self) -> None:
        if self.reset.present:
            self._forget()
        self._work()

    def _work(self) -> None:
        self._add_up()
        if self.feedforward.present:
            self._added = finite_number(self.feedforward, self.feedforward.value)
        if self.tracking.present:
            self._done = finite_number(self.tracking, self.tracking.value)
        if self.automatic.present:
            self._is_automatic = bool(self.automatic.value)
        if self.manual.present:
            self._given = finite_number(self.manual, self.manual.value)
        gains = self._present_gains()
        if gains[0] != self._gains[0] and gains[1] != 0.0:
            self._sum += (self._gains[0] - gains[0]) * self._weighted
        self._gains = gains
        if self._latest is not None:  # a new setpoint counts from now on
            self._error = self.setpoint - self._measured
        for token in self.measurement.tokens:
            self._control(finite_number(self.measurement, token))

    def _add_up(self) -> None:
        """Bring I to the present time; the error and the output have been constant since."""
        elapsed = 0.0 if self._since is None else to_seconds(self.tag.time - self._since)
        self._since = self.tag.time
        if elapsed == 0.0 or self._latest is None or not self._is_automatic:
            return
        growth = self._gains[1] * self._error
        excess = self._wanted - (self._sent if self._done is None else self._done)
        if self.anti_windup == "clamping" and excess * growth > 0.0:
            return
        self._sum += growth * elapsed
        if self.integration == "trapezoid":
            self._weight += 0.5 * self._gains[1] * elapsed
        if self.anti_windup == "back_calculation" and excess != 0.0:
            lag = self._tracking_time()
            self._sum -= excess * (1.0 if lag == 0.0 else -expm1(-elapsed / lag))

    def _tracking_time(self) -> float:
        proportional, integral, derivative = map(abs, self._gains)
        if self.tracking_time is not None:
            return self.tracking_time
        if integral == 0.0:
            return math.inf
        return math.sqrt(derivative / integral) if derivative else proportional / integral

    def _control(self, measured: float) -> None:
        setpoint = self.setpoint
        error = setpoint - measured
        self._sum += self._weight * (error - self._error)
        self._measured, self._error, self._weight = measured, error, 0.0
        self._weighted = self.setpoint_weight * setpoint - measured
        rest = self._gains[0] * self._weighted + self._derived(self.derivative_weight * setpoint - measured)
        rest += self._added
        if not self._is_automatic:
            given = self._sent if self._given is None else self._given
            self._wanted = self._limited(given)
            if self._gains[1] != 0.0:
                self._sum = self._wanted - rest
        else:
            self._wanted = rest + self._sum
        self._sent = self._limited(self._wanted)
        self.output.send(self._sent)
        self.error.send(self._error)

    def _derived(self, signal: float) -> float:
        """D, with the signal linear from the latest sample of an earlier time."""
        now, latest = self.tag.time, self._latest
        if latest is not None and latest.time < now:
            self._before = latest
        derivative, before = 0.0, self._before
        if before is not None:
            elapsed = to_seconds(now - before.time)
            kept = 0.0 if self.filter_time == 0.0 else exp(-elapsed / self.filter_time)
            slope = (signal - before.signal) / elapsed
            derivative = kept * before.derivative + self._gains[2] * (1.0 - kept) * slope
        self._latest = _Sample(now, signal, derivative)
        return derivative

    def _limited(self, value: float) -> float:
        return min(max(value, self.low), self.high)
