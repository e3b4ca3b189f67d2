# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Arrays of a few floats: what arrays.py does, in C, for plain arrays of doubles and tuples of floats."""

cimport numpy
from cpython.float cimport PyFloat_AS_DOUBLE
from libc.math cimport isfinite
from libc.string cimport memcpy

import math

import numpy as np
from numpy.typing import NDArray

numpy.import_array()

Array = NDArray[np.float64]
Pair = tuple[float, float]
cdef object FLOAT = np.dtype(np.float64)


cdef inline bint is_plain(array) noexcept:
    """Whether the numbers of an array lie one after the other, as C knows them."""
    return (
        type(array) is numpy.ndarray and numpy.PyArray_TYPE(<numpy.ndarray>array) == numpy.NPY_DOUBLE
        and numpy.PyArray_ISCARRAY_RO(<numpy.ndarray>array)
    )


cdef inline double* numbers_of(array) noexcept:
    return <double*>numpy.PyArray_DATA(<numpy.ndarray>array)


cdef inline Py_ssize_t size_of(array) noexcept:
    return numpy.PyArray_SIZE(<numpy.ndarray>array)


cpdef array_of(numbers):
    cdef numpy.npy_intp size
    cdef Py_ssize_t place
    cdef double* data
    if type(numbers) is tuple:
        for number in <tuple>numbers:
            if type(number) is not float:
                break
        else:
            size = len(<tuple>numbers)
            made = numpy.PyArray_SimpleNew(1, &size, numpy.NPY_DOUBLE)
            data = numbers_of(made)
            for place in range(size):
                data[place] = PyFloat_AS_DOUBLE((<tuple>numbers)[place])
            return made
    return np.array(numbers, FLOAT)


cpdef read_only(value):
    made = numpy.PyArray_NewCopy(<numpy.ndarray>value, numpy.NPY_KEEPORDER) if is_plain(value) else array_of(value)
    numpy.PyArray_CLEARFLAGS(<numpy.ndarray>made, numpy.NPY_ARRAY_WRITEABLE)
    return made


cpdef tuple pair(values):
    cdef double* data
    if is_plain(values) and (<numpy.ndarray>values).ndim == 1 and size_of(values) == 2:
        data = numbers_of(values)
        return data[0], data[1]
    x, y = np.asarray(values, dtype=FLOAT).tolist()
    return x, y


cpdef bint all_finite(numbers) except -1:
    return all(map(math.isfinite, numbers))


cpdef bint finite(array) except -1:
    cdef Py_ssize_t place
    cdef double* data
    if not is_plain(array):
        return all_finite(array.ravel().tolist())
    data = numbers_of(array)
    for place in range(size_of(array)):
        if not isfinite(data[place]):
            return False
    return True


cpdef joined(numbers, array):
    cdef Py_ssize_t place = 0
    cdef numpy.npy_intp size = len(numbers) + size_of(array)
    made = numpy.PyArray_SimpleNew(1, &size, numpy.NPY_DOUBLE)
    cdef double* data = numbers_of(made)
    for number in numbers:
        data[place] = number
        place += 1
    plain = array if is_plain(array) else np.array(array, FLOAT, order="C")
    memcpy(data + place, numbers_of(plain), 8 * size_of(plain))
    return made


cpdef stacked(rows, Py_ssize_t columns):
    cdef list kept = list(rows)
    cdef numpy.npy_intp[2] shape
    cdef double* data
    for row in kept:  # which are ours, made by ``array_of`` or ``joined``
        columns = max(columns, size_of(row))
    shape[0], shape[1] = len(kept), columns
    table = numpy.PyArray_ZEROS(2, shape, numpy.NPY_DOUBLE, 0)
    data = numbers_of(table)
    for row in kept:
        memcpy(data, numbers_of(row), 8 * size_of(row))
        data += columns
    return table
