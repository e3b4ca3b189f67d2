# What constructors take, as the declarations say: for type checkers only.  Written by `make reference`.
# fmt: off
# ruff: noqa

from collections import abc
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .accumulation import Accumulator as _Accumulator, Counter as _Counter, Derivative as _Derivative, Difference as _Difference, Integrator as _Integrator, TimeAverage as _TimeAverage
from .arithmetic import AddSubtract as _AddSubtract, Extreme as _Extreme, MathFunction as _MathFunction, MultiplyDivide as _MultiplyDivide, Scale as _Scale
from .blocks import BlockExpression as _BlockExpression, HoldingExpression as _HoldingExpression
from .continuous import ODE as _ODE
from .control.filters import Butterworth as _Butterworth, DiscreteFilter as _DiscreteFilter, FilterDesign, FirstOrder as _FirstOrder
from .control.limits import DeadZone as _DeadZone, Hysteresis as _Hysteresis, Limiter as _Limiter, Quantizer as _Quantizer
from .control.linear import StateSpace as _StateSpace, TransferFunction as _TransferFunction
from .control.pid import PID as _PID
from .distributions import Bernoulli as _Bernoulli, Binomial as _Binomial, Cauchy as _Cauchy, ChiSquare as _ChiSquare, Choice as _Choice, Constant as _Constant, Distribution, Exponential as _Exponential, Gamma as _Gamma, LogNormal as _LogNormal, NegativeBinomial as _NegativeBinomial, Normal as _Normal, Poisson as _Poisson, RandomInteger as _RandomInteger, StudentT as _StudentT, Triangular as _Triangular, Uniform as _Uniform, VonMises as _VonMises
from .entities import Batch as _Batch, Collect as _Collect, Match as _Match, RecordAssembler as _RecordAssembler, RecordDisassembler as _RecordDisassembler, SetFields as _SetFields, Spread as _Spread, Unbatch as _Unbatch
from .flow import BooleanSwitch as _BooleanSwitch, Merge as _Merge, MostRecent as _MostRecent, Repeat as _Repeat, Router as _Router, Sampler as _Sampler, Select as _Select, Switch as _Switch, Synchronizer as _Synchronizer
from .functions import Expression as _Expression, Function as _Function, LookupTable as _LookupTable
from .links import ArqReceiver as _ArqReceiver, ArqSender as _ArqSender, Link as _Link, NetworkSwitch as _NetworkSwitch
from .logic import Comparator as _Comparator, Equals as _Equals, LogicGate as _LogicGate
from .modes.machine import StateMachine as _StateMachine
from .modes.modal import ModalActor as _ModalActor
from .passing import BooleanSelect as _BooleanSelect, Changes as _Changes, Commutator as _Commutator, Default as _Default, Filter as _Filter, FirstOfInstant as _FirstOfInstant, Inhibit as _Inhibit, IsPresent as _IsPresent, LatestOfAll as _LatestOfAll, Previous as _Previous, Register as _Register, Sequencer as _Sequencer
from .queues import Queue as _Queue, Server as _Server, SharedQueue as _SharedQueue
from .replay import Replay as _Replay
from .resources.line import WaitingLine as _WaitingLine
from .resources.pool import Pool as _Pool, Pools as _Pools
from .resources.stations import Machine as _Machine, Station as _Station
from .robotics.controller import RobustController as _RobustController
from .robotics.detecting import MultiTargetSensor as _MultiTargetSensor
from .robotics.dynamics import DoubleIntegrator as _DoubleIntegrator, Dynamics
from .robotics.estimator import ExtendedEstimator as _ExtendedEstimator, UnscentedEstimator as _UnscentedEstimator
from .robotics.filterpy_estimator import FilterPyEstimator as _FilterPyEstimator
from .robotics.integrated_ou import IntegratedOUEstimator as _IntegratedOUEstimator
from .robotics.monitors import ClearanceMonitor as _ClearanceMonitor, DistanceMonitor as _DistanceMonitor, GoalMonitor as _GoalMonitor, SeparationMonitor as _SeparationMonitor
from .robotics.motion import WaypointMotion as _WaypointMotion
from .robotics.particle_estimator import ParticleEstimator as _ParticleEstimator
from .robotics.planning import Barrier as _Barrier, Casadi as _Casadi, Inform as _Inform, ReachGoal as _ReachGoal, Solver, StayNear as _StayNear
from .robotics.problem import Objective
from .robotics.safe_controller import SafeController as _SafeController
from .robotics.sensor_models import SensorModel
from .robotics.tracker import JPDATracker as _JPDATracker
from .robotics.tracking_error import TrackingError as _TrackingError
from .robotics.world import BroadcastChannel as _BroadcastChannel, CircularMotion as _CircularMotion, Flooding as _Flooding, Sensor as _Sensor, Vehicle as _Vehicle
from .sinks import Display as _Display, Histogram as _Histogram, Recorder as _Recorder, Stop as _Stop, Test as _Test
from .sources import Clock as _Clock, PoissonClock as _PoissonClock, Random as _Random, SingleEvent as _SingleEvent, VaryingRandom as _VaryingRandom
from .statistics import MovingAverage as _MovingAverage, MovingStatistics as _MovingStatistics
from .texts import TextFunction as _TextFunction
from .timing import ResettableTimer as _ResettableTimer, TimeCompare as _TimeCompare, TimeDelay as _TimeDelay, TimeGap as _TimeGap, Timer as _Timer, WaitingTime as _WaitingTime
from .triggered import Const as _Const, CurrentMicrostep as _CurrentMicrostep, CurrentTime as _CurrentTime, Pulse as _Pulse, Ramp as _Ramp, Sequence as _Sequence
from .variables import SetVariable as _SetVariable, Variable as _Variable
from .vehicles.following import WaypointFollower as _WaypointFollower
from .vehicles.motion import Ackermann as _Ackermann, Unicycle as _Unicycle
from .vehicles.sensing import InertialSensor as _InertialSensor, RangeBearingSensor as _RangeBearingSensor, RangeScanner as _RangeScanner
from epicycle.actors.expression import Formula

_Number: TypeAlias = float | np.floating[Any] | np.integer[Any] | str  # a text has a unit
_Whole: TypeAlias = int | np.integer[Any] | str
_Row: TypeAlias = abc.Sequence[_Number] | NDArray[Any]
_Rows: TypeAlias = abc.Sequence[_Row] | NDArray[Any]
_Texts: TypeAlias = str | abc.Sequence[str]

class Accumulator(_Accumulator):
    """The sum of all tokens so far, including those of the present tag."""
    def __init__(self, path: str, *, initial: _Number = ..., reset_by: Literal['any', 'true'] = ..., low: _Number | None = ..., high: _Number | None = ...) -> None: ...

class Ackermann(_Ackermann):
    """A car, driven by speed and steering angle."""
    def __init__(self, path: str, *, steering: _Number = ..., wheelbase: _Number = ..., max_steering: _Number = ..., start: _Row = ..., heading: _Number = ..., speed: _Number = ..., max_speed: _Number = ...) -> None: ...

class AddSubtract(_AddSubtract):
    """The sum of the tokens at `plus` minus the sum of those at `minus`."""
    def __init__(self, path: str) -> None: ...

class ArqReceiver(_ArqReceiver):
    """The receiving end of an automatic repeat request: passes on the tokens of an `ArqSender`, once and in order."""
    def __init__(self, path: str, *, repeat: Literal['all', 'one'] = ...) -> None: ...

class ArqSender(_ArqSender):
    """The sending end of an automatic repeat request: keeps frames until they are acknowledged, and repeats them."""
    def __init__(self, path: str, *, window: _Whole = ..., timeout: _Number, spacing: _Number = ..., repeat: Literal['all', 'one'] = ..., tries: _Whole | None = ..., lifetime: _Number | None = ...) -> None: ...

class Barrier(_Barrier):
    """The paper's choice: an interior-point barrier method with Newton steps, compiled."""
    def __init__(self, *, gap: _Number = ..., last_parameter: _Number = ..., free_controls: _Whole = ..., infeasible: Literal['progress', 'least_violation', 'brake'] = ...) -> None: ...

class Batch(_Batch):
    """Collects tokens into lists."""
    def __init__(self, path: str, *, number: _Whole | None = ..., size: _Number | None = ..., weight: str | float | Formula = ..., after: _Number | None = ..., key: str | float | Formula | None = ...) -> None: ...

class Bernoulli(_Bernoulli):
    """True with a given probability, otherwise false."""
    def __init__(self, *, probability: _Number = ...) -> None: ...

class Binomial(_Binomial):
    """The binomial distribution: the number of successful trials."""
    def __init__(self, *, trials: _Whole = ..., probability: _Number = ...) -> None: ...

class BlockExpression(_BlockExpression):
    """Evaluates an expression over blocks of `number` tokens each, as soon as a block is full."""
    def __init__(self, path: str, *, expression: str | float | Formula, number: _Whole = ..., past: abc.Sequence[object] = ..., items: bool = ...) -> None: ...

class BooleanSelect(_BooleanSelect):
    """Each `control` token lets the next token of `true_input` or `false_input` pass."""
    def __init__(self, path: str, *, unread: Literal['kept', 'lost'] = ...) -> None: ...

class BooleanSwitch(_BooleanSwitch):
    """Sends each token to `true_output` or `false_output`, according to the latest `control` token."""
    def __init__(self, path: str, *, control: bool = ...) -> None: ...

class BroadcastChannel(_BroadcastChannel):
    """Passes the messages of each participant to all the others."""
    def __init__(self, path: str) -> None: ...

class Butterworth(_Butterworth):
    """The low pass or high pass with the flattest passband: half the power passes at the cutoff."""
    def __init__(self, *, cutoff: _Number, period: _Number, order: _Whole = ..., passes: Literal['low', 'high'] = ...) -> None: ...

class Casadi(_Casadi):
    """CasADi's IPOPT, for any dynamics and any objective; on the paper's problem it is an independent check."""
    def __init__(self, *, method: Literal['ipopt', 'fatrop'] = ..., max_iterations: _Whole = ...) -> None: ...

class Cauchy(_Cauchy):
    """The Cauchy distribution, which has no mean; in physics, the Breit-Wigner distribution."""
    def __init__(self, *, median: _Number = ..., scale: _Number = ..., cut: _Number | None = ...) -> None: ...

class Changes(_Changes):
    """Passes on the first number, and then each that differs by more than `by` from the last one passed on."""
    def __init__(self, path: str, *, by: _Number = ...) -> None: ...

class ChiSquare(_ChiSquare):
    """The chi-square distribution: the sum of squares of standard normal numbers."""
    def __init__(self, *, freedom: _Number) -> None: ...

class Choice(_Choice):
    """One of several values of any kind, with equal probability or by weight."""
    def __init__(self, *, values: abc.Sequence[object], weights: _Row | None = ...) -> None: ...

class CircularMotion(_CircularMotion):
    """A body on a circle of radius `speed / turn_rate` (Table III), computed from the time alone."""
    def __init__(self, path: str, *, start: _Row = ..., speed: _Number = ..., turn_rate: _Number = ..., heading: _Number = ...) -> None: ...

class ClearanceMonitor(_ClearanceMonitor):
    """The distance from a body to the nearest of several others that come and go."""
    def __init__(self, path: str) -> None: ...

class Clock(_Clock):
    """Ticks at fixed times without drift: in cycle k at `offset + k * period` plus each of `offsets`."""
    def __init__(self, path: str, *, period: _Number, offset: _Number = ..., offsets: _Row = ..., cycles: _Whole | None = ..., new_period: Literal['next cycle', 'at once'] = ..., reset_period: bool = ..., late_trigger: bool = ..., values: abc.Sequence[object] | None = ..., stop_time: _Number | None = ...) -> None: ...

class Collect(_Collect):
    """Makes a list of one token from each channel, once every channel has one; others wait in the order of arrival."""
    def __init__(self, path: str, *, joined: bool = ...) -> None: ...

class Commutator(_Commutator):
    """Passes on tokens from the channels of its input in turn, `block` from each; tokens wait for their turn."""
    def __init__(self, path: str, *, block: _Whole = ..., waits: bool = ...) -> None: ...

class Comparator(_Comparator):
    """Compares `left` with `right`, or with `value` if nothing is connected to `right`."""
    def __init__(self, path: str, *, comparison: Literal['==', '!=', '<', '<=', '>', '>='], value: object = ..., tolerance: _Number = ..., hold: bool = ...) -> None: ...

class Const(_Const):
    """Sends the same value for each trigger; once at the start if `trigger` is not connected."""
    def __init__(self, path: str, *, value: object = ..., limit: _Whole | None = ...) -> None: ...

class Constant(_Constant):
    """Always the same value; an actor that sends it is `Const`."""
    def __init__(self, *, value: _Number) -> None: ...

class Counter(_Counter):
    """Counts tokens of any kind: up for each at `increment`, down for each at `decrement`."""
    def __init__(self, path: str, *, initial: _Whole = ..., reset_by: Literal['any', 'true'] = ...) -> None: ...

class CurrentMicrostep(_CurrentMicrostep):
    """Sends the present microstep for each trigger."""
    def __init__(self, path: str) -> None: ...

class CurrentTime(_CurrentTime):
    """Sends the present time for each trigger, also for each of several that come together."""
    def __init__(self, path: str) -> None: ...

class DeadZone(_DeadZone):
    """Outputs zero between two values, and the excess beyond them: play, or a valve with overlap."""
    def __init__(self, path: str, *, low: _Number, high: _Number) -> None: ...

class Default(_Default):
    """Passes on the token at `preferred`, or, if there is none, the one at `alternate`."""
    def __init__(self, path: str) -> None: ...

class Derivative(_Derivative):
    """The rate of change of a signal from token to token."""
    def __init__(self, path: str) -> None: ...

class Difference(_Difference):
    """Each token minus the one before it."""
    def __init__(self, path: str, *, initial: _Number | None = ...) -> None: ...

class DiscreteFilter(_DiscreteFilter):
    """A linear filter of a sampled signal: each token in gives one token out, at any times."""
    def __init__(self, path: str, *, numerator: _Row | None = ..., denominator: _Row | None = ..., design: FilterDesign | abc.Mapping[str, object] | None = ..., start: Literal['zero', 'settled'] = ...) -> None: ...

class Display(_Display):
    """Writes a line for each token: the time, the path of the actor, and the token."""
    def __init__(self, path: str, *, title: str = ...) -> None: ...

class DistanceMonitor(_DistanceMonitor):
    """The distance between two bodies, whenever a state of one comes and both are known."""
    def __init__(self, path: str) -> None: ...

class DoubleIntegrator(_DoubleIntegrator):
    """The paper's robot, eq. (2): the control is the acceleration, and the state is position and velocity."""
    def __init__(self, *, dimensions: _Whole = ..., max_speed: _Number = ..., max_acceleration: _Number = ..., climb_speed: _Number = ..., climb_acceleration: _Number = ...) -> None: ...

class Equals(_Equals):
    """Sends whether all tokens that come together are equal; channels without a token are ignored."""
    def __init__(self, path: str, *, tolerance: _Number = ...) -> None: ...

class Exponential(_Exponential):
    """The exponential distribution: waiting times without memory."""
    def __init__(self, *, mean: _Number = ...) -> None: ...

class Expression(_Expression):
    """Evaluates an expression whenever one of its inputs gets a token."""
    def __init__(self, path: str, *, expression: str | float | Formula, gives: Literal['number', 'truth value', 'text', 'any value'] | None = ..., hold: bool = ..., iteration: bool = ...) -> None: ...

class ExtendedEstimator(_ExtendedEstimator):
    """The extended Kalman filter: what a sensor measures is a linear function, with its slope at the prediction."""
    def __init__(self, path: str, *, noise_direction: Literal['expected', 'predicted'] = ..., period: _Number = ..., prior_mean: _Row = ..., prior_variance: _Row = ..., max_delay: _Number = ..., position_noise: _Number = ..., velocity_noise: _Number = ..., kappa: _Number = ...) -> None: ...

class Extreme(_Extreme):
    """The largest or smallest of the tokens that come together, and its channel; of equal ones, the first."""
    def __init__(self, path: str, *, take: Literal['greatest', 'least']) -> None: ...

class Filter(_Filter):
    """Passes on the tokens for which a condition holds; the others are lost."""
    def __init__(self, path: str, *, condition: str | float | Formula = ...) -> None: ...

class FilterPyEstimator(_FilterPyEstimator):
    """A filter of FilterPy with the model of `UnscentedEstimator`; fuses one measurement after another."""
    def __init__(self, path: str, *, filter: Literal['ExtendedKalmanFilter', 'UnscentedKalmanFilter', 'CubatureKalmanFilter', 'KalmanFilter', 'SquareRootKalmanFilter'] = ..., noise_direction: Literal['expected', 'predicted'] = ..., period: _Number = ..., prior_mean: _Row = ..., prior_variance: _Row = ..., max_delay: _Number = ..., position_noise: _Number = ..., velocity_noise: _Number = ..., kappa: _Number = ...) -> None: ...

class FirstOfInstant(_FirstOfInstant):
    """Passes on the first token of each instant; others at the same time, also at later microsteps, are lost."""
    def __init__(self, path: str) -> None: ...

class FirstOrder(_FirstOrder):
    """A first-order lag, `1 / (T s + 1)`, for an input held from sample to sample: exponential smoothing."""
    def __init__(self, *, time_constant: _Number, period: _Number) -> None: ...

class Flooding(_Flooding):
    """Sends the messages of its robot, and repeats those of others for the robots that are out of their reach."""
    def __init__(self, path: str) -> None: ...

class Function(_Function):
    """Calls a Python function whenever one of its inputs gets a token, and sends what it returns."""
    def __init__(self, path: str, *, function: str | abc.Callable[..., object], hold: bool = ...) -> None: ...

class Gamma(_Gamma):
    """The gamma distribution; with a whole `shape` the Erlang distribution."""
    def __init__(self, *, shape: _Number = ..., mean: _Number = ...) -> None: ...

class GoalMonitor(_GoalMonitor):
    """Sends when a body first comes within `tolerance` of the goal, and how far it has travelled."""
    def __init__(self, path: str, *, goal: _Row = ..., tolerance: _Number = ...) -> None: ...

class Histogram(_Histogram):
    """Counts how many tokens fall into each of `bins` equal intervals from `low` to `high`."""
    def __init__(self, path: str, *, low: _Number, high: _Number, bins: _Whole = ...) -> None: ...

class HoldingExpression(_HoldingExpression):
    """Evaluates an expression with some inputs that hold a value from the start."""
    def __init__(self, path: str, *, expression: str | float | Formula, held: abc.Mapping[str, object]) -> None: ...

class Hysteresis(_Hysteresis):
    """Switches on when a signal reaches one value, and off when it falls to another: a relay, a Schmitt trigger."""
    def __init__(self, path: str, *, upper: _Number, lower: _Number, on: _Number = ..., off: _Number = ..., initial: bool = ...) -> None: ...

class InertialSensor(_InertialSensor):
    """An inertial measurement unit in the plane: turn rate and acceleration, with noise and drifting biases."""
    def __init__(self, path: str, *, turn_rate_noise: _Number = ..., turn_rate_walk: _Number = ..., turn_rate_bias: _Number = ..., acceleration_noise: _Number = ..., acceleration_walk: _Number = ..., acceleration_bias: _Row = ...) -> None: ...

class Inform(_Inform):
    """Eq. (5): the information of range measurements at the end of the horizon, minus a penalty for distance."""
    def __init__(self, *, range: _Number = ..., penalty: _Number = ..., variance: _Number = ..., across: _Number | None = ..., unit: Literal['nat', 'bit'] = ..., joint: bool = ...) -> None: ...

class Inhibit(_Inhibit):
    """Passes on tokens unless an `inhibit` token comes with them; the opposite of a `Sampler`."""
    def __init__(self, path: str) -> None: ...

class IntegratedOUEstimator(_IntegratedOUEstimator):
    """The paper's filter with two changes, for a `SafeController`; the process noise of eq. (1) is not used."""
    def __init__(self, path: str, *, degrees_of_freedom: _Number = ..., target_speed: _Number = ..., turn_time: _Number = ..., noise_direction: Literal['expected', 'predicted'] = ..., period: _Number = ..., prior_mean: _Row = ..., prior_variance: _Row = ..., max_delay: _Number = ..., position_noise: _Number = ..., velocity_noise: _Number = ..., kappa: _Number = ...) -> None: ...

class Integrator(_Integrator):
    """The integral over time of a signal that arrives as tokens."""
    def __init__(self, path: str, *, method: Literal['hold', 'trapezoid'] = ..., initial: _Number = ...) -> None: ...

class IsPresent(_IsPresent):
    """Sends for each channel whether it has a token, whenever any channel has one."""
    def __init__(self, path: str) -> None: ...

class JPDATracker(_JPDATracker):
    """Tracks an unknown number of targets by joint probabilistic data association (JPDA) and the unscented filter."""
    def __init__(self, path: str, *, period: _Number = ..., gate: _Number = ..., birth_density: _Number = ..., birth_variance: _Number = ..., confirm_hits: _Whole = ..., confirm_steps: _Whole = ..., confirm_probability: _Number = ..., delete_probability: _Number = ..., lifetime: _Number = ..., max_deviation: _Number = ..., merge_distance: _Number = ..., max_tracks: _Whole = ..., max_delay: _Number = ..., noise_direction: Literal['expected', 'predicted'] = ..., position_noise: _Number = ..., velocity_noise: _Number = ..., kappa: _Number = ...) -> None: ...

class LatestOfAll(_LatestOfAll):
    """Sends the latest token of every channel whenever a token comes on any of them."""
    def __init__(self, path: str, *, initial: object = ...) -> None: ...

class Limiter(_Limiter):
    """Limits a signal and its rates of change: an actuator's saturation and slew."""
    def __init__(self, path: str, *, low: _Number = ..., high: _Number = ..., rising: _Number | None = ..., falling: _Number | None = ..., initial: _Number | None = ...) -> None: ...

class Link(_Link):
    """A link in one direction: frames wait, are sent one by one at `rate`, and arrive after `delay`."""
    def __init__(self, path: str, *, delay: _Number = ..., loss: _Number = ..., rate: _Number | None = ..., size: str | float | Formula = ..., order: str | float | Formula = ..., buffer: _Number | None = ...) -> None: ...

class LogNormal(_LogNormal):
    """A positive number whose logarithm is normally distributed."""
    def __init__(self, *, median: _Number = ..., sigma: _Number = ...) -> None: ...

class LogicGate(_LogicGate):
    """Combines truth values: and, or, xor (an odd number is true), and their negations nand, nor, xnor."""
    def __init__(self, path: str, *, function: Literal['and', 'or', 'xor', 'nand', 'nor', 'xnor', 'not'], hold: bool = ...) -> None: ...

class LookupTable(_LookupTable):
    """Looks a number up in a table."""
    def __init__(self, path: str, *, values: abc.Sequence[object], at: _Row | None = ..., outside: Literal['error', 'nearest', 'nothing'] = ...) -> None: ...

class Machine(_Machine):
    """A machine that makes one part after another, breaks down now and then, and waits for repair."""
    def __init__(self, path: str, *, number: _Whole = ..., work_time: Distribution | abc.Mapping[str, object], time_to_failure: Distribution | abc.Mapping[str, object]) -> None: ...

class Match(_Match):
    """Waits until there is a token with an equal `key` on every channel, and sends them as a list: a join."""
    def __init__(self, path: str, *, key: str | float | Formula | None = ...) -> None: ...

class MathFunction(_MathFunction):
    """A common function of one number; angles are in rad."""
    def __init__(self, path: str, *, function: Literal['abs', 'negate', 'sign', 'square', 'sqrt', 'exp', 'log', 'log10', 'sin', 'cos', 'tan', 'asin', 'acos', 'atan', 'floor', 'ceil', 'round']) -> None: ...

class Merge(_Merge):
    """Joins the tokens of all its channels into one stream, one token per microstep."""
    def __init__(self, path: str, *, discard: bool = ...) -> None: ...

class ModalActor(_ModalActor):
    """Base class of actors with modes whose transitions are methods."""
    def __init__(self, path: str) -> None: ...

class MostRecent(_MostRecent):
    """Sends the latest token of each channel whenever it is triggered, even if it has not changed: a zero-order hold."""
    def __init__(self, path: str, *, initial: object = ...) -> None: ...

class MovingAverage(_MovingAverage):
    """The mean of the latest tokens, correctly rounded."""
    def __init__(self, path: str, *, whole: bool = ..., size: _Whole | None = ..., span: _Number | None = ...) -> None: ...

class MovingStatistics(_MovingStatistics):
    """Mean, standard deviation, minimum and maximum of the latest tokens; sent for each token."""
    def __init__(self, path: str, *, size: _Whole | None = ..., span: _Number | None = ...) -> None: ...

class MultiTargetSensor(_MultiTargetSensor):
    """Detects the bodies in range, each with a probability, and clutter; the scan does not say which is which."""
    def __init__(self, path: str, *, kind: Literal['relative_position', 'range'] = ..., along: _Number = ..., across: _Number = ..., max_range: _Number = ..., detection_probability: _Number = ..., clutter: _Number = ..., robot_name: str = ...) -> None: ...

class MultiplyDivide(_MultiplyDivide):
    """The product of the tokens at `multiply`, divided by each token at `divide`."""
    def __init__(self, path: str) -> None: ...

class NegativeBinomial(_NegativeBinomial):
    """The negative binomial distribution: the number of failures before a number of successes."""
    def __init__(self, *, successes: _Number = ..., probability: _Number = ...) -> None: ...

class NetworkSwitch(_NetworkSwitch):
    """A store-and-forward switch: each frame goes to the channel of the output given by `port`, and waits there."""
    def __init__(self, path: str, *, port: str | float | Formula, latency: _Number = ..., rate: _Number | None = ..., size: str | float | Formula = ..., order: str | float | Formula = ..., buffer: _Number | None = ...) -> None: ...

class Normal(_Normal):
    """The normal (Gaussian) distribution."""
    def __init__(self, *, mean: _Number = ..., standard_deviation: _Number = ...) -> None: ...

class ODE(_ODE):
    """A system of ordinary differential equations `dx/dt = f(x, u, t)` that is solved between events."""
    def __init__(self, path: str, *, initial: abc.Mapping[str, _Number], derivatives: abc.Mapping[str, str | float | Formula], where: abc.Mapping[str, str | float | Formula] = ..., crossings: abc.Mapping[str, str | float | Formula] = ..., directions: abc.Mapping[str, Literal['rising', 'falling', 'both']] = ..., resets: abc.Mapping[str, abc.Mapping[str, str | float | Formula]] = ..., held: abc.Mapping[str, _Number] = ..., method: Literal['RK45', 'RK23', 'DOP853', 'Radau', 'BDF', 'Euler'] = ..., relative_tolerance: _Number = ..., absolute_tolerance: _Number = ..., max_step: _Number | None = ..., min_interval: _Number = ...) -> None: ...

class PID(_PID):
    """A controller with a proportional, an integral and a derivative part, which acts at each measurement."""
    def __init__(self, path: str, *, setpoint: _Number = ..., proportional: _Number = ..., integral: _Number = ..., derivative: _Number = ..., integration: Literal['hold', 'trapezoid'] = ..., filter_time: _Number = ..., setpoint_weight: _Number = ..., derivative_weight: _Number = ..., low: _Number = ..., high: _Number = ..., anti_windup: Literal['clamping', 'back_calculation', 'none'] = ..., tracking_time: _Number | None = ..., initial: _Number = ...) -> None: ...

class ParticleEstimator(_ParticleEstimator):
    """A bootstrap particle filter: any belief, and any sensor."""
    def __init__(self, path: str, *, particles: _Whole = ..., samples: _Whole = ..., period: _Number = ..., prior_mean: _Row = ..., prior_variance: _Row = ..., max_delay: _Number = ..., position_noise: _Number = ..., velocity_noise: _Number = ..., kappa: _Number = ...) -> None: ...

class Poisson(_Poisson):
    """The Poisson distribution: the number of rare events."""
    def __init__(self, *, mean: _Number = ...) -> None: ...

class PoissonClock(_PoissonClock):
    """Ticks at random: the times between ticks are independent and exponentially distributed."""
    def __init__(self, path: str, *, mean_interval: _Number = ..., fire_at_start: bool = ..., values: abc.Sequence[object] | None = ..., stop_time: _Number | None = ...) -> None: ...

class Pool(_Pool):
    """Units of a resource: a token at `acquire` requests some and comes back from `granted` when it has them; a token at `release` returns them."""
    def __init__(self, path: str, *, capacity: _Whole = ..., amount: str | float | Formula = ..., preemptive: bool = ..., key: str | float | Formula | None = ..., discipline: Literal['fifo', 'lifo', 'random'] = ..., order: str | float | Formula = ..., room: _Number | None = ..., balking: str | float | Formula | None = ..., patience: _Number | str | float | Formula | Distribution | abc.Mapping[str, object] | None = ...) -> None: ...

class Pools(_Pools):
    """Several pools from which a token acquires units at once or not at all, and to which it releases them at once."""
    def __init__(self, path: str, *, capacity: abc.Mapping[str, _Whole], amount: abc.Mapping[str, str | float | Formula] | None = ..., preemptive: bool = ..., key: str | float | Formula | None = ..., discipline: Literal['fifo', 'lifo', 'random'] = ..., order: str | float | Formula = ..., room: _Number | None = ..., balking: str | float | Formula | None = ..., patience: _Number | str | float | Formula | Distribution | abc.Mapping[str, object] | None = ...) -> None: ...

class Previous(_Previous):
    """Sends for each token the one before it; for the first one `initial`, or nothing if that is left out."""
    def __init__(self, path: str, *, initial: object = ...) -> None: ...

class Pulse(_Pulse):
    """Sends a value at certain triggers, counted from 0, and a zero of the same kind at all others."""
    def __init__(self, path: str, *, values: abc.Sequence[object] = ..., indexes: abc.Sequence[object] = ..., repeat: bool = ..., limit: _Whole | None = ...) -> None: ...

class Quantizer(_Quantizer):
    """Rounds a signal to steps, as an analog-to-digital converter does."""
    def __init__(self, path: str, *, step: _Number, offset: _Number = ..., rounding: Literal['nearest', 'down', 'up'] = ...) -> None: ...

class Queue(_Queue):
    """Keeps tokens, first in, first out, and releases one for each trigger."""
    def __init__(self, path: str, *, capacity: _Whole | None = ..., persistent_trigger: bool = ...) -> None: ...

class Ramp(_Ramp):
    """Counts triggers: sends `init` for the first one, and `step` more for each further one."""
    def __init__(self, path: str, *, init: _Number = ..., step: _Number = ..., limit: _Whole | None = ...) -> None: ...

class Random(_Random):
    """Sends a token drawn from `distribution` for each trigger, independently of all others."""
    def __init__(self, path: str, *, distribution: Distribution | abc.Mapping[str, object]) -> None: ...

class RandomInteger(_RandomInteger):
    """All integers from `low` to `high` with equal probability, both included."""
    def __init__(self, *, low: _Whole = ..., high: _Whole = ...) -> None: ...

class RangeBearingSensor(_RangeBearingSensor):
    """Measures the distance and direction of a target as seen from the vehicle, with normal noise."""
    def __init__(self, path: str, *, landmark: _Row | None = ..., bearing_deviation: _Number = ..., range_deviation: _Number = ..., max_range: _Number = ..., field_of_view: _Number = ...) -> None: ...

class RangeScanner(_RangeScanner):
    """A lidar in the plane: distances to obstacles along beams from the vehicle's position, with noise."""
    def __init__(self, path: str, *, beams: _Whole = ..., field_of_view: _Number = ..., max_range: _Number = ..., deviation: _Number = ..., walls: _Rows = ..., discs: _Rows = ..., body_radius: _Number = ...) -> None: ...

class ReachGoal(_ReachGoal):
    """Eq. (2): the sum of the squared distances to a goal over the horizon."""
    def __init__(self, *, goal: _Row = ...) -> None: ...

class RecordAssembler(_RecordAssembler):
    """Makes one token with fields from tokens at several inputs, which have the names of the fields."""
    def __init__(self, path: str, *, fields: _Texts, onto: str | None = ..., apart: bool = ...) -> None: ...

class RecordDisassembler(_RecordDisassembler):
    """Sends fields of each token by outputs with the names of the fields."""
    def __init__(self, path: str, *, fields: _Texts, partial: bool = ...) -> None: ...

class Recorder(_Recorder):
    """Keeps tokens, for Python to read after the run."""
    def __init__(self, path: str, *, capacity: _Whole | None = ...) -> None: ...

class Register(_Register):
    """Sends the latest token of each channel from before this tag whenever it is triggered."""
    def __init__(self, path: str, *, initial: object = ...) -> None: ...

class Repeat(_Repeat):
    """Sends each token a number of times."""
    def __init__(self, path: str, *, times: _Whole = ...) -> None: ...

class Replay(_Replay):
    """Sends the rows of a CSV or Parquet table, each at its time."""
    def __init__(self, path: str, *, file: str | Path, time: str = ..., columns: _Texts | None = ...) -> None: ...

class ResettableTimer(_ResettableTimer):
    """Sends a value after the number of seconds in the latest token."""
    def __init__(self, path: str, *, preemptive: bool = ..., value: object = ...) -> None: ...

class RobustController(_RobustController):
    """Solves the horizon problem at every trigger and sends the acceleration for the *next* period."""
    def __init__(self, path: str, *, dynamics: Dynamics | abc.Mapping[str, object] | None = ..., objective: Objective | abc.Mapping[str, object] = ..., objectives: abc.Mapping[str, Objective | abc.Mapping[str, object]] = ..., solver: Solver | abc.Mapping[str, object] = ..., dimensions: _Whole = ..., max_speed: _Number = ..., max_acceleration: _Number = ..., climb_speed: _Number = ..., climb_acceleration: _Number = ..., lowest: _Number | None = ..., highest: _Number | None = ..., horizon: _Whole = ..., horizon_from: Literal['now', 'decision'] = ..., period: _Number = ..., safe_distance: _Number = ..., margin: _Number = ..., tube_initial: _Number = ..., tube_growth: _Number = ..., tube_time: Literal['steps', 'seconds'] = ..., covariance_noise: bool = ..., keep_out: _Rows = ..., start: _Row | None = ..., peers_at_start: _Rows = ..., robot_name: str = ..., position_noise: _Number = ..., velocity_noise: _Number = ..., kappa: _Number = ...) -> None: ...

class Router(_Router):
    """Sends each token to one channel of its output: in turn, at random, to the least loaded, or by a property of the token."""
    def __init__(self, path: str, *, policy: Literal['round robin', 'random', 'shortest queue', 'expression'] = ..., weights: _Row | None = ..., channel: str | float | Formula | None = ...) -> None: ...

class SafeController(_SafeController):
    """A `RobustController` that also keeps a retreat open, for a target of bounded speed."""
    def __init__(self, path: str, *, sigma_margin: _Number = ..., target_speed: _Number = ..., turn_time: _Number = ..., dynamics: Dynamics | abc.Mapping[str, object] | None = ..., objective: Objective | abc.Mapping[str, object] = ..., objectives: abc.Mapping[str, Objective | abc.Mapping[str, object]] = ..., solver: Solver | abc.Mapping[str, object] = ..., dimensions: _Whole = ..., max_speed: _Number = ..., max_acceleration: _Number = ..., climb_speed: _Number = ..., climb_acceleration: _Number = ..., lowest: _Number | None = ..., highest: _Number | None = ..., horizon: _Whole = ..., horizon_from: Literal['now', 'decision'] = ..., period: _Number = ..., safe_distance: _Number = ..., margin: _Number = ..., tube_initial: _Number = ..., tube_growth: _Number = ..., tube_time: Literal['steps', 'seconds'] = ..., covariance_noise: bool = ..., keep_out: _Rows = ..., start: _Row | None = ..., peers_at_start: _Rows = ..., robot_name: str = ..., position_noise: _Number = ..., velocity_noise: _Number = ..., kappa: _Number = ...) -> None: ...

class Sampler(_Sampler):
    """Passes on tokens that come at the same tag as a trigger; all others are lost."""
    def __init__(self, path: str) -> None: ...

class Scale(_Scale):
    """Multiplies each token."""
    def __init__(self, path: str, *, factor: _Number = ..., offset: _Number = ...) -> None: ...

class Select(_Select):
    """Passes on the tokens of the channel that the latest `control` token names; those of the others are lost."""
    def __init__(self, path: str, *, unread: Literal['lost', 'kept'] = ..., initial: _Whole | None = ...) -> None: ...

class Sensor(_Sensor):
    """Measures the target's relative position, or its distance, with normal noise (Table II)."""
    def __init__(self, path: str, *, model: SensorModel | abc.Mapping[str, object] | None = ..., kind: Literal['relative_position', 'range'] = ..., along: _Number = ..., across: _Number = ..., max_range: _Number | None = ..., occluders: _Rows = ..., robot_name: str = ...) -> None: ...

class SeparationMonitor(_SeparationMonitor):
    """The smallest distance between any two of several bodies, whenever a state comes and two or more are known."""
    def __init__(self, path: str) -> None: ...

class Sequence(_Sequence):
    """Sends the next of its values for each trigger, and nothing when all are used."""
    def __init__(self, path: str, *, values: abc.Sequence[object], repeat: bool = ..., hold: bool = ...) -> None: ...

class Sequencer(_Sequencer):
    """Passes on tokens in the order of their numbers, which count up from `first`; each waits for its turn."""
    def __init__(self, path: str, *, first: _Whole = ...) -> None: ...

class Server(_Server):
    """Serves tokens in the order of their arrival, `servers` of them at a time, and sends each when its service ends."""
    def __init__(self, path: str, *, service_time: _Number = ..., distribution: Distribution | abc.Mapping[str, object] | None = ..., servers: _Whole | None = ..., capacity: _Whole | None = ...) -> None: ...

class SetFields(_SetFields):
    """Sets fields of tokens: a token with fields is a mapping, as YAML writes it and expressions read it."""
    def __init__(self, path: str, *, draw: abc.Mapping[str, Distribution | abc.Mapping[str, object]] = ..., set: abc.Mapping[str, str | float | Formula] = ..., remove: _Texts = ...) -> None: ...

class SetVariable(_SetVariable):
    """Passes tokens to a `Variable`, and sends the value of the variable at the tag of the change."""
    def __init__(self, path: str, *, value: object = ..., delayed: bool = ...) -> None: ...

class SharedQueue(_SharedQueue):
    """One queue for several consumers: a channel of `trigger` requests a token, and gets it on the same channel of `output`."""
    def __init__(self, path: str, *, capacity: _Whole | None = ...) -> None: ...

class SingleEvent(_SingleEvent):
    """Sends one token at a given time."""
    def __init__(self, path: str, *, time: _Number = ..., value: object = ...) -> None: ...

class Spread(_Spread):
    """Sends the items of a list over the channels of its output, in order; surplus items are lost."""
    def __init__(self, path: str) -> None: ...

class StateMachine(_StateMachine):
    """A state machine with one transition per line, and variables that may flow."""
    def __init__(self, path: str, *, modes: object, transitions: object = ..., initial: str | None = ..., variables: abc.Mapping[str, object] = ..., held: abc.Mapping[str, object] = ..., method: Literal['RK45', 'RK23', 'DOP853', 'Radau', 'BDF', 'Euler'] = ..., relative_tolerance: _Number = ..., absolute_tolerance: _Number = ..., max_step: _Number | None = ...) -> None: ...

class StateSpace(_StateSpace):
    """A linear system in state space, `dx/dt = A x + B u`, `y = C x + D u`."""
    def __init__(self, path: str, *, a: _Rows, b: _Rows, c: _Rows | None = ..., d: _Rows | None = ..., initial: _Row | None = ..., held: _Row | None = ..., sampled: bool = ...) -> None: ...

class Station(_Station):
    """A station with `places`, each of which serves one token at a time; urgent tokens go first."""
    def __init__(self, path: str, *, places: _Whole = ..., service_time: Distribution | abc.Mapping[str, object]) -> None: ...

class StayNear(_StayNear):
    """The sum over the horizon of the squared distances to others, each times its weight: eq. (2) with moving goals."""
    def __init__(self, *, to: abc.Mapping[str, _Number], offset: _Row = ...) -> None: ...

class Stop(_Stop):
    """Ends the run with the tag at which a true token comes; that tag is completed."""
    def __init__(self, path: str) -> None: ...

class StudentT(_StudentT):
    """Student's t distribution."""
    def __init__(self, *, freedom: _Number) -> None: ...

class Switch(_Switch):
    """Sends each token to the channel of its output that the latest `control` token names."""
    def __init__(self, path: str, *, outside: Literal['error', 'nothing'] = ...) -> None: ...

class Synchronizer(_Synchronizer):
    """Waits until there is a token on every channel, and then sends one of each at the same tag."""
    def __init__(self, path: str) -> None: ...

class Test(_Test):
    """Compares tokens with expected values, in order, and ends the run with an error if they differ."""
    def __init__(self, path: str, *, values: abc.Sequence[object], times: _Row | None = ..., tolerance: _Number = ..., complete: bool = ..., together: bool = ..., follow: bool = ...) -> None: ...

class TextFunction(_TextFunction):
    """Applies a function to texts whenever one of its inputs gets a token; each input keeps its latest token."""
    def __init__(self, path: str, *, function: Literal['lower', 'upper', 'trim', 'equals', 'contains', 'starts with', 'ends with', 'find', 'find last', 'replace', 'replace first', 'split'], ignore_case: bool = ..., text: str = ..., other: str = ..., new: str = ...) -> None: ...

class TimeAverage(_TimeAverage):
    """The mean over time of a signal that keeps the value of a token until the next one comes, from 0 s up to now."""
    def __init__(self, path: str) -> None: ...

class TimeCompare(_TimeCompare):
    """Sends the time between a token of `first` and one of `second`: between the first tokens, the second ones, and so on."""
    def __init__(self, path: str, *, nonnegative: bool = ...) -> None: ...

class TimeDelay(_TimeDelay):
    """Sends each token after a delay; with delay 0 at the next microstep."""
    def __init__(self, path: str, *, delay: _Number = ...) -> None: ...

class TimeGap(_TimeGap):
    """Sends the time since the previous token; nothing for the first one."""
    def __init__(self, path: str) -> None: ...

class Timer(_Timer):
    """Sends a value after the number of seconds in each token; any number of times may run in parallel."""
    def __init__(self, path: str, *, value: object = ...) -> None: ...

class TrackingError(_TrackingError):
    """The GOSPA metric of tracks: the distance between the positions of the true bodies and those of the tracks."""
    def __init__(self, path: str, *, cutoff: _Number = ...) -> None: ...

class TransferFunction(_TransferFunction):
    """A linear system with one input and one output, given by its transfer function, such as `2 / (s^2 + 0.4 s + 4)`."""
    def __init__(self, path: str, *, numerator: _Row = ..., denominator: _Row, initial: _Row = ..., held: _Number = ..., sampled: bool = ...) -> None: ...

class Triangular(_Triangular):
    """The triangular distribution between a lowest and a highest number, with a most likely one."""
    def __init__(self, *, low: _Number = ..., mode: _Number = ..., high: _Number = ...) -> None: ...

class Unbatch(_Unbatch):
    """Sends the items of a list one by one, at the same tag."""
    def __init__(self, path: str) -> None: ...

class Unicycle(_Unicycle):
    """A vehicle driven by speed and turn rate: one wheel, or two with separate drives."""
    def __init__(self, path: str, *, turn_rate: _Number = ..., max_turn_rate: _Number = ..., start: _Row = ..., heading: _Number = ..., speed: _Number = ..., max_speed: _Number = ...) -> None: ...

class Uniform(_Uniform):
    """All numbers of an interval with equal probability."""
    def __init__(self, *, low: _Number = ..., high: _Number = ...) -> None: ...

class UnscentedEstimator(_UnscentedEstimator):
    """The unscented Kalman filter of the paper; fuses all measurements of one time at once."""
    def __init__(self, path: str, *, noise_direction: Literal['expected', 'predicted'] = ..., period: _Number = ..., prior_mean: _Row = ..., prior_variance: _Row = ..., max_delay: _Number = ..., position_noise: _Number = ..., velocity_noise: _Number = ..., kappa: _Number = ...) -> None: ...

class Variable(_Variable):
    """A value that may change: a token becomes its value at the next microstep, and is sent then."""
    def __init__(self, path: str, *, delayed: bool = ...) -> None: ...

class VaryingRandom(_VaryingRandom):
    """A `Random` whose distribution changes during the run: some of its parameters have inputs with their names."""
    def __init__(self, path: str, *, varying: _Texts, distribution: Distribution | abc.Mapping[str, object]) -> None: ...

class Vehicle(_Vehicle):
    """A double integrator in the paper's discrete form."""
    def __init__(self, path: str, *, dynamics: Dynamics | abc.Mapping[str, object] | None = ..., start: _Row, start_velocity: _Row | None = ..., max_speed: _Number = ..., max_acceleration: _Number = ..., climb_speed: _Number = ..., climb_acceleration: _Number = ...) -> None: ...

class VonMises(_VonMises):
    """The von Mises distribution of angles, in rad."""
    def __init__(self, *, mean: _Number = ..., concentration: _Number = ...) -> None: ...

class WaitingLine(_WaitingLine):
    """A queue in any order from which each trigger takes a token, sent on the same channel of the output."""
    def __init__(self, path: str, *, size: str | float | Formula = ..., credits: _Whole = ..., persistent_trigger: bool = ..., discipline: Literal['fifo', 'lifo', 'random'] = ..., order: str | float | Formula = ..., room: _Number | None = ..., balking: str | float | Formula | None = ..., patience: _Number | str | float | Formula | Distribution | abc.Mapping[str, object] | None = ...) -> None: ...

class WaitingTime(_WaitingTime):
    """Sends how long each token of `waiter` has waited for a token of `waited_for`; tokens of one tag wait for 0 s."""
    def __init__(self, path: str) -> None: ...

class WaypointFollower(_WaypointFollower):
    """Drives a vehicle along straight lines from waypoint to waypoint, by pure pursuit."""
    def __init__(self, path: str, *, waypoints: _Rows, cruise: _Number = ..., lookahead: _Number = ..., tolerance: _Number = ..., deceleration: _Number | None = ..., wheelbase: _Number | None = ..., closed: bool = ...) -> None: ...

class WaypointMotion(_WaypointMotion):
    """A body that moves from waypoint to waypoint with constant speed, computed from the time alone."""
    def __init__(self, path: str, *, waypoints: _Rows, speed: _Number = ..., appears: _Number = ..., leaves: _Number | None = ..., repeats: bool = ...) -> None: ...
