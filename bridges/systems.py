"""Systems of python-control as actors."""

from __future__ import annotations

from typing import Any

import control

from epicycle.actors import Actor, ParameterError, StateSpace, TransferFunction, type_name


def linear(path: str, system: Any, **parameters: Any) -> Actor:
    """The actor that does what a ``StateSpace`` or a ``TransferFunction`` of python-control does.

    A system in continuous time follows the time of the model; one in discrete time makes a step at each trigger, which
    has to come once in its sampling time.  ``parameters`` are the others of the actor, such as ``initial``.  Raises
    ``ParameterError``.

    >>> model.add(linear("plant", control.tf([1], [1, 2, 1])))
    """
    if isinstance(system, control.TransferFunction):
        if (system.noutputs, system.ninputs) != (1, 1):
            size = f"{system.ninputs} inputs and {system.noutputs} outputs"
            raise ParameterError(
                f"{path}: a transfer function with {size} is too large for a block of one input and one output; make a "
                "state space of it with control.ss"
            )
        found = {"numerator": system.num[0][0], "denominator": system.den[0][0]}
        kind: type[Actor] = TransferFunction
    elif isinstance(system, control.StateSpace):
        found = {"a": system.A, "b": system.B, "c": system.C, "d": system.D}
        kind = StateSpace
        if not system.nstates:
            raise ParameterError(f"{path}: a system without states is a gain: use the actor Scale")
    else:
        raise ParameterError(
            f"{path}: {type_name(type(system))} is no linear system of python-control: a StateSpace or a "
            "TransferFunction; make one of others with control.linearize"
        )
    for name in (*found, "sampled"):
        if name in parameters:
            raise ParameterError(f"{path}: {name!r} is that of the system")
    return kind(path, **found, sampled=bool(system.isdtime(strict=True)), **parameters)
