# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Tokens as bytes at once, in C, where waiting.py keeps them until encoding is worthwhile: here it always is.

Numbers, texts, arrays, tuples and dataclasses of these are encoded as in encoding.py; all else by that.
"""

cimport numpy
from cpython.bytes cimport PyBytes_AS_STRING, PyBytes_FromStringAndSize, PyBytes_GET_SIZE
from cpython.float cimport PyFloat_AS_DOUBLE
from cpython.long cimport PyLong_AsLongLongAndOverflow
from cpython.mem cimport PyMem_Free, PyMem_Malloc, PyMem_Realloc
from cpython.unicode cimport PyUnicode_AsUTF8String
from libc.stdint cimport uint64_t
from libc.string cimport memcpy

import numpy as np

from .encoding import canonical, encoders, field_names, is_record

numpy.import_array()

LARGE = 10_000  # bytes of a token: larger ones are not kept, as a thousand of them could fill the memory
_AT_ONCE = frozenset({float, bool, type(None), np.float64, int})

cdef bint IS_LITTLE = np.little_endian
cdef uint64_t NAN_BITS = 0x7FF8000000000000
cdef int DEEP = 32  # from here on Python continues, which knows how deep it may go
cdef dict PLANS = {}  # by class: what all its tokens share


cdef class Plan:
    """How a dataclass is encoded: its head, and the names of its fields, as attributes and in bytes."""

    cdef bytes head
    cdef tuple names, texts
    cdef bint is_frozen

    def __init__(self, cls):
        self.names = field_names(cls)
        self.texts = tuple(text(name) for name in self.names)
        self.head = b"d" + text(cls.__qualname__) + len(self.names).to_bytes(4, "little")
        params = vars(cls).get("__dataclass_params__")
        self.is_frozen = params is not None and params.frozen


cdef bytes text(str token):
    data = token.encode("utf-8", "surrogatepass")
    return len(data).to_bytes(4, "little") + data


cdef struct Output:
    char* data
    Py_ssize_t size, room
    bint is_fixed  # nothing in the token can change


cdef class WaitingTokens(dict):
    """``waiting[type(token)](token)`` is a token in bytes; one that cannot change is encoded once."""

    cdef dict _known  # bytes of tokens, with the tokens, by id: while they are here, no other object has it

    def __cinit__(self):
        self._known = {}

    def __reduce__(self):
        return WaitingTokens, ()

    def __missing__(self, cls):
        self[cls] = keep = encoders[cls] if cls in _AT_ONCE else self._keep
        return keep

    def _keep(self, token):
        """A token in bytes; raises an exception if it cannot be encoded."""
        cdef Output out
        cdef object key = <size_t><void*>token
        known = self._known.get(key)
        if known is not None:
            return (<tuple>known)[1]
        out.size, out.room, out.is_fixed = 0, 512, True
        out.data = <char*>PyMem_Malloc(out.room)
        if out.data == NULL:
            raise MemoryError
        try:
            put(&out, token, 0)
            made = PyBytes_FromStringAndSize(out.data, out.size)
        finally:
            PyMem_Free(out.data)
        if out.is_fixed and out.size <= LARGE:
            self._known[key] = (token, made)
        return made

    def forget(self):
        """No token waits any longer."""
        self._known.clear()


cdef inline int need(Output* out, Py_ssize_t wanted) except -1:
    cdef char* larger
    if out.size + wanted > out.room:
        out.room = 2 * out.room + wanted
        larger = <char*>PyMem_Realloc(out.data, out.room)
        if larger == NULL:
            raise MemoryError
        out.data = larger
    return 0


cdef inline int put_bytes(Output* out, bytes data) except -1:
    cdef Py_ssize_t size = PyBytes_GET_SIZE(data)
    need(out, size)
    memcpy(out.data + out.size, PyBytes_AS_STRING(data), size)
    out.size += size
    return 0


cdef inline void put_count(Output* out, Py_ssize_t count) noexcept:
    cdef int place
    for place in range(4):
        out.data[out.size + place] = <char>((count >> (8 * place)) & 0xFF)
    out.size += 4


cdef inline void put_bits(Output* out, uint64_t bits) noexcept:
    cdef int place
    for place in range(8):
        out.data[out.size + place] = <char>((bits >> (8 * place)) & 0xFF)
    out.size += 8


cdef inline uint64_t bits_of(double number) noexcept:
    cdef uint64_t bits
    memcpy(&bits, &number, 8)
    return bits if number == number else NAN_BITS


cdef int put(Output* out, object token, int depth) except -1:
    """Append a token."""
    cdef object cls = type(token)
    cdef Plan plan
    cdef long long whole
    cdef int overflow
    cdef Py_ssize_t place
    need(out, 16)
    if cls is float:
        out.data[out.size] = b"f"
        out.size += 1
        put_bits(out, bits_of(PyFloat_AS_DOUBLE(token)))
    elif cls is numpy.ndarray:
        put_array(out, token)
    elif cls is str:
        data = PyUnicode_AsUTF8String(token) if (<str>token).isascii() else token.encode("utf-8", "surrogatepass")
        out.data[out.size] = b"s"
        out.size += 1
        put_count(out, PyBytes_GET_SIZE(data))
        put_bytes(out, data)
    elif cls is bool or token is None:
        out.data[out.size] = b"n" if token is None else b"t" if token else b"u"
        out.size += 1
    elif depth >= DEEP:
        out.is_fixed = False
        put_bytes(out, canonical(token))
    elif cls is tuple:
        out.data[out.size] = b"l"
        out.size += 1
        put_count(out, len(<tuple>token))
        for item in <tuple>token:
            put(out, item, depth + 1)
    else:
        if cls is int:
            whole = PyLong_AsLongLongAndOverflow(token, &overflow)
            if not overflow:
                out.data[out.size] = b"i"
                out.size += 1
                put_bits(out, <uint64_t>whole)
                return 0
        plan = PLANS.get(cls)
        if plan is None:
            if not is_record(cls):
                out.is_fixed = out.is_fixed and cls is np.float64
                put_bytes(out, encoders[cls](token))
                return 0
            plan = PLANS[cls] = Plan(cls)
        out.is_fixed = out.is_fixed and plan.is_frozen
        put_bytes(out, plan.head)
        for place in range(len(plan.names)):
            put_bytes(out, <bytes>plan.texts[place])
            put(out, getattr(token, <str>plan.names[place]), depth + 1)
    return 0


cdef int put_array(Output* out, numpy.ndarray array) except -1:
    cdef Py_ssize_t place, count = numpy.PyArray_SIZE(array)
    cdef int flags = numpy.PyArray_FLAGS(array)
    cdef double* numbers
    if flags & numpy.NPY_ARRAY_WRITEABLE or numpy.PyArray_BASE(array) != NULL:
        out.is_fixed = False
    if not (IS_LITTLE and numpy.PyArray_TYPE(array) == numpy.NPY_DOUBLE and numpy.PyArray_ISCARRAY_RO(array)):
        out.is_fixed = out.is_fixed and array.dtype.kind in "biuf"
        return put_bytes(out, encoders[np.ndarray](array))
    need(out, 8 + 4 * array.ndim + 8 * count)
    memcpy(out.data + out.size, b"a<f8", 4)
    out.size += 4
    put_count(out, array.ndim)
    for place in range(array.ndim):
        put_count(out, array.shape[place])
    numbers = <double*>numpy.PyArray_DATA(array)
    for place in range(count):
        put_bits(out, bits_of(numbers[place]))
    return 0
