"""The truth board as a page of the site: the tables of benchmarks/TRUTH.md, and a picture for each source with numbers.

`make truth` finds the numbers; here they are only drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.truth.board import FOUND, Line, of_text, page

_WIDE = "---\nhide: [navigation, toc]\n---\n\n"
MET, MISSED = "#1f5fa8", "#c8321e"


def truth_page() -> str:
    """The page as Markdown."""
    found = of_text(FOUND.read_text(encoding="utf-8"))
    return _WIDE + page(found, {name: f"truth/{name}.svg" for name, lines in found.items() if _drawn(lines)})


def draw_truth(folder: Path) -> list[Path]:
    """Draw what is published and what we find; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for name, lines in of_text(FOUND.read_text(encoding="utf-8")).items():
        if drawn := _drawn(lines):
            figure = Figure(figsize=(9.0, 4.4), layout="constrained")
            left, right = figure.subplots(1, 2)
            _draw_values(left, drawn)
            _draw_gaps(right, drawn)
            made.append(folder / f"{name}.svg")
            figure.savefig(made[-1])
    return made


def _drawn(lines: Sequence[Line]) -> list[Line]:
    """Those with numbers, misses last, so that they are drawn above the others."""
    return sorted((line for line in lines if line.numbers), key=lambda line: not line.is_met)


def _colour(line: Line) -> str:
    return MET if line.is_met else MISSED


def _draw_values(axes: Axes, lines: Sequence[Line]) -> None:
    """Ours with its interval over what is published, on logarithmic axes."""
    positive = [each for line in lines for each in line.numbers if each > 0.0]
    least, most = min(positive) / 2.0, max(positive) * 2.0
    axes.plot([least, most], [least, most], color="#999999", linewidth=0.8, zorder=1)
    for line in lines:
        published, ours, low, high = (max(each, least) for each in line.numbers)
        axes.plot([published, published], [low, high], color=_colour(line), linewidth=1.2)
        axes.plot(published, ours, marker="o", markersize=3.5, color=_colour(line))
    axes.set(xscale="log", yscale="log", xlim=(least, most), ylim=(least, most), xlabel="published", ylabel="ours")


def _draw_gaps(axes: Axes, lines: Sequence[Line]) -> None:
    """By how much ours is greater, in units of the half of the interval on that side; beyond 1, it is a miss."""
    ordered = sorted(((_gap(*line.numbers), line) for line in lines), key=lambda each: each[0])
    axes.axvspan(-1.0, 1.0, color="#e6edf5", zorder=0)
    for row, (gap, line) in enumerate(ordered):
        axes.plot(gap, row, marker="o", markersize=3.5, color=_colour(line))
    missed = [(gap, f"{line.case}: {line.asked}") for gap, line in ordered if not line.is_met]
    # The corners above and below the curve are empty.
    for words, where, at, side in (
        ([each for gap, each in missed if gap > 0][::-1], (0.02, 0.98), "top", "left"),
        ([each for gap, each in missed if gap < 0][::-1], (0.98, 0.02), "bottom", "right"),
    ):
        text = "\n".join(words)
        axes.text(*where, text, transform=axes.transAxes, va=at, ha=side, fontsize=7, color=MISSED)
    axes.set(yticks=[], ylabel="values in order", xlabel="(ours - published) / half of the interval")


def _gap(published: float, ours: float, low: float, high: float) -> float:
    half = ours - low if ours > published else high - ours
    return (ours - published) / half if half > 0.0 else 0.0
