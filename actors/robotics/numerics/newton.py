"""A Newton step for a sum of functions of each step's position, velocity and control.

The sum is kept as its gradient and second derivatives in one d x d block for each of them, d = 2 or 3, and the dynamics
``P' = P + period * V``, ``V' = V + period * U`` link the steps: a linear-quadratic control problem, which a Riccati
recursion solves in time linear in the horizon (Rao, Wright & Rawlings, 1998).  For ten steps it takes a fifth of the
time of writing out the dense Hessian in the controls and factorising it.
"""

from __future__ import annotations

import math

from .compiled import Array, borrower, inlined
from .vectors import (
    Matrix,
    Quadratic,
    Term,
    Vector,
    applied,
    dot,
    inverse_of,
    packed,
    plus,
    quadratic_size,
    read,
    replaced,
    row,
    scaled,
    symmetric_size,
    times,
    total,
    transposed,
    write,
    zero_matrix,
    zero_quadratic,
    zero_symmetric,
)

_CURVATURE = 1e-9  # smallest eigenvalue of a repaired block
_SWEEPS = 8  # of rotations, to the last digit of a block's eigenvalues in space

# Columns of the table of stages, with a row for each prediction step, in d dimensions.  It is one array, as seven would
# need five times the words at every call; and it is indexed, never sliced: a slice costs as much as a whole term.
POSITION = 0  # a quadratic function of the position at the step


@inlined
def velocity_column(d: int) -> int:
    """A quadratic function of the velocity at the step."""
    return quadratic_size(d)


@inlined
def control_column(d: int) -> int:
    """A quadratic function of the control that begins to act at the step."""
    return 2 * quadratic_size(d)


@inlined
def step_column(d: int) -> int:
    """The Newton step in the control: -(constant + by_position * dP + by_velocity * dV).

    A vector; then the constant, a vector, and the two matrices.
    """
    return 3 * quadratic_size(d)


@inlined
def stage_columns(d: int) -> int:
    """Columns in all; zeros are the zero function."""
    return 3 * quadratic_size(d) + 2 * d + 2 * d * d


@borrower
def clear(stages: Array, zero: Vector) -> None:
    """Make the function zero in the positions."""
    for s in range(stages.shape[0]):
        write(stages, s, POSITION, zero_quadratic(zero))


@borrower
def add(stages: Array, s: int, slope: float, curvature: float, bend: float, inside: Term) -> None:
    """Add p(h(.)) in the position of step ``s``, where ``inside`` is h.

    p has the first derivative ``slope``, which ``curvature`` replaces in the Hessian, and the second ``bend``.
    """
    d = 2 if len(inside) == 6 else 3
    for i in range(d):
        stages[s, POSITION + i] += slope * inside[1 + i]
        for j in range(i, d):
            place = d + packed(d, i, j)
            stages[s, POSITION + place] += curvature * inside[1 + place] + bend * inside[1 + i] * inside[1 + j]


@borrower
def _repair(stages: Array, s: int, zero: Vector) -> None:
    """Replace the position's Hessian at step ``s`` by the nearest positive semidefinite one."""
    if len(zero) == 3:
        _repair_in_space(stages, s, zero)
        return
    xx, xy, yy = stages[s, POSITION + 2], stages[s, POSITION + 3], stages[s, POSITION + 4]
    if xx + yy >= 2.0 * _CURVATURE and (xx - _CURVATURE) * (yy - _CURVATURE) >= xy * xy:
        return
    mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    radius = math.sqrt(half * half + xy * xy)
    low, high = max(mean - radius, _CURVATURE), max(mean + radius, _CURVATURE)
    mean, spread = 0.5 * (low + high), 0.5 * (high - low)
    scale = spread / radius if radius > 0.0 else 0.0
    stages[s, POSITION + 2], stages[s, POSITION + 4] = mean + half * scale, mean - half * scale
    stages[s, POSITION + 3] = xy * scale


@borrower
def _repair_in_space(stages: Array, s: int, zero: Vector) -> None:
    """The same in three dimensions, by Jacobi's rotations: in the plane, one of them would do."""
    d = len(zero)
    block = read(zero_symmetric(zero), stages, s, POSITION + d)
    above = block
    for i in range(d):
        above = replaced(above, packed(d, i, i), block[packed(d, i, i)] - _CURVATURE)
    if inverse_of(above, zero_matrix(zero))[0]:
        return
    m = axes = zero_matrix(zero)  # m = axes * block * axes^T, in the end diagonal
    for i in range(d):
        axes = replaced(axes, i * d + i, 1.0)
        for j in range(d):
            m = replaced(m, i * d + j, block[packed(d, i, j)])
    for _ in range(_SWEEPS):
        for i in range(d):
            for j in range(i + 1, d):
                mixed = m[i * d + j]
                if mixed == 0.0:
                    continue
                ratio = (m[j * d + j] - m[i * d + i]) / (2.0 * mixed)
                tangent = 1.0 / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
                tangent = tangent if ratio >= 0.0 else -tangent
                cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
                sine = cosine * tangent
                turn = zero_matrix(zero)
                for k in range(d):
                    turn = replaced(turn, k * d + k, 1.0)
                turn = replaced(replaced(turn, i * d + i, cosine), j * d + j, cosine)
                turn = replaced(replaced(turn, i * d + j, -sine), j * d + i, sine)
                m, axes = times(times(turn, m), transposed(turn)), times(turn, axes)
    for i in range(d):
        for j in range(i, d):
            summed = 0.0
            for k in range(d):
                summed += max(m[k * d + k], _CURVATURE) * axes[k * d + i] * axes[k * d + j]
            stages[s, POSITION + d + packed(d, i, j)] = summed


@inlined
def _dimensions(q: Quadratic) -> int:
    return 2 if len(q) == 5 else 3


@inlined
def _of_times(k: float, q: Quadratic) -> Quadratic:
    """The function q(k v) of a vector v."""
    d = _dimensions(q)
    for c in range(len(q)):
        q = replaced(q, c, (k if c < d else k * k) * q[c])
    return q


@inlined
def _less(q: Quadratic, gradient: Vector, hessian: Matrix) -> Quadratic:
    d = _dimensions(q)
    for i in range(d):
        q = replaced(q, i, q[i] - gradient[i])
        for j in range(i, d):
            place = d + packed(d, i, j)
            q = replaced(q, place, q[place] - hessian[i * d + j])
    return q


@inlined
def _hessian(like: Matrix, q: Quadratic) -> Matrix:
    d = _dimensions(q)
    for i in range(d):
        for j in range(d):
            like = replaced(like, i * d + j, q[d + packed(d, i, j)])
    return like


@inlined
def _next_velocity(h: float, C: Quadratic, VU: Matrix) -> Quadratic:
    """The function of a control that becomes h times it in the velocity of the next step."""
    d, made = _dimensions(C), C
    for i in range(d):
        made = replaced(made, i, h * C[i])
        for j in range(i, d):
            made = replaced(made, d + packed(d, i, j), h * VU[i * d + j])
    return made


@inlined
def _slid(h: float, A: Quadratic, B: Matrix) -> Quadratic:
    """What dP + h dV in place of dP adds in dV."""
    d, made = _dimensions(A), A
    for i in range(d):
        made = replaced(made, i, h * A[i])
        for j in range(i, d):
            place = d + packed(d, i, j)
            if i == j:
                made = replaced(made, place, h * (h * A[place] + 2.0 * B[i * d + i]))
            else:
                made = replaced(made, place, h * (h * A[place] + B[i * d + j] + B[j * d + i]))
    return made


@borrower
def newton_step(stages: Array, period: float, free: int, zero: Vector) -> float:
    """Write the step in the controls; returns gradient . step (negative), or 0 without a descent.

    ``zero`` is a vector of zeros.  Only the first ``free`` controls are variables; the last of them is held from there
    on.

    Backwards, the cost to go from step s is kept as a quadratic function of (dP, dV): A in dP, C in dV, and B, its
    mixed second derivatives, with rows for dP.  The control of step s enters dV of the next one, so it is minimised out
    there; then dP of the next step is written as dP + period * dV.  Only positions are repaired: f1, f2 and their
    barriers are convex.

    A control dU that is held from step f on moves step f + k by k h dU in velocity and by k (k - 1) / 2 h^2 dU in
    position, in addition to the effects of dV of step f and dP of the next one, so everything that follows is summed in
    these three.
    """
    h, descent, d = period, 0.0, len(zero)
    velocity_at, control_at, step_at = velocity_column(d), control_column(d), step_column(d)
    constant_at, by_position_at = step_at + d, step_at + 2 * d
    by_velocity_at = by_position_at + d * d
    nothing = A = C = U = zero_quadratic(zero)
    none = B = PU = VU = zero_matrix(zero)  # mixed: PU of dP of the next step with the control, VU of dV with it
    for s in range(free, stages.shape[0]):
        held = s - free + 1.0
        w, by_v = held * h, (held - 1.0) * h
        by_u = 0.5 * w * by_v
        _repair(stages, s, zero)
        position, velocity = read(nothing, stages, s, POSITION), read(nothing, stages, s, velocity_at)
        A = total(A, position)
        B = plus(B, by_v, _hessian(none, position))
        C = total(total(C, _of_times(by_v, position)), velocity)
        PU = plus(PU, by_u, _hessian(none, position))
        VU = plus(plus(VU, by_v * by_u, _hessian(none, position)), w, _hessian(none, velocity))
        acting = total(total(_of_times(by_u, position), _of_times(w, velocity)), read(nothing, stages, s, control_at))
        U = total(U, acting)
    for s in range(free - 1, -1, -1):
        if s < free - 1:  # it is the velocity of the next step
            PU, VU = scaled(h, B), scaled(h, _hessian(none, C))
            U = _next_velocity(h, C, VU)
        function = total(read(nothing, stages, s, control_at), U)
        gradient = row(zero, function, 0)
        block = zero_symmetric(zero)
        for c in range(symmetric_size(d)):
            block = replaced(block, c, function[d + c])
        definite, inverse = inverse_of(block, none)
        if not definite:
            return 0.0
        constant = applied(inverse, gradient)
        by_position = times(inverse, transposed(PU))
        by_velocity = times(inverse, VU)
        descent -= dot(gradient, constant)
        write(stages, s, constant_at, constant)
        write(stages, s, by_position_at, by_position)
        write(stages, s, by_velocity_at, plus(by_velocity, h, by_position))
        # The cost without the control, still in dP of the next step and dV of this one.
        A = _less(A, applied(PU, constant), times(PU, by_position))
        B = plus(B, -1.0, times(PU, by_velocity))
        C = _less(C, applied(VU, constant), times(VU, by_velocity))
        # dP of the next step is dP + h dV; then what step s itself costs.
        _repair(stages, s, zero)
        C = total(C, total(_slid(h, A, B), read(nothing, stages, s, velocity_at)))
        B = plus(B, h, _hessian(none, A))
        A = total(A, read(nothing, stages, s, POSITION))
    p = v = u = zero
    for s in range(stages.shape[0]):
        if s < free:
            for c in range(d):
                summed = stages[s, constant_at + c]
                for k in range(d):
                    summed += stages[s, by_position_at + d * c + k] * p[k]
                for k in range(d):
                    summed += stages[s, by_velocity_at + d * c + k] * v[k]
                u = replaced(u, c, -summed)
        write(stages, s, step_at, u)
        p = plus(p, h, v)
        v = plus(v, h, u)
    return descent if descent < 0.0 else 0.0
