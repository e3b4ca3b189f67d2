"""A Newton step for a sum of functions of each step's position, velocity and control.

The sum is kept as its gradient and second derivatives in one 2x2 block for each of them, and the dynamics
``P' = P + period * V``, ``V' = V + period * U`` link the steps: a linear-quadratic control problem, which a Riccati
recursion solves in time linear in the horizon (Rao, Wright & Rawlings, 1998).  For ten steps it takes a fifth of the
time of writing out the dense Hessian in the controls and factorising it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compiled import borrower, inner
from .typing import Array

_CURVATURE = 1e-9  # smallest eigenvalue of a repaired block


class Blocks(NamedTuple):
    """Gradient and Hessian of a function, in blocks per prediction step: (x, y, xx, xy, yy)."""

    position: Array  # (N, 5)
    velocity: Array  # (N, 5)
    control: Array  # (N, 5)


class Feedback(NamedTuple):
    """What the recursion leaves for the way forward: dU = -(own + position dP + velocity dV)."""

    own: Array  # (N, 2)
    position: Array  # (N, 4) 2x2 matrices by rows
    velocity: Array  # (N, 4)


@inner
def new_blocks(steps: int) -> Blocks:
    """Blocks for a horizon, not yet cleared."""
    return Blocks(np.empty((steps, 5)), np.empty((steps, 5)), np.empty((steps, 5)))


@inner
def new_feedback(steps: int) -> Feedback:
    """Room for the recursion."""
    return Feedback(np.empty((steps, 2)), np.empty((steps, 4)), np.empty((steps, 4)))


@borrower
def clear(blocks: Blocks) -> None:
    """Make it the zero function."""
    for s in range(blocks.position.shape[0]):
        for c in range(5):
            blocks.position[s, c] = blocks.velocity[s, c] = blocks.control[s, c] = 0.0


# Blocks are indexed, never sliced: a slice of an array costs as much as a whole term.


@borrower
def add(
    blocks: Array, s: int, slope: float, curvature: float, bend: float,
    gx: float, gy: float, hxx: float, hxy: float, hyy: float,
) -> None:  # fmt: skip
    """Add p(h(.)) to block ``s``: h has the given gradient and Hessian.

    p has the first derivative ``slope``, which ``curvature`` replaces in the Hessian, and the second ``bend``.
    """
    blocks[s, 0] += slope * gx
    blocks[s, 1] += slope * gy
    blocks[s, 2] += curvature * hxx + bend * gx * gx
    blocks[s, 3] += curvature * hxy + bend * gx * gy
    blocks[s, 4] += curvature * hyy + bend * gy * gy


@borrower
def _repair(blocks: Array, s: int) -> None:
    """Replace block ``s`` by the nearest positive semidefinite one."""
    xx, xy, yy = blocks[s, 2], blocks[s, 3], blocks[s, 4]
    if xx + yy >= 2.0 * _CURVATURE and (xx - _CURVATURE) * (yy - _CURVATURE) >= xy * xy:
        return
    mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    radius = math.sqrt(half * half + xy * xy)
    low, high = max(mean - radius, _CURVATURE), max(mean + radius, _CURVATURE)
    mean, spread = 0.5 * (low + high), 0.5 * (high - low)
    scale = spread / radius if radius > 0.0 else 0.0
    blocks[s, 2], blocks[s, 3], blocks[s, 4] = mean + half * scale, xy * scale, mean - half * scale


@borrower
def newton_step(blocks: Blocks, period: float, feedback: Feedback, step: Array) -> float:
    """Write the step (N, 2) in the controls; returns gradient . step (negative), or 0 if there is no descent.

    Backwards, the cost to go from step s is kept as a quadratic function of (dP, dV): gradient (a, c), Hessian
    [[A, B], [B', C]].  The control of step s enters dV of the next one, so it is minimised out there; then
    dP of the next step is written as dP + period * dV.  Only positions are repaired: f1, f2 and their barriers are
    convex.
    """
    h = period
    descent = 0.0
    ax = ay = cx = cy = 0.0
    axx = axy = ayy = bxx = bxy = byx = byy = cxx = cxy = cyy = 0.0
    for s in range(blocks.position.shape[0] - 1, -1, -1):
        # What U_s costs: its own block, and the velocity of the next step.
        qx, qy = blocks.control[s, 0] + h * cx, blocks.control[s, 1] + h * cy
        hcxx, hcxy, hcyy = h * cxx, h * cxy, h * cyy
        qxx, qxy, qyy = (
            blocks.control[s, 2] + h * hcxx,
            blocks.control[s, 3] + h * hcxy,
            blocks.control[s, 4] + h * hcyy,
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
        feedback.own[s, 0], feedback.own[s, 1] = ux, uy
        feedback.position[s, 0], feedback.position[s, 1] = pxx, pxy
        feedback.position[s, 2], feedback.position[s, 3] = pyx, pyy
        feedback.velocity[s, 0], feedback.velocity[s, 1] = vxx + h * pxx, vxy + h * pxy
        feedback.velocity[s, 2], feedback.velocity[s, 3] = vyx + h * pyx, vyy + h * pyy
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
        _repair(blocks.position, s)
        cx += h * ax + blocks.velocity[s, 0]
        cy += h * ay + blocks.velocity[s, 1]
        cxx += h * (h * axx + 2.0 * bxx) + blocks.velocity[s, 2]
        cxy += h * (h * axy + bxy + byx) + blocks.velocity[s, 3]
        cyy += h * (h * ayy + 2.0 * byy) + blocks.velocity[s, 4]
        bxx += h * axx
        bxy += h * axy
        byx += h * axy
        byy += h * ayy
        ax += blocks.position[s, 0]
        ay += blocks.position[s, 1]
        axx += blocks.position[s, 2]
        axy += blocks.position[s, 3]
        ayy += blocks.position[s, 4]
    px = py = vx = vy = 0.0
    for s in range(step.shape[0]):
        p, v = feedback.position, feedback.velocity
        ux = -(feedback.own[s, 0] + p[s, 0] * px + p[s, 1] * py + v[s, 0] * vx + v[s, 1] * vy)
        uy = -(feedback.own[s, 1] + p[s, 2] * px + p[s, 3] * py + v[s, 2] * vx + v[s, 3] * vy)
        step[s, 0], step[s, 1] = ux, uy
        px += h * vx
        py += h * vy
        vx += h * ux
        vy += h * uy
    return descent if descent < 0.0 else 0.0
