"""Rows of the table: sources of events, and random numbers."""

from __future__ import annotations

from collections.abc import Mapping

from . import randomness as law
from . import special as how
from .counterpart import Counterpart, counterpart

SOURCES: Mapping[str, Counterpart] = {
    "DiscreteClock": counterpart(
        "Clock",
        "trigger* start stop period | output",
        special=how.finite_stop,
        period="time=1.0",
        offsets="times",
        values="list=[1]",
        stopTime="time",
    ),
    "Clock": counterpart(
        "Clock",
        "trigger* start stop period | output",
        special=how.old_clock,
        fixed={"new_period": "at once", "late_trigger": True},
        period="time=2.0",
        offsets="times=[0.0, 1.0]",
        values="list=[1, 0]",
        stopTime="time",
        numberOfCycles="nothing",
    ),
    "VariableClock": counterpart(
        "Clock",
        "trigger* start stop periodControl=period | output",
        special=how.old_clock,
        fixed={"new_period": "at once", "late_trigger": True},
        period="time=1.0",
        offsets="times",
        values="list=[1]",
        stopTime="time",
        numberOfCycles="nothing",
    ),
    "SequentialClock": counterpart(
        "Clock",
        "| output",
        special=how.sequential_clock,
        period="time=2.0",
        offsets="times=[0.0, 1.0]",
        values="list=[1, 0]",
    ),
    "CancelFireAtTest": counterpart("Clock", "| out=output", fixed={"period": "2 s", "values": [True], "cycles": 3}),
    "PoissonClock": counterpart(
        "PoissonClock",
        "trigger* | output",
        special=law.poisson_clock,
        meanTime="time:mean_interval",
        values="list=[1, 0]",
        fireAtStart="flag",
        stopTime="time",
    ),
    "SingleEvent": counterpart(
        "SingleEvent", "trigger* | output", special=how.single_event, time="time", value="value"
    ),
    "Const": counterpart("Const", "trigger* | output", needs="trigger", value="value"),
    "StringConst": counterpart("Const", "trigger* | output", needs="trigger", special=how.text_value, value="text"),
    "Ramp": counterpart("Ramp", "trigger* init step | output", special=how.ramp, init="value", step="value"),
    "Sequence": counterpart(
        "Sequence",
        "trigger* enable | output",
        needs="trigger enable",
        special=how.sequence,
        values="list=[1]",
        repeat="flag",
        holdLastOutput="flag:hold",
    ),
    "Pulse": counterpart("Pulse", "trigger* | output", values="list", indexes="list", repeat="flag"),
    "CurrentTime": counterpart("CurrentTime", "trigger* | output", special=how.local_time, stopTime="nothing"),
    "TopLevelCurrentTime": counterpart("CurrentTime", "trigger* | output", special=how.global_time),
    "CurrentMicrostep": counterpart("CurrentMicrostep", "trigger* | output"),
    "WallClockTime": counterpart(
        "Const", "trigger* | output", needs="trigger", special=how.wall_clock, fixed={"value": 0.0}
    ),
    "TestActorPortDepth": counterpart(
        "Const", "trigger | output", needs="trigger", special=how.depths, fixed={"value": ""}
    ),
    "EventButton": counterpart("Filter", "trigger*=input | output", fixed={"condition": "False"}),
    "GetCurrentMicrostep": counterpart("CurrentMicrostep", "trigger* input=trigger | output"),
}


def _random(ports: str, special: how.Special, type_name: str = "VaryingRandom") -> Counterpart:
    return counterpart(type_name, f"trigger* {ports} | output", special=special)


_NORMAL = _random(
    "mean standardDeviation", law.random("Normal", mean="mean=0.0", standard_deviation="standardDeviation=1.0")
)
_COIN = _random("trueProbability", law.random("Bernoulli", probability="trueProbability=0.5"))
RANDOM: Mapping[str, Counterpart] = {
    "Gaussian": _NORMAL,
    "ColtNormal": _NORMAL,
    "Uniform": _random("lowerBound upperBound", law.random("Uniform", low="lowerBound=0.0", high="upperBound=1.0")),
    "Bernoulli": _COIN,
    "ColtBernoulli": _COIN,
    "CoinFlip": _COIN,
    "Triangular": _random("min max mode", law.random("Triangular", low="min=0.0", high="max=1.0", mode="mode=0.5")),
    "DiscreteRandomSource": _random("", law.random("Choice", values="values={0, 1}", weights="pmf={0.5, 0.5}")),
    "ColtPoisson": _random("mean", law.random("Poisson", mean="mean=1.0")),
    "RandomInteger": _random("", law.random("RandomInteger", low="low=MinInt", high="high=MaxInt")),
    "ColtPoissonSlow": _random("mean", law.random("Poisson", mean="mean=1.0")),
    "ColtBinomial": _random("n p", law.random("Binomial", trials="n=1", probability="p=0.5")),
    "ColtNegativeBinomial": _random("n p", law.colt_negative_binomial, "Random"),
    "ColtChiSquare": _random("freedom", law.random("ChiSquare", freedom="freedom=1.0")),
    "ColtStudentT": _random("freedom", law.random("StudentT", freedom="freedom=1.0")),
    "ColtBreitWigner": _random("mean gamma cut", law.colt_breit_wigner, "Random"),
    "ColtVonMises": _random("freedom", law.random("VonMises", concentration="freedom=1.0")),
    "ColtExponential": _random("lambda", law.colt_exponential, "Random"),
    "ColtGamma": _random("alpha lambda", law.colt_gamma, "Random"),
}
