"""A Newton step for a sum of functions of each step's position, velocity and control.

The sum is kept as its gradient and second derivatives in one 2x2 block for each of them, and the dynamics
``P' = P + period * V``, ``V' = V + period * U`` link the steps: a linear-quadratic control problem, which a Riccati
recursion solves in time linear in the horizon (Rao, Wright & Rawlings, 1998).  For ten steps it takes a fifth of the
time of writing out the dense Hessian in the controls and factorising it.
"""

from __future__ import annotations

import math

from .compiled import Array, borrower, inlined
from .terms import Term

Vector = tuple[float, float]
Matrix = tuple[float, float, float, float]  # by rows
Quadratic = tuple[float, float, float, float, float]  # gradient and Hessian in the plane: x, y, xx, xy, yy

_CURVATURE = 1e-9  # smallest eigenvalue of a repaired block

# Columns of the table of stages, with a row for each prediction step.  It is one array, as seven would need five
# times the words at every call; and it is indexed, never sliced: a slice costs as much as a whole term.
POSITION = 0  # a quadratic function of the position at the step
VELOCITY = 5  # a quadratic function of the velocity at the step
CONTROL = 10  # a quadratic function of the control that begins to act at the step
STEP = 15  # vector, the Newton step in the control: -(constant + by_position * dP + by_velocity * dV)
_CONSTANT = 17  # vector
_BY_POSITION = 19  # matrix
_BY_VELOCITY = 23  # matrix
STAGE = 27  # columns in all; zeros are the zero function


@borrower
def clear(stages: Array) -> None:
    """Make the function zero in the positions."""
    for s in range(stages.shape[0]):
        for c in range(5):
            stages[s, POSITION + c] = 0.0


@inlined
def put(stages: Array, s: int, column: int, function: Quadratic) -> None:
    """Set the function in the velocity or the control of step ``s``."""
    for c in range(5):
        stages[s, column + c] = function[c]


@borrower
def add(stages: Array, s: int, slope: float, curvature: float, bend: float, inside: Term) -> None:
    """Add p(h(.)) in the position of step ``s``, where ``inside`` is h.

    p has the first derivative ``slope``, which ``curvature`` replaces in the Hessian, and the second ``bend``.
    """
    _, gx, gy, hxx, hxy, hyy = inside
    stages[s, POSITION] += slope * gx
    stages[s, POSITION + 1] += slope * gy
    stages[s, POSITION + 2] += curvature * hxx + bend * gx * gx
    stages[s, POSITION + 3] += curvature * hxy + bend * gx * gy
    stages[s, POSITION + 4] += curvature * hyy + bend * gy * gy


@borrower
def _repair(stages: Array, s: int) -> None:
    """Replace the position's Hessian at step ``s`` by the nearest positive semidefinite one."""
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


@inlined
def _at(stages: Array, s: int, column: int) -> Quadratic:
    return (
        stages[s, column], stages[s, column + 1],
        stages[s, column + 2], stages[s, column + 3], stages[s, column + 4],
    )  # fmt: skip


@inlined
def _sum(p: Quadratic, q: Quadratic) -> Quadratic:
    return p[0] + q[0], p[1] + q[1], p[2] + q[2], p[3] + q[3], p[4] + q[4]


@inlined
def _of_times(k: float, q: Quadratic) -> Quadratic:
    """The function q(k v) of a vector v."""
    return k * q[0], k * q[1], k * k * q[2], k * k * q[3], k * k * q[4]


@inlined
def _less(q: Quadratic, gradient: Vector, hessian: Matrix) -> Quadratic:
    (x, y), (xx, xy, _, yy) = gradient, hessian
    return q[0] - x, q[1] - y, q[2] - xx, q[3] - xy, q[4] - yy


@inlined
def _hessian(q: Quadratic) -> Matrix:
    return q[2], q[3], q[3], q[4]


@inlined
def _plus(m: Matrix, k: float, n: Matrix) -> Matrix:
    """m + k n."""
    return m[0] + k * n[0], m[1] + k * n[1], m[2] + k * n[2], m[3] + k * n[3]


@inlined
def _scaled(k: float, m: Matrix) -> Matrix:
    return k * m[0], k * m[1], k * m[2], k * m[3]


@inlined
def _times(m: Matrix, n: Matrix) -> Matrix:
    (a, b, c, d), (xx, xy, yx, yy) = m, n
    return a * xx + b * yx, a * xy + b * yy, c * xx + d * yx, c * xy + d * yy


@inlined
def _applied(m: Matrix, v: Vector) -> Vector:
    return m[0] * v[0] + m[1] * v[1], m[2] * v[0] + m[3] * v[1]


@borrower
def newton_step(stages: Array, period: float, free: int) -> float:
    """Write the step in the controls; returns gradient . step (negative), or 0 without a descent.

    Only the first ``free`` controls are variables; the last of them is held from there on.

    Backwards, the cost to go from step s is kept as a quadratic function of (dP, dV): A in dP, C in dV, and B, its
    mixed second derivatives, with rows for dP.  The control of step s enters dV of the next one, so it is minimised out
    there; then dP of the next step is written as dP + period * dV.  Only positions are repaired: f1, f2 and their
    barriers are convex.

    A control dU that is held from step f on moves step f + k by k h dU in velocity and by k (k - 1) / 2 h^2 dU in
    position, in addition to the effects of dV of step f and dP of the next one, so everything that follows is summed in
    these three.
    """
    h, descent = period, 0.0
    A = C = U = (0.0, 0.0, 0.0, 0.0, 0.0)
    B = PU = VU = (0.0, 0.0, 0.0, 0.0)  # mixed: PU of dP of the next step with the control, VU of dV with it
    for s in range(free, stages.shape[0]):
        held = s - free + 1.0
        w, by_v = held * h, (held - 1.0) * h
        by_u = 0.5 * w * by_v
        _repair(stages, s)
        position, velocity = _at(stages, s, POSITION), _at(stages, s, VELOCITY)
        A = _sum(A, position)
        B = _plus(B, by_v, _hessian(position))
        C = _sum(_sum(C, _of_times(by_v, position)), velocity)
        PU = _plus(PU, by_u, _hessian(position))
        VU = _plus(_plus(VU, by_v * by_u, _hessian(position)), w, _hessian(velocity))
        U = _sum(U, _sum(_sum(_of_times(by_u, position), _of_times(w, velocity)), _at(stages, s, CONTROL)))
    for s in range(free - 1, -1, -1):
        if s < free - 1:  # it is the velocity of the next step
            PU, VU = _scaled(h, B), _scaled(h, _hessian(C))
            U = h * C[0], h * C[1], h * VU[0], h * VU[1], h * VU[3]
        ux, uy, xx, xy, yy = _sum(_at(stages, s, CONTROL), U)
        determinant = xx * yy - xy * xy
        if not (determinant > 0.0 and xx > 0.0):
            return 0.0
        scale = 1.0 / determinant
        inverse = scale * yy, -scale * xy, -scale * xy, scale * xx
        constant = _applied(inverse, (ux, uy))
        by_position = _times(inverse, (PU[0], PU[2], PU[1], PU[3]))
        by_velocity = _times(inverse, VU)
        descent -= ux * constant[0] + uy * constant[1]
        stages[s, _CONSTANT], stages[s, _CONSTANT + 1] = constant
        by_both = _plus(by_velocity, h, by_position)
        for c in range(4):
            stages[s, _BY_POSITION + c], stages[s, _BY_VELOCITY + c] = by_position[c], by_both[c]
        # The cost without the control, still in dP of the next step and dV of this one.
        A = _less(A, _applied(PU, constant), _times(PU, by_position))
        B = _plus(B, -1.0, _times(PU, by_velocity))
        C = _less(C, _applied(VU, constant), _times(VU, by_velocity))
        # dP of the next step is dP + h dV; then what step s itself costs.
        _repair(stages, s)
        slid = (
            h * A[0], h * A[1],
            h * (h * A[2] + 2.0 * B[0]), h * (h * A[3] + B[1] + B[2]), h * (h * A[4] + 2.0 * B[3]),
        )  # fmt: skip
        C = _sum(C, _sum(slid, _at(stages, s, VELOCITY)))
        B = _plus(B, h, _hessian(A))
        A = _sum(A, _at(stages, s, POSITION))
    px = py = vx = vy = ux = uy = 0.0
    for s in range(stages.shape[0]):
        if s < free:
            for c in range(2):
                p, v = _BY_POSITION + 2 * c, _BY_VELOCITY + 2 * c
                stages[s, STEP + c] = -(
                    stages[s, _CONSTANT + c]
                    + stages[s, p] * px
                    + stages[s, p + 1] * py
                    + stages[s, v] * vx
                    + stages[s, v + 1] * vy
                )
            ux, uy = stages[s, STEP], stages[s, STEP + 1]
        else:
            stages[s, STEP], stages[s, STEP + 1] = ux, uy
        px += h * vx
        py += h * vy
        vx += h * ux
        vy += h * uy
    return descent if descent < 0.0 else 0.0
