# What native forms are made of; see native.pyx.

from epicycle.actors.core.primitives cimport Words
from epicycle.actors cimport InputPort, Line, Wake
from epicycle.runner.engine.agenda cimport Form, Instant, Turn
from epicycle.runner.engine.director cimport Director
from epicycle.runner.engine.way cimport Sender


cdef class Drawing:
    cdef public int law
    cdef public double first, second
    cdef public Words stream
    cdef double next(self) except? -1.0


cdef Drawing drawing_of(distribution, stream)


cdef class Native(Form):
    cdef public object actor
    cdef public Director director
    cdef public Turn turn
    cdef bint take(self) except -1
    cdef Sender sender(self, name)
    cdef InputPort input_port(self, name)
    cdef long long now(self)
    cdef Wake wake_at(self, long long time)
    cdef int keep(self, Line line, long long time, value) except -1
    cdef bint is_due(self, Line line)


cdef inline list tokens_of(InputPort port):
    """The tokens of the present tag."""
    return port.shown


cdef inline Py_ssize_t count_of(InputPort port):
    """How many there are."""
    return len(port.shown)


cdef inline bint all_floats(list tokens):
    """Whether all are floats and nothing else: whole numbers have arithmetic of their own."""
    cdef Py_ssize_t place
    for place in range(len(tokens)):
        if type(tokens[place]) is not float:
            return False
    return True
