"""The aspects of the catalogue at strength zero, where they do nothing, and at work."""

from __future__ import annotations

import math
from inspect import isabstract

import epicycle.aspects
from epicycle.aspects import (
    Aspect,
    Bias,
    Bus,
    CompositeAspect,
    CompositeExecutionAspect,
    Corrupt,
    CrashRestart,
    Drift,
    Duplicate,
    ExecutionAspect,
    ExecutionTime,
    GilbertElliott,
    Latency,
    MeasurementFailure,
    Noise,
    ObservationAspect,
    Occlusion,
    Outage,
    Outlier,
    OutOfRange,
    PacketLoss,
    PortAspect,
    Processor,
    Quantise,
    RadioMedium,
    RangeLoss,
    Reorder,
    Replace,
    Saturate,
    SkipFiring,
    StuckAt,
    Throttle,
    TraceReplay,
    Transform,
)

AT_ZERO: list[Aspect] = [
    PacketLoss(probability=0),
    GilbertElliott(p=0),
    GilbertElliott(p=0.3, loss_bad=0),
    MeasurementFailure(probability=0),
    MeasurementFailure(probability=0, burst=3),
    Latency(),
    Latency(reordering=True, distribution="normal"),
    Duplicate(probability=0),
    Reorder(probability=0),
    Corrupt(probability=0),
    Corrupt(probability=0, kind="bit_flip"),
    Throttle(rate=1, burst=1e9),
    TraceReplay(file="tests/aspects/traces/perfect.csv"),
    Bus(factor=0),
    RadioMedium(message_length=1, rate=1e12),
    RangeLoss(positions=["a.at", "b.at"], range=math.inf),
    OutOfRange(positions="a.at", target="b.at", range=math.inf),
    Occlusion(positions=["a.at", "b.at"], target="b.at", radius=0),
    Outage(groups={}),
    Noise(deviation=0),
    Bias(by=0),
    Drift(),
    Transform(to="value"),
    Replace(to="value"),
    Outlier(probability=0, deviation=3),
    Outlier(probability=0.5, deviation=0),
    Quantise(step=0),
    Saturate(),
    StuckAt(p=0),
    ExecutionTime(),
    ExecutionTime(scale=0, time=1),
    ExecutionTime(measure=True),
    SkipFiring(probability=0),
    Processor(),
    CrashRestart(),
    Processor(policy="edf", preemptive=False),
]

AT_WORK: list[Aspect] = [
    PacketLoss(probability=0.5),
    GilbertElliott(p=0.3, r=0.3),
    MeasurementFailure(probability=0.5, burst=3),
    Latency(delay="1.5 ms", jitter="1 ms", reordering=True),
    Duplicate(probability=0.5),
    Reorder(probability=0.5),
    Corrupt(probability=0.5),
    Throttle(rate=300),
    TraceReplay(file="tests/aspects/traces/link.csv", delay_unit="ms", start="random"),
    Bus(factor="0.2 ms"),
    RadioMedium(message_length=3, rate=1000),
    RangeLoss(positions=["a.at", "b.at"], range=5),
    OutOfRange(positions="a.at", target="b.at", range=2),
    Occlusion(positions=["a.at", "b.at", "c.at"], target="b.at", radius=1),
    Outage(groups={"left": "a", "right": "b"}),
    Noise(deviation=1),
    Bias(by=1),
    Drift(rate=1, walk=1),
    Transform(to="value + 0.1 * time + 1"),
    Replace(to="1.5 if time < 2 else 2.5"),
    Outlier(probability=0.5, deviation=3),
    Quantise(step=0.4),
    Saturate(low=0, high=3),
    StuckAt(p=0.5, r=0.5),
    ExecutionTime(time="1.5 ms"),
    SkipFiring(probability=0.5),
    Processor(time="0.1 ms"),
    CrashRestart(mtbf="5 ms", repair="4 ms", tokens="kept", until="10 s"),
]


def at_ports(aspects: list[Aspect]) -> list[Aspect]:
    """Those that stand at ports, not at actors."""
    return [aspect for aspect in aspects if not isinstance(aspect, ExecutionAspect)]


def concrete_aspects() -> set[type[Aspect]]:
    """The aspects of the catalogue, those left out that only observe: they have no strength."""
    public = {getattr(epicycle.aspects, name) for name in epicycle.aspects.__all__}
    return {
        each
        for each in public
        if isinstance(each, type)
        and issubclass(each, (PortAspect, ExecutionAspect))
        and each not in (CompositeAspect, CompositeExecutionAspect)
        and not isabstract(each)
        and not issubclass(each, ObservationAspect)
    }
