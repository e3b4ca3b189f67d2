"""Finds arithmetic whose bits hang on the machine: `python -m tests.arithmetic` tells where, with exit code 1.

IEEE 754 says how + - * / and square roots are rounded, and nothing else.  Powers, libm's functions, matrix products,
reductions of NumPy and the built-in ``sum`` of floats differ from library to library or from version to version, so
nothing that a run tells may come from them (docs/semantics.md, "The same bits everywhere").  Ruff's ``banned-api``
knows names, but neither operators nor methods, and leaves no reason for an exception; so all of it is here.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("actors", "aspects", "bridges", "ptolemy", "runner")

_LIBM = "exp exp2 expm1 log log1p log2 log10 sin cos tan sinh cosh tanh pow hypot cbrt"
_INVERSE = "asin acos atan atan2 asinh acosh atanh"
_REDUCTIONS = "sum mean std var prod cumsum cumprod dot trace"
BANNED = {  # of a module, all that is banned; "*" for everything
    "math": f"{_LIBM} {_INVERSE} dist gamma lgamma erf erfc sumprod",
    "numpy": f"{_LIBM} {_INVERSE} {_REDUCTIONS} arcsin arccos arctan arctan2 arcsinh arccosh arctanh power float_power "
    "logaddexp logaddexp2 sinc i0 average nansum nanmean nanstd nanvar nanprod nancumsum nancumprod median percentile "
    "quantile nanmedian nanpercentile nanquantile vdot vecdot inner matmul matvec vecmat tensordot einsum linalg fft "
    "convolve correlate corrcoef cov trapezoid trapz interp polyfit polyval logspace geomspace",
    "numpy.random": "default_rng RandomState",
    "operator": "pow ipow matmul imatmul",
    "cmath": "*",
    "scipy": "*",
    "casadi": "*",
    "filterpy": "*",
}
METHODS = frozenset(_REDUCTIONS.split())
_COUNTS = ("len", "bool")

DRAWN = "what is drawn or told to people; no digest, token, metric or table comes from it"
FOREIGN = "a foreign library computes; docs/semantics.md says that the promise ends there"
PAPER = "what kernels are tested against, and a foreign library's program; no token is computed by it"
FITTED = "estimates from measured data; a run gets them as parameters, written out in a file"
FRACTIONS = "powers of fractions and whole numbers, which are exact"
WHOLE = "sums of whole numbers"
EXCEPTIONS = {  # file or folder: what it may use, and why
    "actors/core/elementary/powers.py": (("**", "pow"), "powers of whole numbers, and the pow of this file"),
    "actors/core/elementary/tables.py": (("sum",), WHOLE),
    "actors/core/quantity.py": (("**",), FRACTIONS),
    "actors/core/units.py": (("**",), FRACTIONS),
    "actors/expression/values.py": (("**",), "of quantities, which say themselves how"),
    "actors/logic.py": (("sum",), WHOLE),
    "actors/robotics/arrays.py": (("sum",), "only asks whether a sum is finite"),
    "actors/robotics/casadi_solver.py": (("casadi", ".sum()"), FOREIGN),
    "actors/robotics/filterpy_estimator.py": (("filterpy", "numpy.linalg"), FOREIGN),
    "actors/robotics/numerics/definitions.py": (("**", ".sum()", "sum", "numpy.exp", "numpy.log"), PAPER),
    "actors/robotics/planning.py": ((".sum()",), PAPER),
    "actors/statistics.py": (("**",), FRACTIONS),
    "aspects/core/fields.py": (("sum",), WHOLE),
    "aspects/execution.py": (("sum",), WHOLE),
    "aspects/trace.py": (("numpy.cumsum",), WHOLE),
    "runner/execution/engine/statistic.py": (("sum",), WHOLE),
    "runner/model/language/sampling.py": (("scipy",), "the digits of a Sobol sequence, which are whole numbers"),
    "ptolemy/importing": (("sum",), WHOLE),
    "runner/execution/results/encoding.py": (("sum",), "only asks whether a sum is NaN"),
    "runner/model/build/checks.py": (("sum",), WHOLE),
    "runner/recorded/passing.py": (("sum",), WHOLE),
    "runner/search/proposals.py": (("sum",), WHOLE),
    "runner/search/space.py": (("sum",), WHOLE),
    "runner/execution/results/arrow.py": (("numpy.cumsum",), WHOLE),
    "runner/recorded/delays.py": ((), FITTED),
    "runner/recorded/losses.py": ((), FITTED),
    "runner/show": ((), DRAWN),
    "runner/search/optimising.py": (("sum",), WHOLE),
    "runner/search/calibrating.py": (("scipy", "numpy.linalg", "@"), DRAWN),
    "runner/support/shown.py": (("**", "math.log10"), DRAWN),
    "runner/study/judge/claims.py": (("sum",), WHOLE),
    "runner/study/run/cluster.py": (("sum",), WHOLE),
}


def offences(source: str) -> Iterator[tuple[int, str]]:
    """The line and the name of each use of what is banned."""
    modules: dict[str, str] = {}  # local name: what it stands for
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                modules[alias.asname or alias.name.partition(".")[0]] = alias.name
                yield from ((node.lineno, name) for name in _banned(alias.name))
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                modules[alias.asname or alias.name] = f"{node.module}.{alias.name}"
                yield from ((node.lineno, name) for name in _banned(f"{node.module}.{alias.name}"))
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.BinOp(op=ast.Pow()) | ast.AugAssign(op=ast.Pow()) if not _is_whole_power(node):
                yield node.lineno, "**"
            case ast.BinOp(op=ast.MatMult()) | ast.AugAssign(op=ast.MatMult()):
                yield node.lineno, "@"
            case ast.Call(func=ast.Name(id="sum"), args=[counted, *_]) if not _is_count(counted):
                yield node.lineno, "sum"
            case ast.Call(func=ast.Name(id="pow")) if "pow" not in modules:
                yield node.lineno, "pow"
            case ast.Call(func=ast.Attribute(value=base, attr=name)) if name in METHODS:
                if modules.get(ast.unparse(base)) is None:
                    yield node.lineno, f".{name}()"
            case ast.keyword(arg="fastmath", value=value) if ast.unparse(value) != "False":
                yield value.lineno, "fastmath"
        if isinstance(node, ast.Attribute):
            head, _, rest = ast.unparse(node).partition(".")
            if modules.get(head) and rest:
                full = f"{modules[head]}.{rest}"
                yield from ((node.lineno, name) for name in _banned(full) if name == full)


def _banned(name: str) -> Iterator[str]:
    """The part of a dotted name that is banned."""
    module, _, rest = name.partition(".")
    if BANNED.get(module) == "*":
        yield module
    for known, names in BANNED.items():
        if name.startswith(f"{known}.") and (rest := name.removeprefix(f"{known}.").partition(".")[0]) in names.split():
            yield f"{known}.{rest}"


def _is_whole_power(node: ast.BinOp | ast.AugAssign) -> bool:
    """Whether both sides are whole numbers written out: 2**63."""
    sides = (node.left, node.right) if isinstance(node, ast.BinOp) else ()
    return bool(sides) and all(isinstance(side, ast.Constant) and isinstance(side.value, int) for side in sides)


def _is_count(terms: ast.expr) -> bool:
    """Whether a sum evidently counts: of ones, lengths or comparisons."""
    match terms:
        case ast.GeneratorExp(elt=ast.Constant(value=int()) | ast.Compare()):
            return True
        case ast.GeneratorExp(elt=ast.Call(func=ast.Name(id=name))):
            return name in _COUNTS
        case ast.Call(func=ast.Name(id="map"), args=[ast.Name(id=name), *_]):
            return name in _COUNTS
    return False


def found() -> Iterator[str]:
    """What is wrong in the whole tree, exceptions that nobody needs included."""
    needed = set()
    for path in sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")):
        file = path.relative_to(ROOT).as_posix()
        place = next((place for place in EXCEPTIONS if file == place or file.startswith(f"{place}/")), "")
        allowed = EXCEPTIONS[place][0] if place else ()
        for line, name in sorted(set(offences(path.read_text("utf-8")))):
            if place and (not allowed or name in allowed):
                needed.add((place, name if allowed else ""))
            else:
                yield f"{file}:{line}: {name} is not the same on every machine: see tests/arithmetic.py"
    for place, (names, _) in EXCEPTIONS.items():
        yield from (
            f"{place} has an exception for {name} and does not use it"
            for name in names or ("",)
            if (place, name) not in needed
        )


if __name__ == "__main__":
    wrong = list(found())
    print("\n".join(wrong) or "Arithmetic: the same bits everywhere")
    sys.exit(bool(wrong))
