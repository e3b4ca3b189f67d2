"""What the benchmarks share: contenders that take turns, medians over rounds, and the rows of the table.

A benchmark that belongs to `make bench` has a function `rows()` that yields a `Row` for each line of the table.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from statistics import median


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table; ``how`` says in one line how the figure was made, ``is_met`` is None without a goal.

    ``reason`` says why the goal is out of reach, by figures of the same table; it is shown where the goal is not met.
    """

    work: str
    peer: str
    result: str
    goal: str
    is_met: bool | None
    how: str
    reason: str = ""


AT_BEST = 0.11  # s of CPU that the loop of ``pace`` takes on the machine of RESULTS.md while its host is idle


def pace() -> float:
    """The CPU time (s) of 3,000,000 turns of a loop in Python: shared machines are not equally fast all the time."""
    began, total = time.process_time(), 0
    for number in range(3_000_000):
        total += number * number
    return time.process_time() - began


def of_the_pace(work: str, took: float, unit: str, paces: Iterable[float]) -> str:
    """The reason why a time misses its goal: the pace at which it was measured, and what it is at the best one."""
    loop = median(paces)
    return (
        f"{work}: times depend on the machine's pace; a loop in Python took {loop:.2f} s of CPU before and after this, "
        f"and takes {AT_BEST:g} s at best, at which this would be {took * AT_BEST / loop:.3g} {unit}"
    )


def cpu_seconds(work: Callable[[], object]) -> float:
    """The CPU time of a call in this process, after collecting garbage."""
    gc.collect()
    before = time.process_time()
    work()
    return time.process_time() - before


def take_turns(contenders: dict[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """What each contender returns, once per round; rounds start with different ones, and the first only warms up."""
    results: dict[str, list[float]] = {name: [] for name in contenders}
    order = list(contenders)
    for number in range(rounds + 1):
        for name in order:
            result = contenders[name]()
            if number:
                results[name].append(result)
        order = [*order[1:], order[0]]
    return results


def ratios(results: dict[str, list[float]], peer: str, ours: str) -> list[float]:
    """The ratio of a peer's time to ours in each round."""
    return [theirs / own for theirs, own in zip(results[peer], results[ours], strict=True)]


def interval(values: list[float]) -> tuple[float, float]:
    """A 95 % interval of the median: order statistics, normal approximation of the binomial law."""
    ordered, reach = sorted(values), 0.98 * len(values) ** 0.5
    return ordered[max(0, int(len(values) / 2 - reach))], ordered[min(len(values) - 1, int(len(values) / 2 + reach))]


def compare(
    work: str,
    results: dict[str, list[float]],
    peer: str,
    ours: str,
    *,
    how: str,
    reason: str = "",
    goal: float | None = None,
    unit: tuple[float, str] = (1.0, "s"),
) -> Row:
    """The row of a peer: the median of the ratios; ``unit`` is a time in seconds, and what is told in it."""
    found = ratios(results, peer, ours)
    ratio = median(found)
    scale, name = unit
    own, theirs = median(results[ours]) / scale, median(results[peer]) / scale
    return Row(
        work,
        peer,
        f"{ratio:.3g}x ({own:.3g} {name} against {theirs:.3g}; {min(found):.3g}x to {max(found):.3g}x)",
        "" if goal is None else f">= {goal:g}x",
        None if goal is None else ratio >= goal,
        how,
        reason,
    )


def table(rows: Iterable[Row]) -> str:
    """The rows in Markdown."""
    head = ["| work | compared with | result | goal | met |", "|---|---|---|---|---|"]
    verdict = {True: "yes", False: "**no**", None: ""}
    lines = [f"| {row.work} | {row.peer} | {row.result} | {row.goal} | {verdict[row.is_met]} |" for row in rows]
    return "\n".join([*head, *lines])
