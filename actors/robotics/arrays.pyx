# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Arrays of a few floats, and kernels: the same as arrays.py, in C, for plain arrays of doubles and tuples of
floats."""

cimport numpy
from cpython.float cimport PyFloat_AS_DOUBLE
from cpython.ref cimport Py_DECREF, Py_INCREF
from libc.math cimport isfinite
from libc.stdint cimport int64_t, intptr_t
from libc.string cimport memcpy

import math

import numpy as np
from numpy.typing import NDArray

numpy.import_array()

Array = NDArray[np.float64]
cdef object FLOAT = np.dtype(np.float64)


cdef inline bint is_plain(array) noexcept:
    """Whether the numbers of an array are contiguous, as C needs them."""
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
    return np.array(numbers, FLOAT, order="C")


cpdef read_only(value):
    made = numpy.PyArray_NewCopy(<numpy.ndarray>value, numpy.NPY_CORDER) if is_plain(value) else array_of(value)
    numpy.PyArray_CLEARFLAGS(<numpy.ndarray>made, numpy.NPY_ARRAY_WRITEABLE)
    return made


cpdef tuple floats(values):
    cdef double* data
    if is_plain(values) and (<numpy.ndarray>values).ndim == 1:
        data = numbers_of(values)
        if size_of(values) == 2:
            return data[0], data[1]
        if size_of(values) == 3:
            return data[0], data[1], data[2]
    return tuple(np.asarray(values, dtype=FLOAT).tolist())


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


cdef enum:
    WORDS = 128  # more than any kernel takes
ctypedef int64_t (*Code)(int64_t*, double*) noexcept


cdef class Entry:
    """A kernel called by its address, which is in the object that ``compiled`` returns with the kinds of what it takes
    and gives: a float (d), an int (i), a bool (b), or an array of 1 to 9 dimensions.

    It gets the address of a row of words twice: first a function that makes an array from an address and its shape; then
    the arguments, an array as its address and a word for each length.  If it returns 1, the results are in the same
    place.
    """

    cdef Code code  # none before the first call
    cdef object owner  # of the code
    cdef object function, compiled, typed
    cdef bytes takes, gives

    def __init__(self, function, compiled, typed):
        self.function, self.compiled, self.typed = function, compiled, typed

    def __reduce__(self):  # by name: an address is good in one process
        from epicycle.actors.robotics.numerics.compiled import kernel_of
        return kernel_of, (self.function.__module__, self.function.__name__)

    @property
    def _numba_type_(self):
        return self.typed()  # as numba sees it where a kernel calls another

    def compile(self):
        self.owner, takes, gives = self.compiled()
        self.takes, self.gives = takes.encode(), gives.encode()
        assert sum([1 + int(each) if each.isdigit() else 1 for each in takes]) < WORDS
        self.code = <Code><intptr_t>self.owner.address

    def __call__(self, *arguments):
        cdef int64_t[WORDS] words
        cdef int64_t* word = words + 1
        cdef const char* kinds
        cdef Py_ssize_t place = 0, count
        cdef int axis
        cdef list kept = None
        if self.code is NULL:
            self.compile()
        kinds, count = self.takes, len(self.takes)
        for argument in arguments:
            if isinstance(argument, tuple):  # a named one, by its fields
                arguments = tuple([one for each in arguments for one in (each if isinstance(each, tuple) else (each,))])
                break
        if len(arguments) != count:
            raise TypeError(f"a kernel of {count} arguments is given {len(arguments)}")
        for place in range(count):
            value = arguments[place]
            if kinds[place] == c"d":
                (<double*>word)[0] = value
            elif kinds[place] == c"i":
                word[0] = value
            elif kinds[place] == c"b":
                word[0] = bool(value)
            else:
                if not is_plain(value):
                    value = np.array(value, FLOAT, order="C")
                    kept = [value, kept]
                if numpy.PyArray_NDIM(<numpy.ndarray>value) != kinds[place] - c"0":
                    raise TypeError(f"argument {place} of a kernel has {value.ndim} dimensions")
                word[0] = <int64_t><intptr_t>numbers_of(value)
                for axis in range(numpy.PyArray_NDIM(<numpy.ndarray>value)):
                    word += 1
                    word[0] = numpy.PyArray_DIM(<numpy.ndarray>value, axis)
            word += 1
        words[0] = <int64_t><intptr_t>&boxed
        if self.code(words, <double*>words) != 1:
            raise MemoryError("a kernel has failed")
        if len(self.gives) == 1:
            return given(self.gives[0], words)
        return tuple([given(self.gives[place], words + place) for place in range(len(self.gives))])


cdef int64_t boxed(double* data, numpy.npy_intp* shape, int64_t dimensions) noexcept:
    made = numpy.PyArray_SimpleNew(dimensions, shape, numpy.NPY_DOUBLE)
    memcpy(numbers_of(made), data, 8 * size_of(made))
    Py_INCREF(made)
    return <int64_t><intptr_t><void*>made


cdef given(char kind, int64_t* word):
    if kind == c"d":
        return (<double*>word)[0]
    if kind == c"i":
        return word[0]
    if kind == c"b":
        return word[0] != 0
    if word[0] == 0:
        raise MemoryError("a kernel's array cannot be made")
    made = <object><void*><intptr_t>word[0]
    Py_DECREF(made)
    return made
