# cython: language_level=3, boundscheck=False, wraparound=False
"""What primitives.py does, in C."""

from cpython.object cimport PyObject
from cpython.ref cimport Py_DECREF
from libc.math cimport rint

cdef extern from "Python.h":
    void Py_SET_SIZE(object, Py_ssize_t)
    PyObject* PyList_GET_ITEM(object, Py_ssize_t)


cdef long long nearest(double number) noexcept:
    return <long long>rint(number)


cdef int empty(list tokens) except -1:
    """Of a list of one, the room stays: one will be there soon again."""
    cdef PyObject* token
    if len(tokens) == 1:
        token = PyList_GET_ITEM(tokens, 0)
        Py_SET_SIZE(tokens, 0)
        Py_DECREF(<object>token)
    elif tokens:
        tokens.clear()
    return 0
