"""Expressions: in models, in actors, and in options."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.fuzz.mutants import HOSTILE
from tests.fuzz.surfaces.case import MODEL, Case, Surface, chosen, write

PIECES = (
    "1", "0", "-1", "2.5", "1e308", "9**99", "10**18", "x", "size", "wait", "token", "time", "index", "inf", "nan",
    "pi",
    "'a'", "'a' * 9999", "[1, 2, 3]", "[1, 2, 3][0:1, 0]", "[1, 2][::0]", "[0] * 99999", "range(99999)", "{'a': 1}",
    "{'a': [1]}['a']", "[i for i in range(999)]", "().__class__", "open('/etc/passwd')",
    "__import__('os').system('id')",
    "lambda: 1", "(x := 3)", "f'{size}'", "true", "null", "len('a')", "sum([1, 2])", "max([])", "sorted(['a', 1])",
    "1 m", "3 km/h", "1 / 0", "0.0 ** -1", "(-8) ** 0.5", "int('9' * 4000)", "round(1.5, 99)", "str([[1]])", "a.b.c",
    "*[1]", "1 if 2 else", "not", "1 < 2 < 'a'", "'\\ud800'", "\u202e", "\x00",
)  # fmt: skip
_AROUND = (
    "({0}) + ({1})", "({0}) * ({1})", "({0}) ** ({1})", "[{0}, {1}]", "[{0} for i in {1}]", "max({0}, {1})", "-({0})",
    "({0})[{1}]", "({0})[{1}:{0}]", "({0}) if ({1}) else ({0})", "{{'a': {0}}}", "len({0})", "str({0})", "range({0})",
    "({0}) in ({1})", "sum({0})", "sorted({0})", "float({0})", "({0}) % ({1})", "({0}) == ({1})", "not ({0})",
)  # fmt: skip


def grown(random: np.random.Generator, depth: int = 0) -> str:
    """An expression of pieces that do not fit each other."""
    if depth > int(chosen(random, (0, 1, 4))) or random.random() < 0.25:
        return str(chosen(random, PIECES[:21] if random.random() < 0.8 else PIECES))
    return str(chosen(random, _AROUND)).format(grown(random, depth + 1), grown(random, depth + 1))


def _make(random: np.random.Generator, home: Path, folder: Path) -> Case:
    text = grown(random) if random.random() < 0.9 else str(chosen(random, HOSTILE))
    plain = text.replace("'", "''").replace("\x00", "")
    match int(random.integers(4)):
        case 0:
            return Case(("validate", home / "m.yaml", "--set", f"size=${{{text}}}"))
        case 1:
            changed = MODEL.replace("size: 2.0", f"size: '${{{plain}}}'")
        case 2:
            changed = MODEL.replace("{type: Scale, factor: 2}", f"{{type: Expression, expression: '{plain}'}}")
            changed = changed.replace("ramp.output -> scale.input", "ramp.output -> scale.x")
            changed = changed.replace("at: scale.input", "at: scale.x")
        case _:
            changed = MODEL.replace("probability: 0.3", f"probability: '${{{plain}}}'")
    return Case(("run", write(folder, "m.yaml", changed), "--until", "3 s"))


def _prepare(home: Path) -> None:
    write(home, "m.yaml", MODEL)


SURFACE = Surface("expressions", _prepare, _make)
