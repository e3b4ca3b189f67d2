# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Records as bytes, many at a time: what packing.py does, in C."""

from cpython.bytes cimport PyBytes_AS_STRING, PyBytes_FromStringAndSize, PyBytes_GET_SIZE
from cpython.float cimport PyFloat_AS_DOUBLE
from cpython.long cimport PyLong_AsLongLongAndOverflow
from cpython.mem cimport PyMem_Free, PyMem_Malloc, PyMem_Realloc
from libc.stdint cimport uint64_t
from libc.string cimport memcpy

from epicycle.actors cimport Moment

# Their bytes are made here, where they are put; whatever else can wait is encoded by Python.
AS_THEY_ARE = frozenset({float, int, bool, type(None)})

cdef uint64_t NAN_BITS = 0x7FF8000000000000


cdef inline void put_number(char* at, char kind, uint64_t bits) noexcept:
    """A letter and eight bytes, the lowest first on every machine."""
    cdef int place
    at[0] = kind
    for place in range(8):
        at[1 + place] = <char>((bits >> (8 * place)) & 0xFF)


cpdef bytes stamp(when):
    """A tag in bytes."""
    cdef char data[18]
    cdef Moment moment
    if isinstance(when, Moment):
        moment = when
        put_number(data, b"i", <uint64_t>moment.time)
        put_number(data + 9, b"i", <uint64_t>moment.microstep)
    else:
        put_number(data, b"i", <uint64_t><long long>when.time)
        put_number(data + 9, b"i", <uint64_t><long long>when.microstep)
    return PyBytes_FromStringAndSize(data, 18)


def packed(list pieces, encode):
    """All pieces one after the other: three for each record, of which the last are bytes or tokens to encode."""
    cdef dict made = {}
    cdef Py_ssize_t place, size = 0, room = 64 * len(pieces) + 64, wanted
    cdef char* buffer = <char*>PyMem_Malloc(room)
    cdef object piece
    cdef bytes known
    cdef double number
    cdef uint64_t bits
    cdef long long whole
    cdef int overflow
    if buffer == NULL:
        raise MemoryError
    try:
        for place in range(len(pieces)):
            piece = pieces[place]
            wanted = PyBytes_GET_SIZE(piece) if type(piece) is bytes else 16
            if size + wanted > room:
                room = 2 * room + wanted
                buffer = grown(buffer, room)
            if type(piece) is bytes:
                memcpy(buffer + size, PyBytes_AS_STRING(piece), wanted)
                size += wanted
            elif type(piece) is float:
                number = PyFloat_AS_DOUBLE(piece)
                memcpy(&bits, &number, 8)
                put_number(buffer + size, b"f", bits if number == number else NAN_BITS)
                size += 9
            elif piece is None or type(piece) is bool:
                buffer[size] = b"n" if piece is None else b"t" if piece else b"u"
                size += 1
            else:
                whole = PyLong_AsLongLongAndOverflow(piece, &overflow) if type(piece) is int else 0
                if type(piece) is int and not overflow:
                    put_number(buffer + size, b"i", <uint64_t>whole)
                    size += 9
                    continue
                known = <bytes>made.get(id(piece))
                if known is None:
                    known = made[id(piece)] = encode(piece)
                wanted = PyBytes_GET_SIZE(known)
                if size + wanted > room:
                    room = 2 * room + wanted
                    buffer = grown(buffer, room)
                memcpy(buffer + size, PyBytes_AS_STRING(known), wanted)
                size += wanted
        return PyBytes_FromStringAndSize(buffer, size)
    finally:
        PyMem_Free(buffer)


cdef char* grown(char* buffer, Py_ssize_t room) except NULL:
    cdef char* larger = <char*>PyMem_Realloc(buffer, room)
    if larger == NULL:
        raise MemoryError
    return larger
