"""Filters of sampled signals: DiscreteFilter, and designs for its coefficients."""

from __future__ import annotations

import math

from ..core import Actor, Configurable, EpicycleError, InputPort, OutputPort, Parameter, ParameterError, array_parameter
from ..core.elementary import expm1, sin, tan, total
from ..readings import finite_number
from .linear import polynomials
from .matrices import Vector

Section = tuple[Vector, Vector]  # numerator and denominator, of the same length; the denominator begins with 1


class FilterDesign(Configurable):
    """Base of the designs, from which the coefficients of a filter follow."""

    def sections(self) -> list[Section]:
        """The sections of the filter, in series."""
        raise NotImplementedError(f"{type(self).__name__} has no sections()")


class FirstOrder(FilterDesign):
    """A first-order lag, ``1 / (T s + 1)``, for an input held from sample to sample: exponential smoothing.

    ``y[k] = y[k-1] + (1 - exp(-period / T)) (u[k] - y[k-1])``.
    """

    time_constant = Parameter(float, unit="s", above=0, doc="T, after which 63 % of a step is reached")
    period = Parameter(float, unit="s", above=0, doc="time between two samples")

    def sections(self) -> list[Section]:
        share = -expm1(-self.period / self.time_constant)
        return [([share, 0.0], [1.0, share - 1.0])]


class Butterworth(FilterDesign):
    """The low pass or high pass with the flattest passband: half the power passes at the cutoff.

    Beyond it, attenuation grows by 20 dB per decade and order.  By the bilinear transform, with the exact cutoff
    frequency, in second-order sections, which are numerically accurate.
    Source: A. V. Oppenheim and R. W. Schafer, Discrete-Time Signal Processing, 3rd ed., sections 6.3 and 7.3.
    """

    cutoff = Parameter(float, unit="Hz", above=0, doc="the frequency at which half the power passes")
    period = Parameter(float, unit="s", above=0, doc="time between two samples")
    order = Parameter(int, 2, min=1, max=40, doc="the order: 20 dB per decade each")
    passes = Parameter(str, "low", choices=("low", "high"), doc="whether low or high frequencies pass")

    def check(self) -> None:
        if self.cutoff * self.period >= 0.5:
            raise ParameterError(
                f"cutoff: {self.cutoff:g} Hz is not below {0.5 / self.period:g} Hz, half the rate of the samples"
            )

    def sections(self) -> list[Section]:
        width = tan(math.pi * self.cutoff * self.period)
        high = self.passes == "high"
        found: list[Section] = []
        for number in range(self.order // 2):
            damping = 2.0 * sin(math.pi * (2 * number + 1) / (2 * self.order))
            whole = 1.0 + damping * width + width * width
            gain = (1.0 if high else width * width) / whole
            above = [gain, -2.0 * gain if high else 2.0 * gain, gain]
            below = [1.0, 2.0 * (width * width - 1.0) / whole, (1.0 - damping * width + width * width) / whole]
            found.append((above, below))
        if self.order % 2:
            gain = (1.0 if high else width) / (1.0 + width)
            found.append(([gain, -gain if high else gain], [1.0, (width - 1.0) / (1.0 + width)]))
        return found


class DiscreteFilter(Actor):
    """A linear filter of a sampled signal: each token in gives one token out, at any times.

    ``a0 y[k] = b0 u[k] + b1 u[k-1] + ... - a1 y[k-1] - ...`` with ``numerator`` b and ``denominator`` a, as in
    ``scipy.signal.lfilter``.  Without a denominator it is a FIR filter: ``numerator: [0.25, 0.5, 0.25]``.  Instead, a
    ``design`` can specify the filter: ``{type: Butterworth, cutoff: 5 Hz, period: 10 ms}``.  Direct form II transposed
    (Oppenheim and Schafer, section 6.3).  Ptolemy: ``IIR``, ``FIR``.
    """

    input = InputPort(float, doc="the samples")
    reset = InputPort(required=False, doc="restarts the filter, before the samples of the tag")
    output = OutputPort(float, depends_on=("input", "reset"), doc="the filtered samples")

    numerator = array_parameter((None,), None, doc="coefficients of u[k], u[k-1], ...")
    denominator = array_parameter((None,), None, doc="coefficients of y[k], y[k-1], ...; [1] if left out")
    design = Parameter(
        FilterDesign, None, doc="a design that gives the coefficients, instead of numerator and denominator"
    )
    start = Parameter(
        str, "zero", choices=("zero", "settled"),
        doc="the input before the first sample: zero, or that sample for ever",
    )  # fmt: skip

    def check(self) -> None:
        given = self.numerator is not None or self.denominator is not None
        if given == (self.design is not None):
            raise ParameterError("give either a 'numerator' (and 'denominator') or a 'design'")
        self._sections = self.design.sections() if self.design is not None else [self._section()]
        if self.start == "settled" and any(total(below) == 0.0 for _, below in self._sections):
            raise ParameterError(
                "start: a filter that integrates never settles (the coefficients of its denominator add up to 0)"
            )

    def _section(self) -> Section:
        above, below = ([1.0] if each is None else each.tolist() for each in (self.numerator, self.denominator))
        leading = len(above)
        above, below = polynomials(above, below)
        above = [0.0] * (leading - len(above)) + above  # which NumPy's polynomials strip; here they are delays
        longest = max(len(above), len(below))
        return above + [0.0] * (longest - len(above)), below + [0.0] * (longest - len(below))

    def initialize(self) -> None:
        self._memories: list[Vector] | None = None

    def fire(self) -> None:
        if self.reset.present:
            self._memories = None
        for token in self.input.tokens:
            sample = finite_number(self.input, token)
            if self._memories is None:
                self._memories = self._first(sample)
            for (above, below), memory in zip(self._sections, self._memories, strict=True):
                sample = _filtered(sample, above, below, memory)
            if not math.isfinite(sample):
                raise EpicycleError("the output has grown too large for a float: the filter is unstable")
            self.output.send(sample)

    def _first(self, sample: float) -> list[Vector]:
        """The memory of the sections before the first sample."""
        memories = []
        for above, below in self._sections:
            memory = [0.0] * len(above)
            if self.start == "settled":
                out = sample * (total(above) / total(below))
                for place in range(len(above) - 1, 0, -1):
                    after = memory[place] if place < len(memory) else 0.0
                    memory[place - 1] = above[place] * sample - below[place] * out + after
                sample = out
            memories.append(memory)
        return memories


def _filtered(sample: float, above: Vector, below: Vector, memory: Vector) -> float:
    """Filter the next sample; the last entry of the memory is always 0."""
    out = above[0] * sample + memory[0]
    for place in range(1, len(above)):
        memory[place - 1] = above[place] * sample - below[place] * out + memory[place]
    return out
