"""The entry from Python into a kernel.

Numba's own entry checks the type of each argument, counts references to each array, and takes 0.5 us for each array
that a kernel returns.  The compiled core calls a kernel by its address instead, with a row of words that locate all
numbers (``Entry`` in ``arrays.pyx``); with it, only this entry is compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

import numba.core.cgutils
import numba.core.sigutils
import numba.extending
import numba.np.arrayobj

from ..arrays import entered
from .jit import cached, dispatcher, options, types

_code: Any = numba.core.cgutils
_arrays: Any = numba.np.arrayobj
_signatures: Any = numba.core.sigutils
_extending: Any = numba.extending
_KINDS = {types.float64: "d", types.int64: "i", types.boolean: "b"}


def entered_by_address(function: Callable[..., Any], signature: str) -> Any:
    """A kernel with the types of a numba signature, called by its address where the compiled core is there."""
    takes, gives = _signatures.normalize_signature(signature)
    return entered(dispatcher(function), lambda: _compile(function, takes), _kinds(takes), _kinds(_each(gives)))


def _each(gives: Any) -> Any:
    return gives.types if isinstance(gives, types.BaseTuple) else (gives,)


def _kinds(each: Any) -> str:
    return "".join(str(one.ndim) if isinstance(one, types.Array) else _KINDS[one] for one in each)


def _compile(function: Any, takes: Any) -> Any:
    """The code of ``_enter`` for a kernel, with its ``address``; it is in the cache as a part of its module."""
    compiler: Any = numba.njit
    names = {
        "_kernel": compiler(**options(no_cpython_wrapper=True))(function),
        "_taken": _reader(takes),
        "_put": _extending.intrinsic(_write),
        "__name__": function.__module__,
    }
    code = function.__code__
    enter = FunctionType(
        _enter.__code__.replace(co_filename=code.co_filename, co_firstlineno=code.co_firstlineno), names, "_enter"
    )
    enter.__qualname__ = f"{function.__name__}_entry"
    with cached():
        return numba.cfunc("i8(CPointer(i8))", cache=True, **options())(enter)


def _enter(words: Any) -> int:
    """Call the kernel with the arguments in the words, and put its results in their place; returns 0 if it has
    failed."""
    _put(words, _kernel(*_taken(words)))  # type: ignore[name-defined]  # noqa: F821
    return 1


def _reader(takes: Any) -> Any:
    """A function for compiled code that makes arguments from words: an array is an address and its shape."""
    made = types.Tuple(takes)

    def lower(context: Any, builder: Any, _: Any, given: Any) -> Any:
        place = 0  # the first word is for ``_put``

        def word() -> Any:
            nonlocal place
            place += 1
            return builder.load(_code.gep_inbounds(builder, given[0], place))

        def value_of(wanted: Any) -> Any:
            if not isinstance(wanted, types.Array):
                return _as(builder, word(), context.get_value_type(wanted))
            array, size = _arrays.make_array(wanted)(context, builder), context.get_constant(types.intp, 8)
            data = builder.inttoptr(word(), context.get_data_type(wanted.dtype).as_pointer())
            shape, strides = [word() for _ in range(wanted.ndim)], [size]
            for length in shape[:0:-1]:
                strides.insert(0, builder.mul(strides[0], length))
            _arrays.populate_array(array, data=data, shape=shape, strides=strides, itemsize=size, meminfo=None)
            return array._getvalue()

        return context.make_tuple(builder, made, [value_of(each) for each in takes])

    return _extending.intrinsic(lambda typing, words: (made(words), lower))


def _as(builder: Any, value: Any, wanted: Any) -> Any:
    """The same bits as another type, which may be narrower or wider."""
    if not hasattr(value.type, "width") or not hasattr(wanted, "width"):
        return builder.bitcast(value, wanted)
    return builder.trunc(value, wanted) if wanted.width < value.type.width else builder.zext(value, wanted)


def _write(typing: Any, words: Any, result: Any) -> Any:
    """Write the results of a kernel; for an array, the object that the function at the first word makes of it."""
    results = _each(result)
    if any(isinstance(each, types.Array) and each.layout != "C" for each in results):
        raise TypeError(f"a kernel returns {result}, which may not be contiguous")

    def lower(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        several = isinstance(result, types.BaseTuple)
        word = context.get_value_type(types.intp)
        first = builder.load(given[0])
        for place, kind in enumerate(results):
            value = builder.extract_value(given[1], place) if several else given[1]
            target = _code.gep_inbounds(builder, given[0], place)
            if isinstance(kind, types.Array):
                array = _arrays.make_array(kind)(context, builder, value)
                shape = builder.bitcast(_code.alloca_once_value(builder, array.shape), word.as_pointer())
                passed = array.data, shape, word(kind.ndim)
                maker = _code.ir.FunctionType(word, [each.type for each in passed]).as_pointer()
                builder.store(builder.call(builder.inttoptr(first, maker), passed), target)
            else:
                builder.store(_as(builder, value, word), target)
        return context.get_dummy_value()

    return types.none(words, result), lower
