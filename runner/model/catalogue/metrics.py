"""What a metric computes from what a port sends, declared once for reader, messages, schema and docs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias, TypedDict

from epicycle.actors import (
    Configurable,
    Fault,
    Parameter,
    ParameterError,
    Quantity,
    UnitError,
    did_you_mean,
    parse_unit,
    to_nanoseconds,
)
from epicycle.actors.expression import Formula, FormulaParameter

MSER5 = "mser5"
ACROSS = ("sum", "mean", "min", "max")  # ports
TOKENS, TIME = "tokens", "time"  # over what something is taken


@dataclass(frozen=True)
class Reduction:
    """A kind of metric: whether it counts tokens or the time that each lasts, and its options.

    ``unit`` is its unit, if that does not depend on the tokens.
    """

    over: str
    doc: str
    of: str = "numbers"  # or "any" tokens, or "single" values: numbers and texts
    options: tuple[str, ...] = ()  # besides 'after', 'until', 'to' and the options of all metrics
    needs: str = ""  # an option that it requires
    unit: str = ""
    settles: bool = True  # whether MSER-5 can detect when it has settled


# The keys of TAKES, and what a MetricSpec declares besides 'take', as type checkers know them.
TakeName: TypeAlias = Literal[
    "last", "first", "count", "min", "max", "sum", "mean", "std", "quantile", "rate", "time_mean", "time_std",
    "time_quantile", "share", "integral", "duration",
]  # fmt: skip


class MetricOptions(TypedDict, total=False):
    """The options of a metric in Python, besides its name, the port and what is taken."""

    p: float | str
    when: str | Formula
    initial: object
    after: float | str
    until: float | str
    interval: float | str
    across: str
    unit: str
    to: str
    doc: str
    label: str


TAKES = {
    "last": Reduction(TOKENS, "the last one", of="single", options=("initial",), settles=False),
    "first": Reduction(TOKENS, "the first one", of="single", settles=False),
    "count": Reduction(TOKENS, "how many there are", of="any", settles=False),
    "min": Reduction(TOKENS, "the least"),
    "max": Reduction(TOKENS, "the greatest"),
    "sum": Reduction(TOKENS, "their sum"),
    "mean": Reduction(TOKENS, "their mean: each token counts the same, however long it lasts", options=("interval",)),
    "std": Reduction(TOKENS, "their standard deviation, sqrt(sum((x - mean)^2) / (n - 1))"),
    "quantile": Reduction(
        TOKENS,
        "the number below which a share p of them lies, interpolated: type 7 of Hyndman and Fan, NumPy's default",
        options=("p",),
        needs="p",
    ),
    "rate": Reduction(TIME, "how many there are per second of model time", of="any", options=("interval",), unit="1/s"),
    "time_mean": Reduction(
        TIME, "the mean over time: each value counts for as long as it lasts", options=("initial", "interval")
    ),
    "time_std": Reduction(
        TIME, "the standard deviation over time, sqrt(mean of (x - time_mean)^2)", options=("initial",)
    ),
    "time_quantile": Reduction(
        TIME,
        "the least value such that the signal is no greater for a share p of the time",
        options=("p", "initial"),
        needs="p",
    ),
    "share": Reduction(
        TIME,
        "the share of the time in which 'when' holds",
        of="any",
        options=("when", "initial", "interval"),
        needs="when",
        unit="1",
    ),
    "integral": Reduction(
        TIME,
        "the integral over time: the sum of each value times the seconds that it lasts",
        options=("initial",),
        settles=False,
    ),
    "duration": Reduction(
        TIME,
        "how long 'when' holds in all",
        of="any",
        options=("when", "initial"),
        needs="when",
        unit="s",
        settles=False,
    ),
}


class WarmUpParameter(Parameter[float | str]):
    """A time in s, or ``mser5``."""

    def __init__(self, default: float, *, doc: str) -> None:
        super().__init__(float | str, default, unit="s", doc=doc)  # type: ignore[arg-type]
        self.forms = (Parameter(float, unit="s", min=0.0), Parameter(str, choices=(MSER5,)))

    def describe_type(self) -> str:
        return f"number or {MSER5}"

    def convert(self, value: object) -> float | str | None:
        if value == MSER5:
            return MSER5
        try:
            return self.forms[0].convert(value)
        except ParameterError:
            if isinstance(value, str) and (guess := did_you_mean(value, [MSER5])):
                raise ParameterError(f"{value!r} is neither a time nor {MSER5}{guess}") from None
            raise


class MetricSpec(Configurable):
    """The options of a metric, besides its name and ports."""

    take = Parameter(str, "last", choices=tuple(TAKES), doc="what is taken from the tokens")
    p: Parameter[float | None] = Parameter(
        float, None, unit="1", min=0.0, max=1.0, doc="which quantile; 0.5 is the median"
    )
    when: Parameter[Formula | None] = FormulaParameter(  # type: ignore[assignment]
        None, doc="a condition on 'value', such as value > 0 or value == 'busy'"
    )
    initial: Parameter[object] = Parameter(
        object, None, doc="the value before the first token; without it, time counts from that token on"
    )
    after = WarmUpParameter(0.0, doc="the warm-up, which does not count: its length, or mser5 to detect it")
    until: Parameter[float | None] = Parameter(
        float, None, unit="s", min=0.0, doc="the last time that counts (default: the end of the run)"
    )
    interval: Parameter[float | None] = Parameter(
        float, None, unit="1", min=0.5, max=0.9999, doc="level of a confidence interval, by batch means"
    )
    across: Parameter[str | None] = Parameter(
        str,
        None,
        choices=ACROSS,
        doc="how the numbers of several ports become one; without it, their tokens are taken together",
    )
    unit = Parameter(str, "", doc="the unit of the tokens")
    to = Parameter(str, "", doc="the unit in which the metric is given (default: that of the tokens)")
    doc = Parameter(str, "", doc="what it is")
    label = Parameter(str, "", doc="its label in figures and reports (default: its name)")

    @property
    def kind(self) -> Reduction:
        return TAKES[self.take]

    @property
    def own_unit(self) -> str:
        """Its unit before conversion."""
        unit = self.kind.unit or unit_before(self.unit, self.to)
        return f"{unit}*s" if unit and self.take == "integral" else unit

    @classmethod
    def fitting(cls, **values: object) -> MetricSpec:
        """A measure whose options fit together; raises ``ParameterError``."""
        made = cls(**values)
        if faults := list(made.misfits()):
            raise ParameterError.several(faults)
        return made

    def misfits(self) -> Iterator[Fault]:
        """Options that do not fit together."""
        kind = self.kind
        for option in ("p", "when", "initial", "interval"):
            if getattr(self, option) is not None and option not in kind.options:
                others = ", ".join(name for name, each in TAKES.items() if option in each.options)
                message = f"{option!r} cannot be used with {self.take!r}"
                yield Fault(message, (option,), help=(f"it can be used with {others}",))
        if self.across is not None and self.interval is not None:
            message = "'interval' cannot be used with 'across'"
            yield Fault(message, ("interval",), help=("leave out one of the two",))
        if kind.needs and getattr(self, kind.needs) is None:
            example = "p: 0.9" if kind.needs == "p" else "when: value > 0"
            yield Fault(f"{self.take!r} needs {kind.needs!r}", ("take",), help=(f"for example, add '{example}'",))
        if self.when is not None and self.when.names != ("value",):
            message = f"{self.when.source!r} is not a condition on 'value'"
            yield Fault(message, ("when",), help=("write a comparison such as 'value > 0'",))
        if self.after == MSER5 and not kind.settles:
            message = f"{MSER5} cannot detect when {self.take!r} has settled"
            yield Fault(message, ("after",), help=("give the warm-up as a time",))
        for option in ("after", "until"):
            if isinstance(time := getattr(self, option), float):
                try:
                    to_nanoseconds(time)
                except ValueError as error:
                    yield Fault(f"{option}: {error}", (option,))
        if self.until is not None and isinstance(self.after, float) and self.until < self.after:
            message = f"until: {self.until:g} s is before the end of the warm-up, which is at {self.after:g} s"
            yield Fault(message, ("until",))
        is_number = isinstance(self.initial, (bool, int, float))
        if self.initial is not None and kind.of == "numbers" and not is_number:
            yield Fault(f"initial: {self.initial!r} is not a number", ("initial",))
        if kind.unit and self.unit not in ("", kind.unit):
            yield Fault(f"the unit of {self.take!r} is {kind.unit}", ("unit",), help=(f"write 'to: {self.unit}'",))
        elif fault := conversion_fault(self.own_unit, self.to):
            yield fault.within("to")


def take_fault(metric: str, take: str) -> Fault | None:
    """What is wrong with a kind of metric; None if it is known."""
    if take in TAKES:
        return None
    message = f"metric {metric!r} cannot take {take!r}{did_you_mean(take, TAKES)}"
    return Fault(message, help=(f"valid: {', '.join(TAKES)}",))


def unit_before(unit: str, to: str) -> str:
    """The unit of a number before it is converted: one without a unit is a pure number if it is to become one."""
    return unit or ("1" if to in ("1", "%") else "")


def conversion_fault(unit: str, to: str) -> Fault | None:
    """Why numbers cannot be converted from one unit to another; None if they can."""
    if not to:
        return None
    if not unit:
        message = f"without a unit, it cannot be converted to {to}"
        return Fault(message, help=("add 'unit: ...', the unit of the tokens",))
    try:
        parse_unit(to)  # an unknown unit is reported as such
        Quantity(1.0, unit).to(to)
    except UnitError as error:
        return error.faults[0]
    return None
