"""A Newton step for a sum of functions of each step's position, velocity and control.

The sum is kept as its gradient and second derivatives in one 2x2 block for each of them, and the dynamics
``P' = P + period * V``, ``V' = V + period * U`` link the steps: a linear-quadratic control problem, which a Riccati
recursion solves in time linear in the horizon (Rao, Wright & Rawlings, 1998).  For ten steps it takes a fifth of the
time of writing out the dense Hessian in the controls and factorising it.
"""

from __future__ import annotations

import math

import numpy as np

from .compiled import borrower, inner
from .typing import Array

_CURVATURE = 1e-9  # smallest eigenvalue of a repaired block


# Columns of the table that holds all of a step, a row for each prediction step: one array is a fifth of the words, and
# of the code, that seven are at every call.  It is indexed, never sliced: a slice costs as much as a whole term.
POSITION = 0  # gradient and Hessian (x, y, xx, xy, yy) of the function in the position of the step,
VELOCITY = 5  # in its velocity,
CONTROL = 10  # and in its control
_OWN = 15  # dU = -(own + position dP + velocity dV), what the recursion leaves for the way forward: own is (2,),
_BY_POSITION = 17  # these are 2x2 matrices by rows
_BY_VELOCITY = 21
STEP = 25  # (2,) the Newton step in the control
_COLUMNS = 27


@inner
def new_stages(steps: int) -> Array:
    """The zero function over a horizon."""
    return np.zeros((steps, _COLUMNS))


@borrower
def clear(stages: Array) -> None:
    """Make it zero in the positions."""
    for s in range(stages.shape[0]):
        for c in range(5):
            stages[s, POSITION + c] = 0.0


@borrower
def add(
    stages: Array, s: int, slope: float, curvature: float, bend: float,
    gx: float, gy: float, hxx: float, hxy: float, hyy: float,
) -> None:  # fmt: skip
    """Add p(h(.)) in the position of step ``s``: h has the given gradient and Hessian.

    p has the first derivative ``slope``, which ``curvature`` replaces in the Hessian, and the second ``bend``.
    """
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


@borrower
def newton_step(stages: Array, period: float, free: int) -> float:
    """Write the step in the controls; returns gradient . step (negative), or 0 if there is no descent.

    Only the first ``free`` controls are variables; the last of them is held from there on.

    Backwards, the cost to go from step s is kept as a quadratic function of (dP, dV): gradient (a, c), Hessian
    [[A, B], [B', C]].  The control of step s enters dV of the next one, so it is minimised out there; then
    dP of the next step is written as dP + period * dV.  Only positions are repaired: f1, f2 and their barriers are
    convex.

    A control dU that is held from step f on moves step f + k by k h dU in velocity and by k (k - 1) / 2 h^2 dU in
    position, beside what dV of step f and dP of the next one do, so that all that follows is summed in these three.
    """
    h = period
    descent = 0.0
    ax = ay = cx = cy = 0.0
    axx = axy = ayy = bxx = bxy = byx = byy = cxx = cxy = cyy = 0.0
    # What a control costs later on: gradient, Hessian, and mixed derivatives with dP of the next step and dV.
    lx = ly = lxx = lxy = lyy = hbxx = hbxy = hbyx = hbyy = hcxx = hcxy = hcyy = 0.0
    for s in range(free, stages.shape[0]):
        held = s - free + 1.0
        w, by_v = held * h, (held - 1.0) * h
        by_u = 0.5 * w * by_v
        _repair(stages, s)
        gx, gy = stages[s, POSITION], stages[s, POSITION + 1]
        xx, xy, yy = stages[s, POSITION + 2], stages[s, POSITION + 3], stages[s, POSITION + 4]
        vx, vy = stages[s, VELOCITY], stages[s, VELOCITY + 1]
        vxx, vxy, vyy = stages[s, VELOCITY + 2], stages[s, VELOCITY + 3], stages[s, VELOCITY + 4]
        ax, ay, axx, axy, ayy = ax + gx, ay + gy, axx + xx, axy + xy, ayy + yy
        bxx, bxy, byy = bxx + by_v * xx, bxy + by_v * xy, byy + by_v * yy
        cx, cy = cx + by_v * gx + vx, cy + by_v * gy + vy
        cxx, cxy, cyy = cxx + by_v * by_v * xx + vxx, cxy + by_v * by_v * xy + vxy, cyy + by_v * by_v * yy + vyy
        hbxx, hbxy, hbyy = hbxx + by_u * xx, hbxy + by_u * xy, hbyy + by_u * yy
        hcxx, hcxy, hcyy = (
            hcxx + by_v * by_u * xx + w * vxx,
            hcxy + by_v * by_u * xy + w * vxy,
            hcyy + by_v * by_u * yy + w * vyy,
        )
        lx += by_u * gx + w * vx + stages[s, CONTROL]
        ly += by_u * gy + w * vy + stages[s, CONTROL + 1]
        lxx += by_u * by_u * xx + w * w * vxx + stages[s, CONTROL + 2]
        lxy += by_u * by_u * xy + w * w * vxy + stages[s, CONTROL + 3]
        lyy += by_u * by_u * yy + w * w * vyy + stages[s, CONTROL + 4]
    byx, hbyx = bxy, hbxy
    for s in range(free - 1, -1, -1):
        if s < free - 1:  # it is the velocity of the next step
            lx, ly = h * cx, h * cy
            hbxx, hbxy, hbyx, hbyy = h * bxx, h * bxy, h * byx, h * byy
            hcxx, hcxy, hcyy = h * cxx, h * cxy, h * cyy
            lxx, lxy, lyy = h * hcxx, h * hcxy, h * hcyy
        qx, qy = stages[s, CONTROL] + lx, stages[s, CONTROL + 1] + ly
        qxx, qxy, qyy = stages[s, CONTROL + 2] + lxx, stages[s, CONTROL + 3] + lxy, stages[s, CONTROL + 4] + lyy
        determinant = qxx * qyy - qxy * qxy
        if not (determinant > 0.0 and qxx > 0.0):
            return 0.0
        scale = 1.0 / determinant
        ixx, ixy, iyy = scale * qyy, -scale * qxy, scale * qxx
        ux, uy = ixx * qx + ixy * qy, ixy * qx + iyy * qy
        descent -= qx * ux + qy * uy
        # Rows of inverse(Q) times the mixed derivatives: how U_s answers to dP of the next step and to dV of this one.
        pxx, pxy = ixx * hbxx + ixy * hbxy, ixx * hbyx + ixy * hbyy
        pyx, pyy = ixy * hbxx + iyy * hbxy, ixy * hbyx + iyy * hbyy
        vxx, vxy = ixx * hcxx + ixy * hcxy, ixx * hcxy + ixy * hcyy
        vyx, vyy = ixy * hcxx + iyy * hcxy, ixy * hcxy + iyy * hcyy
        stages[s, _OWN], stages[s, _OWN + 1] = ux, uy
        stages[s, _BY_POSITION], stages[s, _BY_POSITION + 1] = pxx, pxy
        stages[s, _BY_POSITION + 2], stages[s, _BY_POSITION + 3] = pyx, pyy
        stages[s, _BY_VELOCITY], stages[s, _BY_VELOCITY + 1] = vxx + h * pxx, vxy + h * pxy
        stages[s, _BY_VELOCITY + 2], stages[s, _BY_VELOCITY + 3] = vyx + h * pyx, vyy + h * pyy
        # The cost without U_s, still in dP of the next step and dV of this one.
        ax -= hbxx * ux + hbxy * uy
        ay -= hbyx * ux + hbyy * uy
        cx -= hcxx * ux + hcxy * uy
        cy -= hcxy * ux + hcyy * uy
        axx -= hbxx * pxx + hbxy * pyx
        axy -= hbxx * pxy + hbxy * pyy
        ayy -= hbyx * pxy + hbyy * pyy
        bxx -= hbxx * vxx + hbxy * vyx
        bxy -= hbxx * vxy + hbxy * vyy
        byx -= hbyx * vxx + hbyy * vyx
        byy -= hbyx * vxy + hbyy * vyy
        cxx -= hcxx * vxx + hcxy * vyx
        cxy -= hcxx * vxy + hcxy * vyy
        cyy -= hcxy * vxy + hcyy * vyy
        # dP of the next step is dP + h dV; then what step s itself costs.
        _repair(stages, s)
        cx += h * ax + stages[s, VELOCITY]
        cy += h * ay + stages[s, VELOCITY + 1]
        cxx += h * (h * axx + 2.0 * bxx) + stages[s, VELOCITY + 2]
        cxy += h * (h * axy + bxy + byx) + stages[s, VELOCITY + 3]
        cyy += h * (h * ayy + 2.0 * byy) + stages[s, VELOCITY + 4]
        bxx += h * axx
        bxy += h * axy
        byx += h * axy
        byy += h * ayy
        ax += stages[s, POSITION]
        ay += stages[s, POSITION + 1]
        axx += stages[s, POSITION + 2]
        axy += stages[s, POSITION + 3]
        ayy += stages[s, POSITION + 4]
    px = py = vx = vy = ux = uy = 0.0
    for s in range(stages.shape[0]):
        if s < free:
            ux = -(
                stages[s, _OWN]
                + stages[s, _BY_POSITION] * px
                + stages[s, _BY_POSITION + 1] * py
                + stages[s, _BY_VELOCITY] * vx
                + stages[s, _BY_VELOCITY + 1] * vy
            )
            uy = -(
                stages[s, _OWN + 1]
                + stages[s, _BY_POSITION + 2] * px
                + stages[s, _BY_POSITION + 3] * py
                + stages[s, _BY_VELOCITY + 2] * vx
                + stages[s, _BY_VELOCITY + 3] * vy
            )
        stages[s, STEP], stages[s, STEP + 1] = ux, uy
        px += h * vx
        py += h * vy
        vx += h * ux
        vy += h * uy
    return descent if descent < 0.0 else 0.0
