"""The paper's equations as written there, one function for each; docs/paper.md says which kernel computes which.

Nothing here is fast.  The compiled kernels are tested against this module, and the solver ``Casadi`` builds its program
from it: the functions take arrays of numbers and arrays of symbols.  Lengths are in metres, times in seconds,
information in nats.  Vectors have d numbers: 2 in the plane, 3 in space with the height last; a symmetric matrix is
given by the rows of its upper triangle.  N is the number of prediction steps s = 1..N, a row of an array each; step s
lies at t + tau, tau = s * period.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any, TypeAlias

import numpy as np

from .compiled import Array

Posed: TypeAlias = Any  # a ``Problem``

_TINY = 1e-18  # m^2; gives a root a slope also at zero, and changes it by less than 1e-9 m


def _norm(offsets: Any) -> Any:
    """The Euclidean lengths of offsets (..., d)."""
    return np.sqrt((offsets * offsets).sum(axis=-1) + _TINY)


def target_after(state: Any, period: float) -> Any:
    """Eq. (1): the target's state (x, y, vx, vy) a period later, without its process noise omega."""
    position, velocity = state[:2], state[2:]
    return np.concatenate([position + period * velocity, velocity])


def measured_range(target: Any, robot: Any) -> Any:
    """z_t of eq. (1), m: the ranges of targets (..., d) from robots (..., d), without their noise eta."""
    return _norm(target - robot)


def dynamics(state: Any, control: Any, period: Any) -> Any:
    """The equality constraint of eq. (2): the state (P, V) a period after another one, under the control U, in m/s^2.

    The first state of a horizon is (Pr_{t+1}, V_{t+1}), which no unknown control can change; then U_{t+1} acts.
    """
    d = len(control)
    moved = [state[i] + period * state[d + i] for i in range(d)]
    return [*moved, *[state[d + i] + period * control[i] for i in range(d)]]


def f0(positions: Any, goal: Any) -> Any:
    """Eq. (2), (N,) in m^2: the squared distance to the goal (1, 2), which the paper puts at the origin, or to one that
    moves (N, 2)."""
    offsets = positions - goal
    return (offsets * offsets).sum(axis=-1)


def f0_of_several(positions: Any, places: Any, weights: Any) -> Any:
    """f0 of several goals that move (k, N, d), each with its weight (k,): (N,) in m^2.

    It is the f0 of their ``common_goal``, times the sum of the weights, and a term that no plan changes.
    """
    offsets = positions - places
    return (weights[:, np.newaxis] * (offsets * offsets).sum(axis=-1)).sum(axis=0)


def common_goal(places: Any, weights: Any) -> Any:
    """The goal (N, d) in m that has the optimum of ``f0_of_several``: the weighted mean of the places (k, N, d)."""
    return (weights[:, np.newaxis, np.newaxis] * places).sum(axis=0) / weights.sum()


def f1(velocities: Any, max_speed: Any, climb_speed: Any = math.inf) -> Any:
    """Eq. (2), (N,) in m^2/s^2: |V|^2 - Vmax^2.

    In space, Vz counts times Vmax / ``climb_speed``: an ellipsoid with ``climb_speed`` as its vertical half axis.
    """
    return _weighed(velocities, max_speed, climb_speed) - max_speed * max_speed


def f2(controls: Any, max_acceleration: Any, climb_acceleration: Any = math.inf) -> Any:
    """Eq. (2), (N,) in m^2/s^4: |U|^2 - Amax^2; in space, with ``climb_acceleration`` as its vertical half axis."""
    return _weighed(controls, max_acceleration, climb_acceleration) - max_acceleration * max_acceleration


def _weighed(vectors: Any, limit: Any, climb: Any) -> Any:
    """(N,), the squared lengths, where what is vertical counts times ``limit`` / ``climb``."""
    level, upright = vectors[:, :2], vectors[:, 2:] * (limit / climb)
    return (level * level).sum(axis=-1) + (upright * upright).sum(axis=-1)


def f7(positions: Any, lowest: Any, highest: Any) -> Any:
    """(2, N) in m: how far the height is below the lowest one, and above the highest one."""
    return np.stack([lowest - positions[:, 2], positions[:, 2] - highest])


def f3(positions: Any, planned: Any, radius: Any) -> Any:
    """Eq. (2), (N,) in m: the distance to the standing plan Rs (N, d) minus its ``radius`` sigma_r (N,)."""
    return _norm(planned - positions) - radius


def f4(positions: Any, obstacle: Any, safe_distance: Any) -> Any:
    """Eq. (2), (N,) in m: Dmin minus the distance to the obstacle Po (N, d)."""
    return safe_distance - _norm(obstacle - positions)


def f5(positions: Any, peer: Any, safe_distance: Any) -> Any:
    """Eq. (2), (N,) in m: Dmin minus the distance to another robot Ro_i (N, d)."""
    return safe_distance - _norm(peer - positions)


def sigma_r(initial: float, growth: float, tau: Array) -> Array:
    """Eq. (3), (N,) in m: the radius of a reachability set, sigma_r0 + beta * tau."""
    return initial + growth * tau


def sigma_4(positions: Any, obstacle: Any, covariance: Any) -> Any:
    """Eq. (4), (N,) in m: the standard deviation of f4, from C (N, d (d + 1) / 2) of the obstacle's position."""
    slope = (positions - obstacle) / _norm(positions - obstacle)[:, np.newaxis]  # d f4 / d Po
    rows, columns = np.triu_indices(slope.shape[1])
    twice = np.where(rows == columns, 1.0, 2.0)
    return np.sqrt((twice * slope[:, rows] * covariance * slope[:, columns]).sum(axis=-1) + _TINY)


def sigma_5(radius: Array, growth: float, lost: int) -> Array:
    """Eq. (4), (N,) in m: sigma_r + beta * d_i, where d_i messages have been lost since the latest one."""
    return radius + growth * lost


def _positive(values: Any) -> Any:
    """max(0, .) of each element."""
    return np.maximum(0.0, values)


def f6(positions: Any, obstacle: Any, reach: Any, positive: Any = _positive) -> Any:
    """Eq. (5), (N,) in m: max(0, distance to the obstacle Po (N, d) minus Dmax).

    A solver that works on symbols has variables in the place of the maximum.
    """
    return positive(_norm(obstacle - positions) - reach)


def misfit(points: Any, robots: Any, variance: Any, across: Any = None) -> Any:
    """Eq. (5), (M, M): -log PDF(z_i; z_j, eta) for ranges of sigma points (M, d) from robots (n, d), of variance eta.

    Without the constant of the normal density, which shifts the information but not the optimum.  With ``across``,
    m^2, robots also measure the direction, as in eq. (1): two points at the ranges z_i and z_j whose directions differ
    by an angle are 2 sqrt(z_i z_j) sin(angle / 2) apart across the line of sight, which is what their difference in
    range leaves of their distance.
    """
    z = measured_range(points[:, np.newaxis], robots)  # (M, n)
    difference = z[:, np.newaxis] - z
    along = difference * difference
    if across is None:
        return along.sum(axis=-1) / (2.0 * variance)
    offset = points[:, np.newaxis] - points
    apart = (offset * offset).sum(axis=-1)
    return (along / (2.0 * variance) + (apart[..., np.newaxis] - along) / (2.0 * across)).sum(axis=-1)


def mutual_information(own: Any, points: Any, weights: Any, variance: Any, others: Any, across: Any = None) -> Any:
    """I of eq. (5), nat, of the ranges from ``own`` (d,) and from other robots, whose ``misfit`` is ``others`` (M, M).

    The sigma points (M, d) at the end of the horizon have the ``weights`` (M,), all of them positive.
    """
    density = np.exp(-misfit(points, own[np.newaxis], variance, across) - others)  # PDF(z_i; z_j, eta)
    return -(weights * np.log((weights * density).sum(axis=1))).sum()


def constraints(problem: Posed, positions: Any, decided: int = 2) -> Any:
    """f3, f4 of each obstacle, f5 of each peer with their margins alpha * sigma, and in space f7, in m: satisfied where
    <= 0.

    (1 + K + n, N - decided), or two rows more: in the paper's dynamics, the positions at steps 1 and 2 are ``decided``
    before the first unknown control acts.
    ``peer_distance`` of the problem is Dmin with the margin of f5.  sigma_1 to sigma_3 are zero.
    """
    rows = [f3(positions, problem.tube_centre, problem.tube_radius)]
    for mean, covariance in zip(problem.obstacle_mean, problem.obstacle_covariance, strict=True):
        margin = problem.margin * sigma_4(positions, mean, covariance)
        rows.append(f4(positions, mean, problem.safe_distance) + margin)
    for mean, distance in zip(problem.peer_mean, problem.peer_distance, strict=True):
        rows.append(f5(positions, mean, distance))
    if positions.shape[1] == 3:
        rows.extend(f7(positions, problem.lowest, problem.highest))
    return np.stack(rows)[:, decided:]


def joint_events(tracks: int, detections: int) -> Any:
    """All joint events: for each track the detection 1..m that it caused, no two the same, or 0 if it caused none."""
    for event in product(range(detections + 1), repeat=tracks):
        caused = [each for each in event if each]
        if len(caused) == len(set(caused)):
            yield event


def association(missed: Array, likelihood: Array, density: float, existence: Array) -> tuple[Array, Array]:
    """JIPDA: how likely each track exists after the scan (T,), and the probability that, if so, it caused no detection,
    or each one (T, 1 + m), summed over all joint events; JPDA, if ``existence`` (T,), how likely it did before, is 1.

    A joint event is one of the tracks that exist; the others caused nothing.  Its density is the product of ``missed``
    (T,), 1 - P_D P_G, of each track without a detection, of the ``likelihood`` (T, m), P_D N(z_j; z, S) inside the gate
    and 0 outside, of each with one, and of the ``density`` of detections from elsewhere for each that no track caused.
    """
    tracks, detections = likelihood.shape
    result, total = np.zeros((tracks, 1 + detections)), 0.0
    for there in product((False, True), repeat=tracks):
        for event in joint_events(tracks, detections):
            worth = density ** (detections - sum(each > 0 for each in event))
            for t, each in enumerate(event):
                if there[t]:
                    worth *= existence[t] * (likelihood[t, each - 1] if each else missed[t])
                else:
                    worth *= 0.0 if each else 1.0 - existence[t]
            total += worth
            here = np.flatnonzero(there)
            result[here, np.array(event, dtype=int)[here]] += worth
    after = result.sum(axis=1)
    return after / total, result / after[:, np.newaxis]


def mixture(probabilities: Array, means: Array, covariances: Array) -> tuple[Array, Array]:
    """JPDA: the mean (n,) and covariance of a track that is one of several normal distributions."""
    mean = (probabilities[:, np.newaxis] * means).sum(axis=0)
    apart = means - mean
    spread = covariances + apart[:, :, np.newaxis] * apart[:, np.newaxis]
    return mean, (probabilities[:, np.newaxis, np.newaxis] * spread).sum(axis=0)


def gospa(truth: Array, tracks: Array, cutoff: float) -> float:
    """GOSPA, p = 2 and alpha = 2, m: of positions (n, 2) and (m, 2), by trying every assignment."""
    squares = ((truth[:, np.newaxis] - tracks) ** 2).sum(axis=-1)
    totals = []
    for event in joint_events(len(truth), len(tracks)):
        pairs = [(i, j - 1) for i, j in enumerate(event) if j]
        alone = len(truth) + len(tracks) - 2 * len(pairs)
        totals.append(sum(squares[pair] for pair in pairs) + cutoff**2 / 2.0 * alone)
    return float(np.sqrt(min(totals)))


def integrated_ou(speed: float, turn_time: float, elapsed: float, kept: float) -> tuple[Array, Array]:
    """The model of a target of bounded speed: transition (4, 4) of its state (x, y, vx, vy), and the covariance gained.

    Its velocity is an Ornstein-Uhlenbeck process of which the share ``kept`` = exp(-elapsed / turn_time) is left; in
    each direction the stationary variance is speed^2 / 2, which is that of ``speed`` in an unknown direction.  With
    T = turn_time, r = kept and s = 1 - r:

        x' = x + T s v,  v' = r v
        gained, times speed^2 / 2:  var v' 1 - r^2,  cov(x', v') T s^2,  var x' T (2 t - T s (2 + s))
    """
    variance, lost = 0.5 * speed * speed, 1.0 - kept
    way = turn_time * lost
    transition, gained = np.eye(4), np.zeros((4, 4))
    for i in range(2):
        transition[i, i + 2], transition[i + 2, i + 2] = way, kept
        gained[i, i] = max(0.0, variance * turn_time * (2.0 * elapsed - way * (2.0 + lost)))
        gained[i, i + 2] = gained[i + 2, i] = variance * way * lost
        gained[i + 2, i + 2] = variance * (1.0 - kept * kept)
    return transition, gained
