"""The bits of the elementary functions and their tables never change.

``python -m tests.actors.core.elementary.test_bits`` prints them.
How near the values are to the truth is ``test_elementary``'s matter.  Logs and tables of old runs depend on these bits.
"""

from __future__ import annotations

import hashlib
import itertools
import math
import struct
from collections.abc import Iterator
from typing import Any

import pytest

from epicycle.actors.core import elementary
from epicycle.actors.core.elementary import tables

WHOLE = [0.0, 1.0, 0.5, 2.0, 3.0, 10.0, 0.1, 1e-8, 1e-300, 5e-324, 20.5, 39.5, 700.25, 745.5, 1e6, 3e15, 1e22, 1e300]
SPECIAL = [*WHOLE, *(-x for x in WHOLE), math.inf, -math.inf, math.nan]
TWO = ("atan2", "hypot", "pow", "power")

BITS = {
    "tables": "f2b7d01f8006d96e",
    "acos": "409a5d97c35df30d",
    "asin": "c64c23b168f7731b",
    "atan": "b207d0372ff01cf4",
    "atan2": "d82e0256cd8d5bc9",
    "cos": "0dc6eaa48b56ff6e",
    "cosh": "53fd2d3cc042fe57",
    "distance": "7120a4b070ae9711",
    "exp": "b778a8868f3f0bc3",
    "expm1": "c287feaf2fab1bdf",
    "hypot": "026d820a8cacef3f",
    "log": "23f4e61c661c32d4",
    "log10": "061045727b092c48",
    "log1p": "a5603387f1420441",
    "log2": "f01734f2d55612d0",
    "log_gamma": "539c3f2ef5ba92bc",
    "pow": "de489d3923fc7692",
    "power": "c103aa183e03a750",
    "sin": "bd788b9be4f280a4",
    "sinh": "6ee01b89de7a3a1a",
    "tan": "faf75a948077b7bc",
    "tanh": "45bc571f69ab0269",
    "total": "87f12799d7ba6b53",
}


def spread(count: int, factor: int) -> Iterator[float]:
    """Numbers of both signs and many sizes, made without rounding."""
    for k in range(1, count + 1):
        digits = (k * factor) % (1 << 53) | 1
        yield math.ldexp(digits if k % 3 else -digits, k % 71 - 113)


def answer(name: str, *at: Any) -> bytes:
    try:
        found = getattr(elementary, name)(*at)
        return b"nan" if math.isnan(found) else struct.pack("<d", found) + type(found).__name__.encode()
    except (ValueError, OverflowError, ZeroDivisionError) as error:
        return type(error).__name__.encode()


def arguments(name: str) -> Iterator[tuple[Any, ...]]:
    first, second = spread(700, 2654435769), spread(700, 40503 << 20 | 1)
    if name == "total":
        return ((list(itertools.islice(first, size)),) for size in (0, 1, 2, 3, 50))
    if name == "distance":
        return ((list(itertools.islice(first, n)), list(itertools.islice(second, n))) for n in (1, 2, 2, 2, 3, 3, 7))
    if name in TWO:
        more: Any = zip(spread(99, 91), spread(99, 97), spread(99, 93), strict=True) if name == "hypot" else ()
        more = itertools.product(range(-3, 6), repeat=2) if name == "power" else more
        return itertools.chain(itertools.product(SPECIAL, repeat=2), zip(first, second, strict=True), list(more))
    return ((x,) for x in (*SPECIAL, *first, *(k / 64 for k in range(-800, 800))))


def bits(name: str) -> str:
    """A digest of what a function gives, or of all tables."""
    if name == "tables":
        kept = {key: value for key, value in vars(tables).items() if key.isupper() and not key.startswith("_")}
        return hashlib.sha256(repr(sorted(kept.items())).encode()).hexdigest()[:16]
    return hashlib.sha256(b"".join(answer(name, *at) for at in arguments(name))).hexdigest()[:16]


@pytest.mark.parametrize("name", BITS)
def test_bits(name: str) -> None:
    assert bits(name) == BITS[name]


def test_all_functions_have_their_bits() -> None:
    assert set(BITS) == {"tables", *elementary.__all__}


if __name__ == "__main__":
    for each in ("tables", *sorted(elementary.__all__)):
        print(f'    "{each}": "{bits(each)}",')
