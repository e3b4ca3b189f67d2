# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Records as bytes, many at a time: what packing.py does, in C."""

from cpython.bytes cimport PyBytes_AS_STRING, PyBytes_FromStringAndSize, PyBytes_GET_SIZE
from cpython.float cimport PyFloat_AS_DOUBLE
from cpython.long cimport PyLong_AsLongLongAndOverflow
from cpython.mem cimport PyMem_Free, PyMem_Realloc
from libc.stdint cimport uint64_t
from libc.string cimport memcpy

from epicycle.actors cimport Moment

TAKES_NUMBERS = True
cdef uint64_t NAN_BITS = 0x7FF8000000000000


cdef inline void put_number(char* at, char kind, uint64_t bits) noexcept:
    """A letter and eight bytes, the lowest first on every machine."""
    at[0] = kind
    at[1] = <char>bits
    at[2] = <char>(bits >> 8)
    at[3] = <char>(bits >> 16)
    at[4] = <char>(bits >> 24)
    at[5] = <char>(bits >> 32)
    at[6] = <char>(bits >> 40)
    at[7] = <char>(bits >> 48)
    at[8] = <char>(bits >> 56)


cdef int put_tag(char* at, when) except -1:
    cdef Moment moment
    if isinstance(when, Moment):
        moment = when
        put_number(at, b"i", <uint64_t>moment.time)
        put_number(at + 9, b"i", <uint64_t>moment.microstep)
    else:
        put_number(at, b"i", <uint64_t><long long>when.time)
        put_number(at + 9, b"i", <uint64_t><long long>when.microstep)
    return 0


cpdef bytes stamp(when):
    """A tag in bytes."""
    cdef char data[18]
    put_tag(data, when)
    return PyBytes_FromStringAndSize(data, 18)


cdef class Sheet:
    """Records that wait: their bytes, and tokens whose bytes come in between, each at its place."""

    __slots__ = ("content",)

    def __cinit__(self):
        self.places, self.tokens = [], []

    def __dealloc__(self):
        PyMem_Free(self.buffer)

    @property
    def content(self):
        written = PyBytes_FromStringAndSize(self.buffer, self.used)
        return PyBytes_FromStringAndSize(self.tag, 18), written, tuple(self.places), tuple(self.tokens), self.size

    @content.setter
    def content(self, content):
        cdef bytes tag, written
        tag, written, places, tokens, size = content
        memcpy(self.tag, PyBytes_AS_STRING(tag), 18)
        self.used = 0
        self._reserve(len(written))
        memcpy(self.buffer, PyBytes_AS_STRING(written), len(written))
        self.used, self.places, self.tokens, self.size = len(written), list(places), list(tokens), size

    def _reserve(self, Py_ssize_t more):
        cdef Py_ssize_t room = 2 * self.room + more + 256
        cdef char* larger = <char*>PyMem_Realloc(self.buffer, room)
        if larger == NULL:
            raise MemoryError
        self.buffer, self.room = larger, room

    cpdef turn_to(self, when):
        put_tag(self.tag, when)

    cdef char* begun(self, bytes head, Py_ssize_t more) except NULL:
        """Write tag and names of a record; where its value comes, for which there is room."""
        cdef Py_ssize_t length = PyBytes_GET_SIZE(head)
        cdef char* at
        if self.used + 18 + length + more > self.room:
            self._reserve(18 + length + more)
        at = self.buffer + self.used
        memcpy(at, self.tag, 18)
        memcpy(at + 18, PyBytes_AS_STRING(head), length)
        self.used += 18 + length + more
        self.size += 1
        return at + 18 + length

    cpdef bint add(self, bytes head, value) except -1:
        cdef double number
        cdef uint64_t bits
        cdef long long whole
        cdef int overflow
        cdef char* at
        if type(value) is float:
            number = PyFloat_AS_DOUBLE(value)
            memcpy(&bits, &number, 8)
            put_number(self.begun(head, 9), b"f", bits if number == number else NAN_BITS)
        elif type(value) is int:
            whole = PyLong_AsLongLongAndOverflow(value, &overflow)
            if overflow:
                return False
            put_number(self.begun(head, 9), b"i", <uint64_t>whole)
        elif value is None or type(value) is bool:
            at = self.begun(head, 1)
            at[0] = b"n" if value is None else b"t" if value else b"u"
        else:
            return False
        return True

    cpdef keep(self, bytes head, kept):
        cdef char* at
        if type(kept) is bytes:
            at = self.begun(head, PyBytes_GET_SIZE(kept))
            memcpy(at, PyBytes_AS_STRING(kept), PyBytes_GET_SIZE(kept))
        else:
            self.begun(head, 0)
            self.places.append(self.used)
            self.tokens.append(kept)

    def taken(self, encode):
        cdef list pieces = []
        cdef dict made = {}
        cdef Py_ssize_t done = 0, place
        for place, token in zip(self.places, self.tokens):
            pieces.append(PyBytes_FromStringAndSize(self.buffer + done, place - done))
            known = made.get(id(token))
            if known is None:
                known = made[id(token)] = encode(token)
            pieces.append(known)
            done = place
        pieces.append(PyBytes_FromStringAndSize(self.buffer + done, self.used - done))
        self.places, self.tokens, self.used, self.size = [], [], 0, 0
        return b"".join(pieces)
