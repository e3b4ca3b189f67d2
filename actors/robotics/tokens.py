"""How the tokens of robots are declared: by fields, of which arrays are read-only and have a shape that is checked.

The methods are written out and compiled when a class is made: thousands of tokens are made in a second of model time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, dataclass, field, fields
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, dataclass_transform

from ..core.tag import LATEST, to_seconds
from .arrays import Array, finite, read_only

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    class Numbers:
        """What type checkers see of a field: any numbers go in, and an array comes out."""

        def __get__(self, instance: object, owner: type | None) -> Array: ...
        def __set__(self, instance: object, value: ArrayLike) -> None: ...

else:
    Numbers = Array

T = TypeVar("T", bound="Token")
Shape: TypeAlias = tuple[int | str, ...]  # of an array; a text is a length that may vary
ANY, SOME = "n", "n > 0"
_VARIES = {ANY: "", SOME: " > 0"}
_LATEST = to_seconds(LATEST)


def array(*sizes: str, kw_only: bool = False) -> Any:
    """A field that holds an array of floats.

    Each of its ``sizes`` is ``n``, ``n > 0``, or an expression in d, the number of dimensions, and the token, ``self``.
    """
    return field(metadata={"sizes": sizes}, kw_only=kw_only)


def part(several: bool = False) -> Any:
    """A field that holds another token, or a tuple of ``several``."""
    return field(metadata={"part": several})


class Token:
    """Base of the tokens; ``token`` writes these members, and ``__init__``."""

    __slots__ = ()
    time: Any  # s, of what it describes

    def fits(self, d: int) -> bool:
        """Whether its arrays have the shapes for d dimensions."""
        raise NotImplementedError

    def shapes(self, d: int) -> tuple[tuple[str, Array, Shape], ...]:
        """Each array with its name, and the shape that it should have in d dimensions."""
        raise NotImplementedError

    @property
    def finite(self) -> bool:
        """Whether it can be used: all arrays fit two or three dimensions, and all numbers are finite."""
        raise NotImplementedError

    def usable(self) -> bool:
        """Conditions on numbers besides those of ``finite``, which includes them."""
        return True


@dataclass_transform(eq_default=False, field_specifiers=(array, part))
def token(**names: object) -> Callable[[type[T]], type[T]]:
    """A frozen dataclass with slots, equal to itself alone; ``names`` are those in the expressions of its sizes."""

    def decorate(cls: type[T]) -> type[T]:
        made: Any = dataclass(frozen=True, slots=True, eq=False, init=False)(cls)
        given: dict[str, Any] = {"read_only": read_only, "all_finite": finite, "latest": _LATEST, **names}
        methods: dict[str, Any] = {}
        given |= {f"set_{each.name}": getattr(made, each.name).__set__ for each in fields(made)}
        exec(_text_of(made), given, methods)
        for name, method in methods.items():
            method.__qualname__ = f"{made.__qualname__}.{name}"
            method.__module__ = made.__module__
            setattr(made, name, property(method) if name == "finite" else method)
        made.__init__.__annotations__ = {each.name: each.type for each in fields(made)}
        return made  # type: ignore[no-any-return]

    return decorate


def _text_of(cls: Any) -> str:
    """The methods of a class in Python."""
    given, sets, fits, shapes, usable = ["self"], [], [], [], ["abs(self.time) <= latest"]
    for each in fields(cls):
        name = f"self.{each.name}"
        if each.kw_only and "*" not in given:
            given.append("*")
        given.append(each.name if each.default is MISSING else f"{each.name}={each.default!r}")
        sizes, several = each.metadata.get("sizes"), each.metadata.get("part")
        sets.append(f"set_{each.name}(self, {each.name if sizes is None else f'read_only({each.name})'})")
        if sizes is not None:
            fits.append(_fits(f"{name}.shape", sizes))
            told = "".join(f"{size!r}, " if size in _VARIES else f"{size}, " for size in sizes)
            shapes.append(f"({each.name!r}, {name}, ({told}))")
            usable.append(f"all_finite({name})")
        elif several is not None:
            one = "each" if several else name
            loop = f" for place, each in enumerate({name})" if several else ""
            label = f"f'{each.name}[{{place}}].{{name}}'" if several else f"f'{each.name}.{{name}}'"
            fits.append(f"all([{one}.fits(d){loop}])" if several else f"{one}.fits(d)")
            shapes.append(f"*(({label}, array, shape){loop} for name, array, shape in {one}.shapes(d))")
            usable.append(f"all([{one}.finite{loop}])" if several else f"{one}.finite")
    usable += ["self.usable()"] * (cls.usable is not Token.usable)
    return (
        f"def __init__({', '.join(given)}):\n    " + "\n    ".join(sets) + "\n"
        f"def fits(self, d):\n    return {' and '.join(fits)}\n"
        f"def shapes(self, d):\n    return ({', '.join(shapes)},)\n"
        f"def finite(self):\n    return (self.fits(2) or self.fits(3)) and {' and '.join(usable)}\n"
    )


def _fits(shape: str, sizes: tuple[str, ...]) -> str:
    """The condition on a shape."""
    if not _VARIES.keys() & set(sizes):
        return f"{shape} == ({', '.join(sizes)},)"
    each = [f"{shape}[{place}]{_VARIES.get(size, f' == ({size})')}" for place, size in enumerate(sizes) if size != ANY]
    return " and ".join([f"len({shape}) == {len(sizes)}", *each])
