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
def newton_step(stages: Array, period: float) -> float:
    """Write the step in the controls; returns gradient . step (negative), or 0 if there is no descent.

    Backwards, the cost to go from step s is kept as a quadratic function of (dP, dV): gradient (a, c), Hessian
    [[A, B], [B', C]].  The control of step s enters dV of the next one, so it is minimised out there; then
    dP of the next step is written as dP + period * dV.  Only positions are repaired: f1, f2 and their barriers are
    convex.
    """
    h = period
    descent = 0.0
    ax = ay = cx = cy = 0.0
    axx = axy = ayy = bxx = bxy = byx = byy = cxx = cxy = cyy = 0.0
    for s in range(stages.shape[0] - 1, -1, -1):
        # What U_s costs: its own block, and the velocity of the next step.
        qx, qy = stages[s, CONTROL] + h * cx, stages[s, CONTROL + 1] + h * cy
        hcxx, hcxy, hcyy = h * cxx, h * cxy, h * cyy
        qxx, qxy, qyy = (
            stages[s, CONTROL + 2] + h * hcxx,
            stages[s, CONTROL + 3] + h * hcxy,
            stages[s, CONTROL + 4] + h * hcyy,
        )
        determinant = qxx * qyy - qxy * qxy
        if not (determinant > 0.0 and qxx > 0.0):
            return 0.0
        scale = 1.0 / determinant
        ixx, ixy, iyy = scale * qyy, -scale * qxy, scale * qxx
        ux, uy = ixx * qx + ixy * qy, ixy * qx + iyy * qy
        descent -= qx * ux + qy * uy
        # Rows of inverse(Q) times h B' and h C: how U_s answers to dP of the next step and to dV of this one.
        hbxx, hbxy, hbyx, hbyy = h * bxx, h * bxy, h * byx, h * byy
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
    px = py = vx = vy = 0.0
    for s in range(stages.shape[0]):
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
