from epicycle.actors.core.order cimport TimedQueue, ReadyQueue
from epicycle.actors.core.port_parameter cimport ParameterPort
from epicycle.actors.core.ports cimport Emitter, InputPort, OutputPort, Receiver
from epicycle.actors.core.primitives cimport is_alone
from epicycle.actors.core.tag cimport (
    Moment, Wake, nanoseconds_of, new_wake, seconds_of, to_nanoseconds, to_seconds,
)
