# cython: language_level=3, boundscheck=False, wraparound=False
"""What samples.py does, in C."""

from cpython cimport array

from epicycle.actors.core.primitives cimport reduced

from array import array as new_array


class Past(list):
    """Past events of a run, which no longer change: a copy of the run shares the items of the list."""


cdef class Samples:
    __slots__ = ("kind", "microsteps", "times", "tokens")

    def __init__(self):
        self.times = new_array("q")
        self.microsteps = new_array("i")
        self.tokens = new_array("d")
        self.kind = float

    cpdef add(self, long long time, long microstep, token):
        cdef Py_ssize_t size = len(self.times)
        cdef array.array floats
        if type(token) is not self.kind and self.kind is not None:
            self._make_room(token)
        if self.kind is float:
            floats = self.tokens
            array.resize_smart(floats, size + 1)
            floats.data.as_doubles[size] = token
        else:
            try:
                self.tokens.append(token)
            except OverflowError:  # an int of more than 64 bits
                self.tokens = Past([*self.tokens, token])
                self.kind = None
        array.resize_smart(self.times, size + 1)
        self.times.data.as_longlongs[size] = time
        array.resize_smart(self.microsteps, size + 1)
        self.microsteps.data.as_ints[size] = microstep

    def _make_room(self, token):
        if type(token) is int and not self.tokens:
            self.tokens, self.kind = new_array("q"), int
        else:
            self.tokens, self.kind = Past(self.tokens), None

    def __reduce__(self):
        return reduced(self)
