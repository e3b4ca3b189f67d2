# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""What record.py does, in C: what tokens mostly consist of is encoded here, all else by encoding.py."""

cimport numpy
from cpython cimport array
from cpython.bytes cimport PyBytes_AS_STRING, PyBytes_FromStringAndSize, PyBytes_GET_SIZE
from cpython.float cimport PyFloat_AS_DOUBLE
from cpython.long cimport PyLong_AsLongLongAndOverflow
from cpython.mem cimport PyMem_Free, PyMem_Realloc
from cpython.unicode cimport PyUnicode_AsUTF8String
from libc.stdint cimport uint64_t
from libc.string cimport memcpy

from epicycle.actors cimport Moment
from epicycle.actors.core.primitives cimport reduced

import hashlib
from array import array as new_array

import numpy as np

from .encoding import canonical, canonical_inside, field_names, is_record, sorted_names

numpy.import_array()

Names = tuple
cdef Py_ssize_t MANY = 10_000
cdef Py_ssize_t FULL = 65_536
cdef bint IS_LITTLE = np.little_endian
cdef uint64_t NAN_BITS = 0x7FF8000000000000
cdef int DEEP = 32  # from here on Python continues, which knows how deep it may go
cdef dict PLANS = {}  # by class: what all its tokens share
cdef dict NAMES = {}  # by the keys of mappings: these in order, with their bytes
cdef int MOST_NAMES = 1024


cdef bytes text(str token):
    data = PyUnicode_AsUTF8String(token) if token.isascii() else token.encode("utf-8", "surrogatepass")
    return len(data).to_bytes(4, "little") + data


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


cdef class RecordHash:
    __slots__ = ("_hash", "content")

    def __cinit__(self):
        self.microstep = -1  # of no tag
        self.known = {}

    def __init__(self):
        self._hash = hashlib.sha256()

    def __dealloc__(self):
        PyMem_Free(self.buffer)

    @property
    def content(self):
        written = PyBytes_FromStringAndSize(self.buffer, self.used)
        return written, self.count, self.at_tag, self.names, self.time, self.microstep

    @content.setter
    def content(self, content):
        written, self.count, self.at_tag, self.names, self.time, self.microstep = content
        self.end = 0
        self.put_bytes(written)
        self.used = self.end

    cdef bytes add(self, bytes number, tuple names, when, value):
        """Append a record; ``number`` is that of its names, empty if they are new.  Returns their number."""
        cdef long long time = self.time
        cdef long microstep = self.microstep
        cdef bint is_new = not number, is_later
        cdef Py_ssize_t place
        if when is not self.when:
            if isinstance(when, Moment):
                time, microstep = (<Moment>when).time, (<Moment>when).microstep
            else:
                time, microstep = when.time, when.microstep
        is_later = time != self.time or microstep != self.microstep
        self.end = self.used
        self.level = 0
        self.need(32)
        if is_later:
            self.put_little(0, 1)
            self.put_little(<uint64_t>time, 8)
            self.put_unsigned(microstep)
        if is_new:
            place = self.end
            self.put_unsigned(self.names + 1)
            number = PyBytes_FromStringAndSize(self.buffer + place, self.end - place)
            event, actor, port, channel, aspect = names
            self.put_bytes(b"".join(map(canonical, (event, actor, port, aspect, channel))))
        else:
            self.put_bytes(number)
        if isinstance(value, float):
            self.need(9)
            self.put_float(PyFloat_AS_DOUBLE(value))
        elif value is None or isinstance(value, int):
            self.put(value, 0)
        else:
            self.put_known(value)
        # Nothing has failed: the record counts.
        self.used = self.end
        self.when, self.time, self.microstep = when, time, microstep
        self.names += is_new
        self.count += 1
        self.at_tag = 1 if is_later else self.at_tag + 1
        if self.used > FULL:
            self.update()
        return number

    cdef int update(self) except -1:
        self._hash.update(PyBytes_FromStringAndSize(self.buffer, self.used))
        self.used = 0
        self.known.clear()
        return 0

    def hexdigest(self):
        self.update()
        return self._hash.hexdigest()

    cdef int need(self, Py_ssize_t more) except -1:
        cdef char* larger
        cdef Py_ssize_t room
        if self.end + more > self.room:
            room = 2 * self.room + more
            larger = <char*>PyMem_Realloc(self.buffer, room)
            if larger == NULL:
                raise MemoryError
            self.buffer, self.room = larger, room
        return 0

    cdef int put_bytes(self, bytes data) except -1:
        cdef Py_ssize_t size = PyBytes_GET_SIZE(data)
        self.need(size)
        memcpy(self.buffer + self.end, PyBytes_AS_STRING(data), size)
        self.end += size
        return 0

    cdef inline void put_little(self, uint64_t number, int size) noexcept:
        """The lowest bytes of a number, the lowest first on every machine."""
        cdef int place
        for place in range(size):
            self.buffer[self.end + place] = <char>(number >> (8 * place))
        self.end += size

    cdef inline void put_float(self, double number) noexcept:
        cdef uint64_t bits
        memcpy(&bits, &number, 8)
        self.put_little(b"f", 1)
        self.put_little(bits if number == number else NAN_BITS, 8)

    cdef inline void put_unsigned(self, uint64_t number) noexcept:
        while number > 127:
            self.put_little(number & 127 | 128, 1)
            number >>= 7
        self.put_little(number, 1)

    cdef int put_known(self, token) except -1:
        """Append a token; its bytes are known if it was encoded before and cannot change."""
        cdef object key = <size_t><void*>token
        cdef Py_ssize_t start = self.end
        known = self.known.get(key)
        if known is not None:
            return self.put_bytes((<tuple>known)[1])
        self.is_fixed = True
        self.put(token, 0)
        if self.is_fixed:
            self.known[key] = token, PyBytes_FromStringAndSize(self.buffer + start, self.end - start)
        return 0

    cdef int put(self, token, int depth) except -1:
        """Append a token."""
        cdef object cls = type(token)
        cdef Plan plan
        cdef long long whole
        cdef int overflow
        cdef Py_ssize_t place
        self.need(16)
        if isinstance(token, float):
            self.put_float(PyFloat_AS_DOUBLE(token))
        elif cls is numpy.ndarray:
            self.put_array(token)
        elif cls is str:
            self.put_little(b"s", 1)
            self.put_bytes(text(token))
        elif cls is bool or token is None:
            self.put_little(b"n" if token is None else b"t" if token else b"u", 1)
        elif depth >= DEEP:
            self.put_other(token)
        elif cls is dict:
            self.put_mapping(token, depth)
        elif cls is list:
            self.is_fixed = False
            self.level += 1
            self.put_little(b"l", 1)
            self.put_little(len(<list>token), 4)
            for item in <list>token:
                self.put(item, depth + 1)
            self.level -= 1
        elif cls is tuple:
            self.put_little(b"l", 1)
            self.put_little(len(<tuple>token), 4)
            for item in <tuple>token:
                self.put(item, depth + 1)
        else:
            if cls is int:
                whole = PyLong_AsLongLongAndOverflow(token, &overflow)
                if not overflow:
                    self.put_little(b"i", 1)
                    self.put_little(<uint64_t>whole, 8)
                    return 0
            plan = PLANS.get(cls)
            if plan is None:
                if not is_record(cls):
                    return self.put_other(token)
                plan = PLANS[cls] = Plan(cls)
            self.is_fixed = self.is_fixed and plan.is_frozen
            self.put_bytes(plan.head)
            for place in range(len(plan.names)):
                self.put_bytes(<bytes>plan.texts[place])
                self.put(getattr(token, <str>plan.names[place]), depth + 1)
        return 0

    cdef int put_other(self, token) except -1:
        self.is_fixed = False
        return self.put_bytes(canonical_inside(token, self.level))

    cdef int put_mapping(self, dict token, int depth) except -1:
        cdef tuple keys = tuple(token), each
        names = NAMES.get(keys)
        if names is None:
            names = sorted_names(keys)
            if names is None:
                return self.put_other(token)
            if len(NAMES) >= MOST_NAMES:
                NAMES.clear()
            NAMES[keys] = names
        self.is_fixed = False
        self.level += 1
        self.put_little(b"m", 1)
        self.put_little(len(token), 4)
        for each in <tuple>names:
            self.put_bytes(<bytes>each[1])
            self.put(token[each[0]], depth + 1)
        self.level -= 1
        return 0

    cdef int put_array(self, token) except -1:
        cdef numpy.ndarray numbers = token
        cdef Py_ssize_t place, count = numpy.PyArray_SIZE(numbers)
        cdef double* data
        if numpy.PyArray_FLAGS(numbers) & numpy.NPY_ARRAY_WRITEABLE or numpy.PyArray_BASE(numbers) != NULL:
            self.is_fixed = False
        if not (IS_LITTLE and numpy.PyArray_TYPE(numbers) == numpy.NPY_DOUBLE and numpy.PyArray_ISCARRAY_RO(numbers)):
            self.is_fixed = self.is_fixed and numbers.dtype.kind in "biuf"
            return self.put_bytes(canonical_inside(numbers, self.level))
        self.need(8 + 4 * numbers.ndim + 8 * count)
        memcpy(self.buffer + self.end, b"a<f8", 4)
        self.end += 4
        self.put_little(numbers.ndim, 4)
        for place in range(numbers.ndim):
            self.put_little(numbers.shape[place], 4)
        data = <double*>numpy.PyArray_DATA(numbers)
        memcpy(self.buffer + self.end, data, 8 * count)
        for place in range(count):
            if data[place] != data[place]:
                memcpy(self.buffer + self.end + 8 * place, &NAN_BITS, 8)
        self.end += 8 * count
        return 0


cdef class Writer:
    __slots__ = ("_hash", "_keeps", "_number", "log", "names")

    def __init__(self, log, names, keeps):
        self.names, self.log, self._hash, self._number, self._keeps = names, log, log.hash, b"", keeps

    cpdef write(self, when, value):
        self._number = self._hash.add(self._number, self.names, when, value)
        if self._hash.at_tag > MANY:
            self._hash.at_tag = 0
            self.log.report(when, self.names, MANY + 1)
        if self._keeps:
            self.log.keep(when, self.names, value)

    def __reduce__(self):
        return reduced(self)


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
