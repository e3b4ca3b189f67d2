"""Explicit embedded Runge-Kutta methods: the common part, and the tableau of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

from .stepper import GROWTH_LIMIT, SHRINK_LIMIT, Derivative, Limits, Piece, State, Stepper, norm, stretch

_SAFETY: Final = 0.9
Weights = tuple[tuple[int, float], ...]  # pairs of a stage and its weight; stages with weight 0 are left out
Stage = tuple[float, Weights]  # where in the step a derivative is evaluated, and the weights for its state


@dataclass(frozen=True, eq=False)
class Tableau:
    """The coefficients of a method; stage 0 is the derivative at the start, the last of ``stages`` that at the end.

    ``errors`` has the embedded formula, or the two that DOP853 combines.  ``order`` is that of the error.  The rows of
    ``dense``, over ``stages`` and then ``extra``, are the coefficients of the interpolating polynomial, with factors x,
    x, x, ..., or if it ``alternates``, x, 1 - x, x, ...
    """

    order: int
    stages: tuple[Stage, ...]
    errors: tuple[Weights, ...]
    dense: tuple[Weights, ...]
    extra: tuple[Stage, ...] = ()
    alternates: bool = False

    @cached_property
    def factors(self) -> list[tuple[float, float]]:
        """The factors of the polynomial, each as slope and offset."""
        return [(-1.0, 1.0) if self.alternates and number % 2 else (1.0, 0.0) for number in range(len(self.dense))]

    @cached_property
    def sums(self) -> Sums:
        """The weighted sums of this tableau, made once."""
        return Sums(
            [(share, _moved(weights)) for share, weights in self.stages],
            [(share, _moved(weights)) for share, weights in self.extra],
            [_sum(weights) for weights in self.errors],
            _rows(self.dense),
        )


Sum = Callable[[list[State]], State]  # of the derivatives at stages
Moved = Callable[[State, float, list[State]], State]  # a state, and a step times the sum added to it
Rows = Callable[[float, list[State]], Iterable[tuple[float, ...]]]  # a step times each of several sums


class Sums(NamedTuple):
    """The weighted sums of a tableau as functions, with its weights in their code."""

    stages: list[tuple[float, Moved]]
    extra: list[tuple[float, Moved]]
    errors: list[Sum]
    dense: Rows


def _sum(weights: Weights) -> Sum:
    text, names, stages = _written(weights)
    made: Sum = _function(f"lambda rates: [{text} for {names}, in zip({stages})]")
    return made


def _rows(sums: tuple[Weights, ...]) -> Rows:
    _, names, stages = _written(tuple({stage: 1.0 for weights in sums for stage, _ in weights}.items()))
    texts = [f"step * ({_written(weights)[0]})" for weights in sums]
    made: Rows = _function(f"lambda step, rates: zip(*[({', '.join(texts)},) for {names}, in zip({stages})])")
    return made


def _moved(weights: Weights) -> Moved:
    text, names, stages = _written(weights)
    made: Moved = _function(f"lambda state, step, rates: [x + step * ({text}) for x, {names} in zip(state, {stages})]")
    return made


def _written(weights: Weights) -> tuple[str, str, str]:
    """A sum in the order of its terms, beginning with 0; the names in it, and what they are of."""
    text = "".join(f" + {weight!r} * v{stage}" for stage, weight in weights)
    return f"0.0{text}", ", ".join(f"v{stage}" for stage, _ in weights), ", ".join(f"rates[{s}]" for s, _ in weights)


def _function(text: str) -> Any:
    return eval(text, {"__builtins__": {"zip": zip}})


class Unrolled(NamedTuple):
    """The functions of ``unrolled``, and what they need to know of a solution."""

    attempt: Callable[..., tuple[list[State], State, list[float]] | None]
    dense: Callable[..., Iterable[tuple[float, ...]] | None]
    context: tuple[float, Sequence[float], Sequence[float]]  # fraction, origins, held


class RungeKutta(Stepper):
    """The explicit method of a tableau; the polynomial along a step is computed only on request."""

    def __init__(self, tableau: Tableau, derivative: Derivative, state: State, limits: Limits) -> None:
        super().__init__(tableau.order, derivative, state, limits)
        self.tableau = tableau
        self._unrolled: Unrolled | None = None
        self._begin: tuple[float, State] = 0.0, state
        self._latest = [self.rates]  # the derivatives at the stages of the latest step
        self._growth = GROWTH_LIMIT  # of the next step

    def prepare(self, step: float) -> None:
        self._growth = GROWTH_LIMIT

    def unroll(self, unrolled: Unrolled) -> None:
        """Compute steps by these functions, where they decide."""
        self._unrolled = unrolled

    def attempt(self, end: float, step: float) -> float | None:
        found = None
        if (unrolled := self._unrolled) is not None:
            limits, begin = self.limits, (self.time, step, self.state, self.rates)
            found = unrolled.attempt(*begin, limits.relative, limits.absolute, *unrolled.context)
        if found is None:
            rates = [self.rates]
            state = self._pass(self.tableau.sums.stages, (self.time, self.state), step, rates)
            scale = self.scale(self.state, state)
            errors = [norm(each(rates), scale) for each in self.tableau.sums.errors]
        else:
            rates, state, errors = found
        error = _joined(errors, step)
        factor = stretch(error, _SAFETY, self.tableau.order)
        if error < 1.0:
            self._begin, self._latest = (self.time, self.state), rates
            self.time, self.state, self.rates = end, state, rates[-1]
            self.next_step = step * min(factor, self._growth)
            return None
        self._growth = 1.0
        return max(SHRINK_LIMIT, factor)  # also for NaN

    def _pass(
        self, stages: Iterable[tuple[float, Moved]], begin: tuple[float, State], step: float, rates: list[State]
    ) -> State:
        """Evaluate derivatives at stages, and append them to ``rates``; returns the state at the last one."""
        time, start = begin
        state, derivative = start, self.derivative
        for share, moved in stages:
            state = moved(start, step, rates)
            rates.append(derivative(time + share * step, state))
        return state

    def piece(self) -> Piece:
        start, state = self._begin
        step, rows = self.time - start, None
        if (unrolled := self._unrolled) is not None:
            rows = unrolled.dense(start, step, state, self._latest, *unrolled.context)
        if rows is None:
            rates = list(self._latest)
            self._pass(self.tableau.sums.extra, self._begin, step, rates)
            rows = self.tableau.sums.dense(step, rates)
        return Piece(start, self.time, start, step, self.tableau.factors, [state, *rows])


def _joined(errors: list[float], step: float) -> float:
    """The error of a step, from the norms of its parts."""
    if len(errors) == 1 or errors[0] == 0.0:
        return step * errors[0]
    high, low = errors
    return step * high * high / math.sqrt(high * high + 0.01 * low * low)


# fmt: off

# P. Bogacki, L. F. Shampine: A 3(2) pair of Runge-Kutta formulas, Appl. Math. Lett. 2 (1989) 321-325.
RK23: Final = Tableau(
    order=2,
    stages=(
        (1 / 2, ((0, 1 / 2),)),
        (3 / 4, ((1, 3 / 4),)),
        (1.0, ((0, 2 / 9), (1, 1 / 3), (2, 4 / 9))),
    ),
    errors=(((0, 5 / 72), (1, -1 / 12), (2, -1 / 9), (3, 1 / 8)),),
    dense=(
        ((0, 1.0),),
        ((0, -4 / 3), (1, 1.0), (2, 4 / 3), (3, -1.0)),
        ((0, 5 / 9), (1, -2 / 3), (2, -8 / 9), (3, 1.0)),
    ),
)

# J. R. Dormand, P. J. Prince: A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980) 19-26; the
# polynomial: L. F. Shampine: Some practical Runge-Kutta formulas, Math. Comput. 46 (1986) 135-150.
RK45: Final = Tableau(
    order=4,
    stages=(
        (1 / 5, ((0, 1 / 5),)),
        (3 / 10, ((0, 3 / 40), (1, 9 / 40))),
        (4 / 5, ((0, 44 / 45), (1, -56 / 15), (2, 32 / 9))),
        (8 / 9, ((0, 19372 / 6561), (1, -25360 / 2187), (2, 64448 / 6561), (3, -212 / 729))),
        (1.0, ((0, 9017 / 3168), (1, -355 / 33), (2, 46732 / 5247), (3, 49 / 176), (4, -5103 / 18656))),
        (1.0, ((0, 35 / 384), (2, 500 / 1113), (3, 125 / 192), (4, -2187 / 6784), (5, 11 / 84))),
    ),
    errors=(((0, -71 / 57600), (2, 71 / 16695), (3, -71 / 1920), (4, 17253 / 339200), (5, -22 / 525), (6, 1 / 40)),),
    dense=(
        ((0, 1.0),),
        ((0, -8048581381 / 2820520608), (2, 131558114200 / 32700410799), (3, -1754552775 / 470086768), (4, 127303824393
            / 49829197408), (5, -282668133 / 205662961), (6, 40617522 / 29380423)),
        ((0, 8663915743 / 2820520608), (2, -68118460800 / 10900136933), (3, 14199869525 / 1410260304), (4, -318862633887
            / 49829197408), (5, 2019193451 / 616988883), (6, -110615467 / 29380423)),
        ((0, -12715105075 / 11282082432), (2, 87487479700 / 32700410799), (3, -10690763975 / 1880347072),
            (4, 701980252875 / 199316789632), (5, -1453857185 / 822651844), (6, 69997945 / 29380423)),
    ),
)

# E. Hairer, S. P. Norsett, G. Wanner: Solving Ordinary Differential Equations I, section II.5 and appendix (DOP853).
_WEIGHTS_853: Final = ((0, 0.054293734116568765), (5, 4.450312892752409), (6, 1.8915178993145003),
    (7, -5.801203960010585), (8, 0.3111643669578199), (9, -0.1521609496625161), (10, 0.20136540080403034),
    (11, 0.04471061572777259))
DOP853: Final = Tableau(
    order=7,
    stages=(
        (0.05260015195876773, ((0, 0.05260015195876773),)),
        (0.0789002279381516, ((0, 0.0197250569845379), (1, 0.0591751709536137))),
        (0.1183503419072274, ((0, 0.02958758547680685), (2, 0.08876275643042054))),
        (0.2816496580927726, ((0, 0.2413651341592667), (2, -0.8845494793282861), (3, 0.924834003261792))),
        (0.3333333333333333, ((0, 0.037037037037037035), (3, 0.17082860872947386), (4, 0.12546768756682242))),
        (0.25, ((0, 0.037109375), (3, 0.17025221101954405), (4, 0.06021653898045596), (5, -0.017578125))),
        (0.3076923076923077, ((0, 0.03709200011850479), (3, 0.17038392571223998), (4, 0.10726203044637328),
            (5, -0.015319437748624402), (6, 0.008273789163814023))),
        (0.6512820512820513, ((0, 0.6241109587160757), (3, -3.3608926294469414), (4, -0.868219346841726),
            (5, 27.59209969944671), (6, 20.154067550477894), (7, -43.48988418106996))),
        (0.6, ((0, 0.47766253643826434), (3, -2.4881146199716677), (4, -0.590290826836843), (5, 21.230051448181193),
            (6, 15.279233632882423), (7, -33.28821096898486), (8, -0.020331201708508627))),
        (0.8571428571428571, ((0, -0.9371424300859873), (3, 5.186372428844064), (4, 1.0914373489967295),
            (5, -8.149787010746927), (6, -18.52006565999696), (7, 22.739487099350505), (8, 2.4936055526796523),
            (9, -3.0467644718982196))),
        (1.0, ((0, 2.273310147516538), (3, -10.53449546673725), (4, -2.0008720582248625), (5, -17.9589318631188),
            (6, 27.94888452941996), (7, -2.8589982771350235), (8, -8.87285693353063), (9, 12.360567175794303),
            (10, 0.6433927460157636))),
        (1.0, _WEIGHTS_853),
    ),
    errors=(
        ((0, 0.01312004499419488), (5, -1.2251564463762044), (6, -0.4957589496572502), (7, 1.6643771824549864),
            (8, -0.35032884874997366), (9, 0.3341791187130175), (10, 0.08192320648511571), (11, -0.022355307863886294)),
        ((0, -0.18980075407240762), (5, 4.450312892752409), (6, 1.8915178993145003), (7, -5.801203960010585),
            (8, -0.4226823213237919), (9, -0.1521609496625161), (10, 0.20136540080403034), (11, 0.02265179219836082)),
    ),
    extra=(
        (0.1, ((0, 0.056167502283047954), (6, 0.25350021021662483), (7, -0.2462390374708025), (8, -0.12419142326381637),
            (9, 0.15329179827876568), (10, 0.00820105229563469), (11, 0.007567897660545699), (12, -0.008298))),
        (0.2, ((0, 0.03183464816350214), (5, 0.028300909672366776), (6, 0.053541988307438566),
            (7, -0.05492374857139099), (10, -0.00010834732869724932), (11, 0.0003825710908356584),
            (12, -0.00034046500868740456), (13, 0.1413124436746325))),
        (0.7777777777777778, ((0, -0.42889630158379194), (5, -4.697621415361164), (6, 7.683421196062599),
            (7, 4.06898981839711), (8, 0.3567271874552811), (12, -0.0013990241651590145), (13, 2.9475147891527724),
            (14, -9.15095847217987))),
    ),
    alternates=True,
    dense=(
        _WEIGHTS_853,
        ((0, 1.0 - _WEIGHTS_853[0][1]), *((stage, -weight) for stage, weight in _WEIGHTS_853[1:])),
        ((0, 2.0 * _WEIGHTS_853[0][1] - 1.0), *((stage, 2.0 * weight) for stage, weight in _WEIGHTS_853[1:]),
            (12, -1.0)),
        ((0, -8.428938276109013), (5, 0.5667149535193777), (6, -3.0689499459498917), (7, 2.38466765651207),
            (8, 2.117034582445028), (9, -0.871391583777973), (10, 2.2404374302607883), (11, 0.6315787787694688),
            (12, -0.08899033645133331), (13, 18.148505520854727), (14, -9.194632392478356), (15, -4.436036387594894)),
        ((0, 10.427508642579134), (5, 242.28349177525817), (6, 165.20045171727028), (7, -374.5467547226902),
            (8, -22.113666853125306), (9, 7.733432668472264), (10, -30.674084731089398), (11, -9.332130526430229),
            (12, 15.697238121770845), (13, -31.139403219565178), (14, -9.35292435884448), (15, 35.81684148639408)),
        ((0, 19.985053242002433), (5, -387.0373087493518), (6, -189.17813819516758), (7, 527.8081592054236),
            (8, -11.57390253995963), (9, 6.8812326946963), (10, -1.0006050966910838), (11, 0.7777137798053443),
            (12, -2.778205752353508), (13, -60.19669523126412), (14, 84.32040550667716), (15, 11.99229113618279)),
        ((0, -25.69393346270375), (5, -154.18974869023643), (6, -231.5293791760455), (7, 357.6391179106141),
            (8, 93.40532418362432), (9, -37.45832313645163), (10, 104.0996495089623), (11, 29.8402934266605),
            (12, -43.53345659001114), (13, 96.32455395918828), (14, -39.17726167561544), (15, -149.72683625798564)),
    ),
)
