"""How far tracks are from the truth: the generalised optimal sub-pattern assignment metric.

(Rahmathullah, Garcia-Fernandez & Svensson, Proc. Fusion 2017, with p = 2 and alpha = 2.)
"""

from __future__ import annotations

import math

import numpy as np

from ...core.elementary import hypot
from .compiled import Array, Table, inner, kernel


@inner
def _least_cost(costs: Array) -> Array:
    """For each row of costs (n, m), n <= m, its column in the assignment of least total cost: the Hungarian method with
    shortest augmenting paths (Kuhn; Jonker & Volgenant, Computing 38, 1987)."""
    rows, columns = costs.shape
    of_row, of_column = np.zeros(rows + 1), np.zeros(columns + 1)  # dual variables
    owner, way = np.zeros(columns + 1, np.int64), np.zeros(columns + 1, np.int64)
    for row in range(1, rows + 1):
        owner[0], column = row, 0
        least, seen = np.full(columns + 1, math.inf), np.zeros(columns + 1)
        while owner[column] != 0:
            seen[column] = 1.0
            here, step, following = owner[column], math.inf, 0
            for j in range(1, columns + 1):
                if seen[j] == 0.0:
                    reduced = costs[here - 1, j - 1] - of_row[here] - of_column[j]
                    if reduced < least[j]:
                        least[j], way[j] = reduced, column
                    if least[j] < step:
                        step, following = least[j], j
            for j in range(columns + 1):
                if seen[j] != 0.0:
                    of_row[owner[j]] += step
                    of_column[j] -= step
                else:
                    least[j] -= step
            column = following
        while column != 0:
            owner[column] = owner[way[column]]
            column = way[column]
    result = np.empty(rows)
    for j in range(1, columns + 1):
        if owner[j] != 0:
            result[owner[j] - 1] = j - 1
    return result


@kernel
def gospa(truth: Table, tracks: Table, cutoff: float) -> tuple[float, float, int, int]:
    """The GOSPA metric (p = 2, alpha = 2) of positions (n, 2) and (m, 2): itself, m; the root mean square error of the
    pairs nearer than ``cutoff``, m; how many of the truth are missed; and how many tracks are false."""
    count, found = truth.shape[0], tracks.shape[0]
    costs = np.zeros((count, found + count))  # a column for each track, then for each of the truth to be missed
    for i in range(count):
        for j in range(found + count):
            costs[i, j] = cutoff * cutoff
            if j < found:
                away = hypot(truth[i, 0] - tracks[j, 0], truth[i, 1] - tracks[j, 1])
                costs[i, j] = min(away, cutoff) * min(away, cutoff)
    squares, pairs = 0.0, 0
    chosen = _least_cost(costs)
    for i in range(count):
        cost = costs[i, int(chosen[i])]
        if cost < cutoff * cutoff:
            squares += cost
            pairs += 1
    alone = count + found - 2 * pairs
    error = math.sqrt(squares / pairs) if pairs > 0 else 0.0
    return math.sqrt(squares + 0.5 * cutoff * cutoff * alone), error, count - pairs, found - pairs
