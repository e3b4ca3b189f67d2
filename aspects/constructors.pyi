# What constructors take, as the declarations say: for type checkers only.  Written by `make reference`.
# fmt: off
# ruff: noqa

from collections import abc
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .clock import ClockDrift as _ClockDrift, ClockOffset as _ClockOffset
from .communication import Corrupt as _Corrupt, Duplicate as _Duplicate, GilbertElliott as _GilbertElliott, Latency as _Latency, PacketLoss as _PacketLoss, Reorder as _Reorder, Throttle as _Throttle
from .execution import CrashRestart as _CrashRestart, ExecutionTime as _ExecutionTime, Processor as _Processor, SkipFiring as _SkipFiring
from .measurement import Bias as _Bias, Drift as _Drift, MeasurementFailure as _MeasurementFailure, Noise as _Noise, Outlier as _Outlier, Quantise as _Quantise, Replace as _Replace, Saturate as _Saturate, StuckAt as _StuckAt, Transform as _Transform
from .media import Bus as _Bus, RadioMedium as _RadioMedium
from .observation import Assert as _Assert, Count as _Count, Probe as _Probe
from .situation import Occlusion as _Occlusion, OutOfRange as _OutOfRange, Outage as _Outage, RangeLoss as _RangeLoss
from .trace import TraceReplay as _TraceReplay
from epicycle.actors import Distribution
from epicycle.actors.expression import PortFormula

_Number: TypeAlias = float | np.floating[Any] | np.integer[Any] | str  # a text has a unit
_Whole: TypeAlias = int | np.integer[Any] | str
_Row: TypeAlias = abc.Sequence[_Number] | NDArray[Any]
_Rows: TypeAlias = abc.Sequence[_Row] | NDArray[Any]
_Texts: TypeAlias = str | abc.Sequence[str]

class Assert(_Assert):
    """Checks an invariant for every token that passes."""
    def __init__(self, *, that: str | PortFormula, on_violation: Literal['note', 'stop', 'fail'] = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Bias(_Bias):
    """Adds a constant error: a `Transform` to value + `by`."""
    def __init__(self, *, by: _Number, fields: _Texts = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Bus(_Bus):
    """Carries one message at a time for all its ports: a server with one queue, by priority and not preemptive."""
    def __init__(self, *, factor: _Number, medium: str | None = ..., message_length: _Number = ..., number_length: _Number = ..., length_field: str | None = ..., priority: _Number = ..., priority_field: str | None = ..., capacity: _Whole | None = ..., overflow: Literal['newest', 'oldest'] = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class ClockDrift(_ClockDrift):
    """Makes a clock run too fast or too slowly."""
    def __init__(self, *, gain: _Number = ..., deviation: _Number = ...) -> None: ...

class ClockOffset(_ClockOffset):
    """Sets a clock ahead or back for the whole run."""
    def __init__(self, *, offset: _Number = ..., deviation: _Number = ...) -> None: ...

class Corrupt(_Corrupt):
    """Damages the numbers in a message, with a fixed probability."""
    def __init__(self, *, probability: _Number, kind: Literal['gaussian', 'bit_flip'] = ..., deviation: _Number = ..., fields: _Texts = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Count(_Count):
    """Counts the tokens that pass, in the summary only: the log does not grow."""
    def __init__(self, *, by: str | PortFormula | None = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class CrashRestart(_CrashRestart):
    """Stops actors, and starts them again when they are repaired: at given times, at random, or both."""
    def __init__(self, *, times: _Row = ..., mtbf: _Number | None = ..., repair: _Number | Distribution | abc.Mapping[str, object] = ..., state: Literal['lost', 'kept'] = ..., tokens: Literal['lost', 'kept'] = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Drift(_Drift):
    """Adds an error that grows."""
    def __init__(self, *, rate: _Number = ..., walk: _Number = ..., fields: _Texts = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Duplicate(_Duplicate):
    """Delivers a message more than once, with a fixed probability."""
    def __init__(self, *, probability: _Number, copies: _Whole = ..., spacing: _Number = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class ExecutionTime(_ExecutionTime):
    """Makes the firings of an actor take time: it fires at the end, with the tokens from the beginning."""
    def __init__(self, *, time: _Number | Distribution | abc.Mapping[str, object] | abc.Mapping[str, _Number | Distribution | abc.Mapping[str, object]] = ..., times: str | Path | None = ..., measure: bool = ..., scale: _Number = ..., busy: Literal['wait', 'skip'] = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class GilbertElliott(_GilbertElliott):
    """Drops messages in bursts: a channel that is good or bad, and changes between the two from message to message."""
    def __init__(self, *, p: _Number, r: _Number = ..., loss_bad: _Number = ..., loss_good: _Number = ..., spare_first: bool = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Latency(_Latency):
    """Delays each message by `delay` and a random part."""
    def __init__(self, *, delay: _Number = ..., jitter: _Number = ..., distribution: Literal['uniform', 'normal', 'exponential'] | Distribution | abc.Mapping[str, object] = ..., reordering: bool = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class MeasurementFailure(_MeasurementFailure):
    """Suppresses measurements with a fixed probability, before any receiver."""
    def __init__(self, *, probability: _Number, burst: _Number | None = ..., spare_first: bool = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Noise(_Noise):
    """Adds independent random errors."""
    def __init__(self, *, deviation: _Number, distribution: Literal['normal', 'uniform', 'laplace'] | Distribution | abc.Mapping[str, object] = ..., fields: _Texts = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Occlusion(_Occlusion):
    """Makes measurements fail while another body blocks the line of sight."""
    def __init__(self, *, radius: _Number, target: _Texts, positions: _Texts, from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class OutOfRange(_OutOfRange):
    """Makes measurements fail while the target is out of the sensor's range."""
    def __init__(self, *, range: _Number, target: _Texts, positions: _Texts, from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Outage(_Outage):
    """Splits a network: drops every message from a member of one group to a member of another."""
    def __init__(self, *, sender: str | PortFormula | None = ..., groups: abc.Mapping[str, _Texts], from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Outlier(_Outlier):
    """Adds an occasional gross error N(0, deviation^2), independently to each number."""
    def __init__(self, *, probability: _Number, deviation: _Number, fields: _Texts = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class PacketLoss(_PacketLoss):
    """Drops each message with a fixed probability, independently per receiver and message (Bernoulli)."""
    def __init__(self, *, probability: _Number, spare_first: bool = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Probe(_Probe):
    """Records every token that passes, in the signal `NAME@PORT` of the results and in the log."""
    def __init__(self, *, from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Processor(_Processor):
    """One processor for all its actors: each of their firings needs it for some time."""
    def __init__(self, *, policy: Literal['fcfs', 'priority', 'edf'] = ..., preemptive: bool = ..., time: _Number | Distribution | abc.Mapping[str, object] | abc.Mapping[str, _Number | Distribution | abc.Mapping[str, object]] = ..., times: abc.Mapping[str, _Number | Distribution | abc.Mapping[str, object] | abc.Mapping[str, _Number | Distribution | abc.Mapping[str, object]]] = ..., priorities: abc.Mapping[str, _Number] = ..., deadlines: abc.Mapping[str, _Number] = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Quantise(_Quantise):
    """Rounds to the nearest multiple of a step, ties to the even one; with 0, nothing is rounded."""
    def __init__(self, *, step: _Number, fields: _Texts = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class RadioMedium(_RadioMedium):
    """One radio channel that all stations hear: two that send at the same time spoil both messages."""
    def __init__(self, *, message_length: _Number = ..., number_length: _Number = ..., rate: _Number, overhead: _Number = ..., carrier_sense: bool = ..., slot: _Number = ..., window: _Whole = ..., max_window: _Whole = ..., retries: _Whole = ..., capture: _Number = ..., loss: _Number = ..., medium: str | None = ..., length_field: str | None = ..., priority: _Number = ..., priority_field: str | None = ..., capacity: _Whole | None = ..., overflow: Literal['newest', 'oldest'] = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class RangeLoss(_RangeLoss):
    """Drops messages from far away: log-distance path loss with log-normal shadowing."""
    def __init__(self, *, sender: str | PortFormula | None = ..., range: _Number, exponent: _Number = ..., shadowing: _Number = ..., correlation: _Number | None = ..., positions: _Texts, from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Reorder(_Reorder):
    """With a fixed probability, holds a message back until later ones have overtaken it."""
    def __init__(self, *, probability: _Number, overtaken_by: _Whole = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Replace(_Replace):
    """Replaces tokens of any kind by an expression over the token, the time and the latest tokens of ports."""
    def __init__(self, *, to: str | PortFormula, from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Saturate(_Saturate):
    """Limits numbers to what the sensor can show."""
    def __init__(self, *, low: _Number = ..., high: _Number = ..., fields: _Texts = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class SkipFiring(_SkipFiring):
    """Skips each firing with a fixed probability, independently: its tokens are lost."""
    def __init__(self, *, probability: _Number, wakes: bool = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class StuckAt(_StuckAt):
    """Repeats the last good measurement while the sensor is stuck, with the time of the one that it replaces."""
    def __init__(self, *, p: _Number, r: _Number = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Throttle(_Throttle):
    """Lets through at most `rate` messages per second in the long run, and `burst` at once (token bucket)."""
    def __init__(self, *, rate: _Number, burst: _Whole = ..., excess: Literal['drop', 'delay'] = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class TraceReplay(_TraceReplay):
    """Loses and delays messages exactly as a measured trace says."""
    def __init__(self, *, by: Literal['token', 'time'] = ..., start: Literal['first', 'random'] = ..., at_end: Literal['repeat', 'pass', 'stop'] = ..., file: str | Path, time: str = ..., lost: str = ..., received: str = ..., delay: str = ..., delay_unit: Literal['s', 'ms', 'us', 'ns'] = ..., sequence: str | None = ..., wraps: _Whole | None = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...

class Transform(_Transform):
    """Replaces each number by an expression over it, the time and the latest tokens of ports."""
    def __init__(self, *, to: str | PortFormula, fields: _Texts = ..., from_: _Number = ..., until: _Number | None = ..., every: _Number | None = ..., when: str | PortFormula | None = ...) -> None: ...
