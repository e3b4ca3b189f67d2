"""Mutants of our sources, as cosmic-ray makes them: which there are, and a sample that is spread over all of them."""

from __future__ import annotations

import ast
import itertools
import random  # noqa: TID251 (of the tool, not of a model)
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from cosmic_ray.ast import ast_nodes, get_ast_from_path
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

GUARDED = ("actors/core", "actors/robotics", "aspects", "runner/execution/engine", "runner/execution/results")

# What numba compiles, and Python runs to the same bits.
KERNELS = ("actors/robotics/numerics/", "actors/core/elementary/")

# Lines that are a matter of taste: how exactly the solver solves, and what kernels are compiled with.
TOLERANCES = {
    "actors/robotics/numerics/warm_up.py": re.compile("[0-9]"),
    "actors/robotics/numerics/barrier.py": re.compile(r"^_?[A-Z][A-Z_]+ = "),
    "actors/robotics/numerics/task.py": re.compile(r"^_?[A-Z][A-Z_]+ = "),
    "actors/robotics/numerics/newton.py": re.compile(r"^_?[A-Z][A-Z_]+ = "),
    "actors/core/elementary/in_numba.py": re.compile(r"^_OPTIONS"),
    "actors/robotics/casadi_solver.py": re.compile(r"^_?[A-Z][A-Z_]+ = |\"ipopt\.|\"max_iter|\"tol"),
}


class Mutant(NamedTuple):
    """One change of one file, by one of cosmic-ray's operators; ``text`` is the file with it, if it has been made."""

    file: str
    line: int
    column: int
    operator: str
    occurrence: int
    text: str = ""

    def made(self, original: str) -> Mutant:
        """With the text, which takes a tenth of a second."""
        return self._replace(text=mutate_code(original, get_operator(self.operator)(), self.occurrence) or "")

    def lines(self, original: str) -> tuple[str, str]:
        """The first line that differs, before and after."""
        pairs = zip(original.splitlines(), self.text.splitlines(), strict=False)
        return next(((old.strip(), new.strip()) for old, new in pairs if old != new), ("", ""))


def mutants_of(root: Path) -> Iterator[Mutant]:
    """All mutants that say something."""
    operators = [(name, get_operator(name)()) for name in operator_names() if not get_operator(name).arguments()]
    operators = [(name, operator) for name, operator in operators if not _is_no_mistake_to_make(name)]
    for path in (path for folder in GUARDED for path in sorted((root / folder).rglob("*.py"))):
        file, counts = str(path.relative_to(root)), Counter[str]()
        for node in list(ast_nodes(get_ast_from_path(path))):
            for name, operator in operators:
                for start, _ in operator.mutation_positions(node):
                    found = Mutant(file, *start, name, counts[name])
                    counts[name] += 1
                    if not _says_nothing(path, found):
                        yield found


def sample(root: Path, mutants: list[Mutant], count: int, seed: int) -> list[Mutant]:
    """So many mutants, at places that are spread evenly over all files; at each place one of those there are."""
    places: dict[tuple[str, int, int], list[Mutant]] = {}
    for mutant in sorted(mutants):
        places.setdefault(mutant[:3], []).append(mutant)
    chance = random.Random(seed)
    step = max(1.0, len(places) / count)
    start = chance.uniform(0.0, step)
    order = list(places.values())
    chosen = [order[int(start + step * number)] for number in range(min(count, len(order)))]
    found = []
    for each in chosen:
        chance.shuffle(each)
        original = (root / each[0].file).read_text(encoding="utf-8")
        made = (mutant.made(original) for mutant in each)
        found += list(itertools.islice((mutant for mutant in made if _is_another(mutant, original)), 1))
    return found


def _is_another(mutant: Mutant, original: str) -> bool:
    """Whether it is Python, and not the same: 2.0**53 + 1 is written as 2.0**53."""
    try:
        compile(mutant.text, mutant.file, "exec")
    except SyntaxError:
        return False
    return mutant.text not in ("", original)


def _says_nothing(path: Path, mutant: Mutant) -> bool:
    """Whether it changes what is never run (annotations), or a tolerance, or how a kernel is compiled."""
    if mutant.operator.endswith("RemoveDecorator") and mutant.file.startswith(KERNELS):
        return True  # it would run as it is, or be compiled otherwise, to the same bits
    text, ranges = _annotations(path)
    tolerances = TOLERANCES.get(mutant.file)
    if tolerances is not None and tolerances.search(text.splitlines()[mutant.line - 1]):
        return True
    at = (mutant.line, mutant.column)
    if text.splitlines()[mutant.line - 1][mutant.column :].startswith(("*,", "*:")):
        return True  # how arguments may be written
    return any(first <= at < last for first, last in ranges)


def _is_no_mistake_to_make(operator: str) -> bool:
    """Shifts and bits of numbers fail at once, which would flatter the score; ``is`` and ``==`` agree on None."""
    kind, _, change = operator.partition("/")[2].partition("_")
    before, _, after = change.partition("_")
    if kind in ("ReplaceBinaryOperator", "ReplaceUnaryOperator"):
        return (before in _BITS) != (after in _BITS)
    if kind == "ReplaceComparisonOperator":
        return (before in _SAME) != (after in _SAME)
    return False


_BITS = {"RShift", "LShift", "BitOr", "BitAnd", "BitXor", "Invert"}
_SAME = {"Is", "IsNot"}


@cache
def _annotations(path: Path) -> tuple[str, list[tuple[tuple[int, int], tuple[int, int]]]]:
    """A file's text, and where it speaks to a type checker only."""
    text = path.read_text(encoding="utf-8")
    nodes: list[ast.AST] = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.arg | ast.AnnAssign) and node.annotation is not None:
            nodes.append(node.annotation)
        elif isinstance(node, ast.FunctionDef):
            nodes += [node.returns] if node.returns is not None else []
            nodes += [each for each in node.decorator_list if ast.unparse(each) in ("overload", "override")]
        elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            nodes.append(node)
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == "cast":
            nodes.append(node.args[0])
    return text, [
        ((node.lineno, node.col_offset), (node.end_lineno or 0, node.end_col_offset or 0))  # type: ignore[attr-defined]
        for node in nodes
    ]
