# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""The same as primitives.py, in C."""

import copyreg

from cpython.object cimport PyObject
from cpython.pycapsule cimport PyCapsule_GetPointer
from cpython.ref cimport Py_DECREF
from libc.math cimport frexp, rint
from libc.stdint cimport uint64_t

from .elementary import log as far_log
from .elementary import tables

cdef extern from "Python.h":
    Py_ssize_t Py_REFCNT(object)
    void Py_SET_SIZE(object, Py_ssize_t)
    PyObject* PyList_GET_ITEM(object, Py_ssize_t)


cdef double INVERSES[1024]
cdef double LOG_HIGH[1024]
cdef double LOG_LOW[1024]
cdef double LN_2_HIGH = tables.LN_2_HIGH
cdef double LN_2_LOW = tables.LN_2_LOW
cdef int entry
for entry in range(len(tables.INVERSES)):
    INVERSES[entry] = tables.INVERSES[entry]
    LOG_HIGH[entry] = tables.LOG_HIGH[entry]
    LOG_LOW[entry] = tables.LOG_LOW[entry]


cdef long long nearest(double number) noexcept:
    return <long long>rint(number)


cdef double log(double x) except? -1.0:
    """The logarithm of ``elementary``, operation by operation."""
    cdef int e, i
    cdef double m, point, inverse, r, bent, start, first, rest
    if not 0.0 < x < 1e300:
        return far_log(x)
    m = frexp(x, &e)
    i = <int>(m * 512.0 + 0.5)
    point = i * 0.001953125
    inverse = INVERSES[i]
    r = (m - point) * inverse
    bent = r * r * (0.5 - r * (0.3333333333333333 - r * (0.25 - r * (0.2 - r * 0.16666666666666666))))
    start = e * LN_2_HIGH + LOG_HIGH[i]
    if start == 0.0:
        return r - bent
    first = (r + 393216.0) - 393216.0
    rest = ((m - point) - first * point) * inverse
    return (start + first) + (rest + ((e * LN_2_LOW + LOG_LOW[i]) - bent))


cdef class Words:
    __slots__ = ("_ahead", "_bits")

    def __init__(self, bits):
        self._ahead = []  # the generator gives one word at a time, and that in C
        self._bits = bits

    def __reduce__(self):
        return reduced(self)

    @property
    def _bits(self):
        return self.bits

    @_bits.setter
    def _bits(self, bits):
        capsule = getattr(bits, "capsule", None)
        self.bits = bits
        self.source = NULL if capsule is None else <Source*>PyCapsule_GetPointer(capsule, "BitGenerator")

    cpdef uint64_t word(self) except? 0:
        if self._ahead:
            return self._ahead.pop()
        if self.source == NULL:
            return self.bits.random_raw()
        return self.source.next_uint64(self.source.state)


cdef tuple reduced(thing):
    """How pickle restores an object of a class in C: by its slots, as it does itself for a class in Python."""
    names = [name for base in type(thing).__mro__ for name in getattr(base, "__slots__", ())]
    return copyreg.__newobj__, (type(thing),), (None, {name: getattr(thing, name) for name in names})


cpdef bint is_alone(thing) noexcept:
    return Py_REFCNT(thing) == 1


cdef int empty(list tokens) except -1:
    """A list of one element keeps its memory: it will have one again soon."""
    cdef PyObject* token
    if len(tokens) == 1:
        token = PyList_GET_ITEM(tokens, 0)
        Py_SET_SIZE(tokens, 0)
        Py_DECREF(<object>token)
    elif tokens:
        tokens.clear()
    return 0
