"""Small actors for models that tests write."""

from __future__ import annotations

from typing import Any, ClassVar

from epicycle.actors import Actor, EpicycleError, InputPort, OutputPort, Parameter, array_parameter


class Ramp(Actor):
    """Sends a number and a text once."""

    is_source: ClassVar[bool] = True
    output = OutputPort(float)
    label = OutputPort(str)
    start = Parameter(float, 0.0, unit="m", min=0.0, max=10.0, doc="where it begins")


class Gain(Actor):
    """Multiplies."""

    input = InputPort(float, doc="what is multiplied")
    output = OutputPort(float)
    factor = Parameter(float, doc="what it is multiplied by")
    times = Parameter(int, 1, min=1)
    mode = Parameter(str, "plain", choices=("plain", "squared"))
    on = Parameter(bool, True)
    offsets = array_parameter((None, 2), [], unit="m")


class Hold(Actor):
    """Delays."""

    input = InputPort(float, required=False)
    output = OutputPort(float, depends_on=())


class Sum(Actor):
    """Takes any number of connections."""

    input = InputPort(float, multi=True)
    output = OutputPort(float)


class Shout(Actor):
    """Takes text."""

    input = InputPort(str)


class Anything(Actor):
    """Sends what it gets."""

    input: InputPort[Any] = InputPort(Any, required=False)
    output: OutputPort[Any] = OutputPort(Any)


class Fussy(Actor):
    """Does not like its own parameters."""

    def __init__(self, path: str, **parameters: object) -> None:
        super().__init__(path, **parameters)
        raise EpicycleError("these parameters do not go together")


TYPES = (Ramp, Gain, Hold, Sum, Shout, Anything, Fussy)
