"""The entry from Python into a kernel, made of its annotations.

Numba's own entry checks the type of each argument, counts references to each array, looks at a named tuple for 4 us,
and takes 0.5 us for each array that a kernel returns.  The compiled core calls a kernel by its address instead, with a
row of words that locate all numbers (``Entry`` in ``arrays.pyx``).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from itertools import count
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numba
import numba.core.cgutils
import numba.extending
import numba.np.arrayobj
import numpy as np

from .. import arrays
from .jit import cached, dispatcher, options, typed, types

_code: Any = numba.core.cgutils
_array: Any = numba.np.arrayobj.make_array
_extending: Any = numba.extending
_numba: Any = numba
_KINDS = {float: "d", int: "i", bool: "b"}
_TYPES = {"d": types.float64, "i": types.int64, "b": types.boolean}
_WORDS = {"d": "numbers[{}]", "i": "words[{}]", "b": "words[{}] != 0"}


@functools.cache
def entered(function: Callable[..., Any]) -> Any:
    """A kernel as Python calls it."""
    if arrays.Entry is not None:
        return arrays.Entry(function, functools.partial(_by_address, function), functools.partial(typed, function))
    return functools.partial(_called, _by_fields(function))


def compile_now(function: Callable[..., Any]) -> None:
    """Compile a kernel, or load what was compiled before."""
    if arrays.Entry is not None:
        entered(function).compile()
    else:
        takes = [_TYPES.get(each) or types.Array(types.float64, int(each), "C") for each in _call(function)[1]]
        _by_fields(function).compile(tuple(takes))


def _by_address(function: Callable[..., Any]) -> tuple[Any, str, str]:
    """Code for C that reads what a kernel takes from words, and writes what it returns there; and the kinds of both.

    It returns 0 if the kernel has failed.
    """
    call, takes, gives = _call(function)
    place = count(1)  # the first word is a function that makes arrays

    def read(kind: str) -> str:
        if kind in _WORDS:
            return _WORDS[kind].format(next(place))
        address, shape = next(place), "".join([f"words[{next(place)}], " for _ in range(int(kind))])
        return f"carray(pointer(words[{address}]), ({shape}))"

    results = [f"result_{i}" for i in range(len(gives))]
    lines = ["maker = words[0]", f"{', '.join(results)} = {call.format(*map(read, takes))}"]
    for i, kind in enumerate(gives):
        made = f"boxed(maker, result_{i})" if kind.isdigit() else f"result_{i}"
        lines.append(f"{'numbers' if kind == 'd' else 'words'}[{i}] = {made}")
    enter = _function(function, "words, numbers", [*lines, "return 1"])
    with cached():
        return _numba.cfunc("i8(CPointer(i8), CPointer(f8))", cache=True, **options())(enter), takes, gives


@functools.cache
def _by_fields(function: Callable[..., Any]) -> Any:
    """A kernel that takes the fields of named tuples instead of these, for numba's entry."""
    call, takes, _ = _call(function)
    names = [f"given_{i}" for i in range(len(takes))]
    made = _function(function, ", ".join(names), [f"return {call.format(*names)}"])
    with cached():
        return _numba.njit(**options(cache=True))(made)


def _called(flat: Any, *given: Any) -> Any:
    """Call it with copies of arrays: for those that are read-only or not contiguous, numba would compile it again."""
    fields = [field for each in given for field in (each if isinstance(each, tuple) else (each,))]
    return flat(*[np.array(each, order="C") if isinstance(each, np.ndarray) else each for each in fields])


def _call(function: Callable[..., Any]) -> tuple[str, str, str]:
    """The call of a kernel, with a gap for each number and array, their kinds, and those of what it returns: a letter
    for a number, and for an array the number of its dimensions."""
    hints, kinds = get_type_hints(function, include_extras=True), [""]

    def gaps(hint: Any) -> str:
        if hint in _KINDS or get_origin(hint) is Annotated:
            kinds[-1] += _KINDS.get(hint) or str(hint.__metadata__[0])
            return "{}"
        fields = get_args(hint) or get_type_hints(hint, include_extras=True).values()
        return f"{hint.__name__}({', '.join(map(gaps, fields))})"

    returned = hints.pop("return")
    call = f"kernel({', '.join(map(gaps, hints.values()))})"
    kinds.append("")
    gaps(returned)
    return call, kinds[0], kinds[1]


def _function(of: Callable[..., Any], takes: str, lines: list[str]) -> Callable[..., Any]:
    """A function for numba that calls a kernel; it is in the cache as a part of the kernel's module."""
    name, names = f"{of.__name__}_entry", {**of.__globals__, **_NAMES, "kernel": dispatcher(of)}
    exec(compile(f"def {name}({takes}):\n    " + "\n    ".join(lines), of.__code__.co_filename, "exec"), names)
    made: Callable[..., Any] = names[name]
    return made


def _pointer(typing: Any, address: Any) -> Any:
    """A word as the address of numbers."""
    wanted = types.CPointer(types.float64)
    return wanted(address), lambda context, builder, _, given: builder.inttoptr(
        given[0], context.get_value_type(wanted)
    )


def _boxed(typing: Any, maker: Any, array: Any) -> Any:
    """What the function at an address makes of an array, given its numbers, its shape and the number of dimensions."""
    if array.layout != "C":
        raise TypeError(f"a kernel returns {array}, which may not be contiguous")

    def lower(context: Any, builder: Any, _: Any, given: Any) -> Any:
        word, made = given[0].type, _array(array)(context, builder, given[1])
        shape = builder.bitcast(_code.alloca_once_value(builder, made.shape), word.as_pointer())
        passed = made.data, shape, word(array.ndim)
        kind = _code.ir.FunctionType(word, [each.type for each in passed])
        return builder.call(builder.inttoptr(given[0], kind.as_pointer()), passed)

    return types.int64(maker, array), lower


_NAMES = {
    "carray": _numba.carray,
    "pointer": _extending.intrinsic(_pointer),
    "boxed": _extending.intrinsic(_boxed),
}
