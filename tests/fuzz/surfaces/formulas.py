"""Formulas of monitors and of metrics that are computed from others."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.fuzz.surfaces.case import MODEL, Case, Surface, chosen, write
from tests.fuzz.surfaces.expressions import PIECES

_GOOD = ("scale.output <= 20", "ramp.output > 1", "scale.output >= ramp.output", "abs(scale.output) < 2")
_LEAVES = ("scale.output <= 20", "scale.output", "ramp.output > 1 m", "scale.output >= nope", "nope.output < 3",
           "clock.output", "scale[*].output < 1", "**.output > 0", "abs(scale.output) < 2", "true", "1", "size < 3",
           "scale.output <= 1e400", "scale.output == 'a'", "scale.output % 0 > 1")  # fmt: skip
_GOOD_AROUND = (
    "not ({0})",
    "always ({0})",
    "eventually within 3 s ({0})",
    "({0}) and ({1})",
    "({0}) or ({1})",
    "({0}) implies ({1})",
    "({0}) until within 2 s ({1})",
    "({0}) for 2 s",
    "always from 1 s to 2 s ({0})",
)
_AROUND = (
    "always within -1 s ({0})",
    "next {0}",
    "eventually[0, 5] ({0})",
    "({0}) since ({1})",
    "for every scale[*]: {0}",
    "for all scale ({0})",
    "always ({0}",
    "rise({0})",
    "({0}) => ({1})",
    "if {0} then {1}",
    "always within 1e300 s {0}",
    "all({0})",
    "any({0})",
    "({0}) for 1e18 s",
    "always from 3 s to 1 s {0}",
)


def formula(random: np.random.Generator, depth: int = 0) -> str:
    """A property of pieces that may or may not fit each other."""
    if depth > int(chosen(random, (1, 3, 60))) or random.random() < 0.3:
        kind = random.random()
        return str(chosen(random, _GOOD if kind < 0.7 else _LEAVES if kind < 0.95 else PIECES))
    around = str(chosen(random, _GOOD_AROUND if random.random() < 0.9 else _AROUND))
    return around.format(formula(random, depth + 1), formula(random, depth + 4) if "{1}" in around else "")


def _make(random: np.random.Generator, home: Path, folder: Path) -> Case:
    text = f"always ({formula(random)})"[:20_000]
    match int(random.integers(4)):
        case 0:
            text = formula(random, 60).replace("scale.output", "value")
            changed = MODEL.replace("take: last}", f"take: share, when: '{_quoted(text)}'}}")
        case 1:
            text = " / ".join(str(chosen(random, ("last", "low_robustness", *PIECES))) for _ in range(3))
            changed = MODEL.replace("take: last}", f"take: last}}, more: {{from: '{_quoted(text)}', unit: '1'}}")
        case 2:
            return Case(
                ("explain", home / "m.yaml", "--monitor", text, "--runs", 3, "--out", folder / "out", "--no-page")
            )
        case _:
            changed = MODEL.replace("always scale.output <= 20", f"'{_quoted(text)}'")
    return Case(("run", write(folder, "m.yaml", changed)))


def _quoted(text: str) -> str:
    return text.replace("'", "''").replace("\x00", "")


def _prepare(home: Path) -> None:
    write(home, "m.yaml", MODEL)


SURFACE = Surface("formulas", _prepare, _make)
