"""Points that fill a box: Latin hypercubes, and the designs from which sensitivity indices are estimated.

A point is a share of the range of each parameter.  All is drawn here, and not by another library, because a results
folder must have the same points wherever and whenever it is read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from epicycle.actors import random_stream

from ..text.limits import MAX_SEED
from .fields import QUANTITY_SCHEMA, Field, Reader, Record, Schema, node_as, number

Point: TypeAlias = tuple[float, ...]

LATIN, SOBOL, MORRIS = "latin_hypercube", "sobol", "morris"  # forms
MAX_SAMPLES = 100_000  # points of a box, which are made together
MAX_VALUES = 2_000_000  # of all parameters at these points
_BITS = 30  # of a coordinate in a Sobol sequence


@dataclass(frozen=True)
class Design:
    """How the points of a dimension belong together: ``blocks`` of levels, each with one value of each index.

    A block of ``sobol`` is a point A, then A with one coordinate of a point B for each parameter, then B.  A block of
    ``morris`` is a trajectory: of two successive points one coordinate differs, by the signed share in ``steps``.
    """

    form: str
    paths: tuple[str, ...]
    blocks: tuple[tuple[int, ...], ...]
    steps: tuple[tuple[tuple[int, float], ...], ...] = ()  # (parameter, share), of each trajectory


def latin_hypercube(size: int, seed: int, paths: Sequence[str], purpose: str = "latin hypercube") -> list[Point]:
    """Points of which each of ``size`` slices of each range contains one; for another purpose, others."""
    shares = []
    for path in paths:
        stream = random_stream(seed, path, purpose)
        shares.append([(slice_ + stream.random()) / size for slice_ in stream.permutation(size).tolist()])
    return list(zip(*shares, strict=True))


def sobol_blocks(size: int, seed: int, paths: Sequence[str]) -> list[list[Point]]:
    """Blocks for first-order and total indices, from a Sobol sequence with a random digital shift.

    Source: A. Saltelli et al., Variance based sensitivity analysis of model output, Computer Physics Communications
    181, 2010.
    """
    from scipy.stats import qmc

    count = len(paths)
    sequence = qmc.Sobol(2 * count, scramble=False, bits=_BITS).random_base2(size.bit_length() - 1)
    digits = [[int(share * (1 << _BITS)) for share in row] for row in sequence.tolist()]
    streams = [random_stream(seed, path, f"sobol {point}") for point in "AB" for path in paths]
    shifts = [int(stream.random() * (1 << _BITS)) for stream in streams]
    blocks = []
    for row in digits:
        both = [((each ^ shift) + 0.5) / (1 << _BITS) for each, shift in zip(row, shifts, strict=True)]
        a, b = tuple(both[:count]), tuple(both[count:])
        mixed = [(*a[:at], b[at], *a[at + 1 :]) for at in range(count)]
        blocks.append([a, *mixed, b])
    return blocks


def morris_blocks(
    size: int, seed: int, paths: Sequence[str], levels: int
) -> tuple[list[list[Point]], list[tuple[tuple[int, float], ...]]]:
    """Trajectories over a grid, each with one step of about half the range for each parameter, and their steps.

    Source: M. D. Morris, Factorial sampling plans for preliminary computational experiments, Technometrics 33, 1991.
    """
    order = random_stream(seed, "", "morris order")
    streams = [random_stream(seed, path, "morris") for path in paths]
    half, blocks, steps = levels // 2, [], []
    for _ in range(size):
        low = [int(stream.integers(half)) for stream in streams]
        rises = [bool(stream.integers(2)) for stream in streams]
        at = [first if up else first + half for first, up in zip(low, rises, strict=True)]
        points, taken = [tuple(each / (levels - 1) for each in at)], []
        for which in order.permutation(len(paths)).tolist():
            move = half if rises[which] else -half
            at[which] += move
            points.append(tuple(each / (levels - 1) for each in at))
            taken.append((which, move / (levels - 1)))
        blocks.append(points)
        steps.append(tuple(taken))
    return blocks, steps


_RANGE: Schema = {"type": "array", "items": QUANTITY_SCHEMA, "minItems": 2, "maxItems": 2}


def _sampling(size: Reader, about: str, **more: Field) -> Record:
    """The mapping that says how to fill a box; ``about`` is what its size means."""
    keys = {
        "size": Field(size, about),
        "seed": Field(number(int, 0, MAX_SEED), "The seed that the points are drawn with (default: 0)."),
        "ranges": Field(
            node_as({"type": "object", "additionalProperties": _RANGE}), "'path: [low, high]' for each parameter."
        ),
    }
    return Record("", {**keys, **more}, required=["size", "ranges"])


_BLOCKS = number(int, 2, MAX_SAMPLES)
_LEVELS = Field(number(int, 2, 1_000), "The values of the grid in each range, an even number (default: 4).")
HYPERCUBE = _sampling(number(int, 1, MAX_SAMPLES), "The number of points.")
SOBOL_INDICES = _sampling(_BLOCKS, "A power of 2: the number of blocks, of two points more than there are ranges.")
MORRIS_INDICES = _sampling(
    _BLOCKS, "The number of trajectories; each has a point per range, and one more.", levels=_LEVELS
)
SAMPLINGS = {LATIN: HYPERCUBE, SOBOL: SOBOL_INDICES, MORRIS: MORRIS_INDICES}
