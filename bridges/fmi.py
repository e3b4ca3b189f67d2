"""FMUs as actors: units of FMI 2 and 3 for co-simulation."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, ClassVar

from epicycle.actors import (
    Actor,
    InputPort,
    MappingParameter,
    OutputPort,
    Parameter,
    ParameterError,
    any_parameter,
    brief,
    convert,
    did_you_mean,
    to_nanoseconds,
    to_seconds,
)
from epicycle.runner.model.catalogue import given_programs, types_of_file

from .slaves import CLOCK, TYPES, Apart, FMUError, Slave, described, digest_of, runnable

_SETTABLE = ("parameter", "structuralParameter", "input")
_A = {"output": "an output", "independent": "the time", "calculatedParameter": "a calculated parameter"}


def port_of(variable: str) -> str:
    """The name of a variable as a port: ``der(x[1])`` is ``der_x_1``."""
    name = re.sub(r"\W+", "_", variable, flags=re.ASCII).strip("_") or "variable"
    return f"_{name}" if name[0].isdigit() else name


def trust(path: str | Path) -> Path:
    """Let an FMU run, as ``--types`` does; the path.  Raises ``TypesError`` if it cannot be read."""
    types_of_file(Path(path))
    return Path(path)


class FMU(Actor):
    """An FMU for co-simulation: its inputs and outputs are ports, its parameters are given values.

    It communicates every ``step``, and when a token arrives.  An FMU of FMI 3 with event mode runs ahead to its next
    event, which is a firing at its own time; a token that arrives before that takes it back, if it can save its state.
    Otherwise tokens act from the next communication on, as with an FMU that cannot vary its steps.  Clocks are ports:
    a token at an input ticks it, an output sends true when it ticks.

    At each communication all outputs are sent.  The output ``fmu`` sends, once, the digest of the file, which so is
    part of that of the run.  An FMU is a program: it runs only if its file was named (``--types``), or ``trust`` was
    called.  What an FMU computes is outside of the promise of bits: another machine may give others.
    """

    is_source: ClassVar[bool] = True
    copies_share: ClassVar[tuple[str, ...]] = ("_about",)

    fmu = OutputPort(str, doc="once, the SHA-256 of the FMU, outside of whose promise of bits its outputs are")

    file = Parameter(Path, doc="the .fmu file")
    step = Parameter(float, None, unit="s", above=0, doc="time between two communications; default: the FMU's own")
    values = MappingParameter(any_parameter(), {}, doc="values of its parameters, and of inputs before a token")
    apart = Parameter(bool, False, doc="whether it runs in a process of its own")
    limit = Parameter(float, 60.0, unit="s", above=0, doc="longest time for a call of one that is apart")

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        about = self._about = described(self.file)
        runnable(self.file, about)
        self._variables = {each.name: each for each in about.modelVariables}
        self._input_of: dict[str, str] = {}
        self._output_of: dict[str, str] = {}
        depends = {each.variable.name: each.dependencies for each in about.outputs}
        found: dict[str, InputPort[Any] | OutputPort[Any]] = {}
        for name, each in self._variables.items():
            if each.causality not in ("input", "output"):
                continue
            if each.type not in TYPES or each.dimensions:
                raise ParameterError(f"file: {self.file.name}: {name} is an array, or a {each.type}: scalars only")
            port = port_of(name)
            if port in found:
                raise ParameterError(f"file: {self.file.name}: {name} and another variable would both be port {port!r}")
            kind, said = TYPES[each.type][1], f"{each.description or name}{f', in {each.unit}' if each.unit else ''}"
            if each.causality == "input":
                self._input_of[port] = name
                found[port] = InputPort(Any if kind is bytes or each.type == CLOCK else kind, required=False, doc=said)
            else:
                self._output_of[port] = name
                found[port] = OutputPort(Any if kind is bytes else kind, doc=said)
        for port, name in self._output_of.items():
            known = depends.get(name)
            if known is not None:
                names = {each.name for each in known}
                found[port].change("depends_on", tuple(one for one, other in self._input_of.items() if other in names))
        return found

    def check(self) -> None:
        for name, value in self.values.items():
            if name not in self._variables:
                raise ParameterError(f"values: {self.file.name} has no {name!r}{did_you_mean(name, self._variables)}")
            causality = self._variables[name].causality
            if causality not in _SETTABLE:
                kind = _A.get(causality, "a local variable")
                raise ParameterError(f"values: {name} is {kind} of {self.file.name}, not a parameter or an input")
            self._value(name, value)
        own = self._about.defaultExperiment
        own = None if own is None else own.stepSize
        self._step = to_nanoseconds(self.step or float(own or self._about.coSimulation.fixedInternalStepSize or 0.01))

    def _value(self, name: str, value: Any) -> Any:
        """A value for a variable, by its type and in its unit."""
        variable = self._variables[name]
        kind = TYPES[variable.type][1]
        if isinstance(value, str) and kind in (float, int):
            try:
                value = convert(value, variable.unit or "1")
            except Exception as error:
                raise ParameterError(f"values: {name}: {error}") from None
        wrong = isinstance(value, bool) is not (kind is bool) or (kind is float and not isinstance(value, (int, float)))
        if wrong or (kind in (int, str) and not isinstance(value, kind)):
            raise ParameterError(f"values: {name} of {self.file.name} is of type {variable.type}, not {brief(value)}")
        return kind(value)

    # -- a run ----------------------------------------------------------------------------------------------------

    _slave: Any = None

    def initialize(self) -> None:
        self.wrapup()
        if digest_of(self.file) not in given_programs():
            raise FMUError(
                f"{self.file} is a program, and nobody has said that it may run\n"
                f"   help: if you trust it, add --types {self.file}; in Python, types=[...] or trust(...)"
            )
        variables, co = self._variables, self._about.coSimulation
        self._slave = Apart(str(self.file), self.limit) if self.apart else Slave(str(self.file))
        self._has_events = bool(self._about.fmiVersion != "2.0" and co.hasEventMode)
        self._can_go_back = bool(co.canGetAndSetFMUstate)
        self._varies = bool(co.canHandleVariableCommunicationStepSize)
        self._clocks = [name for name in self._output_of.values() if variables[name].type == CLOCK]
        self._readable = {port: name for port, name in self._output_of.items() if variables[name].type != CLOCK}
        self._origin = self.context.time
        self._time = to_seconds(self._origin)  # of the FMU
        self._next = self._origin + self._step  # communication
        self._waiting: dict[str, Any] = {}  # values for inputs
        self._event, self._ends, self._following = False, False, math.inf
        given = {name: self._value(name, value) for name, value in self.values.items()}
        self._call("start", given, self._time)
        self._ticking: list[str] = []
        if self._has_events:
            self._after(self._call("settle", self._clocks))
        self._saved_at = self._time
        self._first = True
        self._wake = self.wake_in(0.0)

    def wrapup(self) -> None:
        if self._slave is not None:
            self._slave.close()
            self._slave = None

    def _call(self, name: str, *given: Any) -> Any:
        """Call a function of the FMU; what it fails with names the file."""
        try:
            return getattr(self._slave, name)(*given)
        except FMUError:
            raise
        except Exception as error:  # of FMPy, and of ctypes
            raise FMUError(f"{self.file}: {' '.join(str(error).split())}") from None

    def _after(self, told: tuple[list[str], float | None, bool]) -> None:
        """What an event has brought."""
        self._ticking, following, ends = told
        self._following = math.inf if following is None else following
        self._ends = self._ends or ends

    def fire(self) -> None:
        now = self.context.time
        for port, name in self._input_of.items():
            if self.inputs[port].present:
                value = self.inputs[port].value
                self._waiting[name] = self._checked(name, value)
        if self._first:
            self.fmu.send(f"sha256:{digest_of(self.file)}")
        if not (self._reached(now) or self._first):
            return
        if self._has_events and (self._event or self._waiting or now >= self._to(self._following)):
            self._after(self._call("event", self._waiting, self._clocks))
        elif self._waiting:
            self._call("put", self._waiting)
        self._waiting, self._event, self._first = {}, False, False
        for port, name in self._readable.items():
            self.outputs[port].send(self._call("get", [name])[name])
        for port, name in self._output_of.items():
            if name in self._ticking:
                self.outputs[port].send(True)
        self._ticking = []
        if self._ends:
            self.context.stop(f"{self.path}: the FMU ends the simulation")
            return
        while self._next <= now:
            self._next += self._step
        self._go_ahead()

    def _checked(self, name: str, value: Any) -> Any:
        kind = TYPES[self._variables[name].type][1]
        if kind is float and not (isinstance(value, (int, float)) and math.isfinite(value)):
            raise FMUError(f"{self.path}.{port_of(name)} got {brief(value)}, which is not a finite number")
        return kind(value)

    def _to(self, time: float) -> float:
        return math.inf if math.isinf(time) else to_nanoseconds(time)

    def _reached(self, now: int) -> bool:
        """Bring the FMU to the present, if that is possible now; whether it is there."""
        there = self._to(self._time)
        if there == now:
            return True
        if there > now:  # it has run ahead, and a token has come
            if not self._can_go_back:
                return False
            self._call("restore")
            self._time, self._event, self._ends = self._saved_at, False, False
        elif not self._varies and now < self._next:
            return False
        while self._to(self._time) < now and not self._ends:
            self._advance(to_seconds(now))
        return True

    def _advance(self, until: float) -> None:
        before = self._time
        self._time, event, ends = self._call("step", before, until)
        self._event, self._ends = self._event or event, self._ends or ends
        if self._time <= before and not (event or ends):
            raise FMUError(f"{self.file} does not advance from {before:g} s")

    def _go_ahead(self) -> None:
        """Run to the next event, or to the next communication; or wait for that."""
        target = min(self._next, self._to(self._following))
        if self._has_events:
            if self._can_go_back and self._input_of:
                self._call("save")
                self._saved_at = self._time
            self._advance(to_seconds(int(target)))
            target = self._to(self._time)
        self._wake.cancel()
        self._wake = self.context.wake(self, max(int(target), self.context.time))


def told(path: str | Path) -> str:
    """What an FMU is: version, platforms, and its variables with causality, type, unit and start."""
    import fmpy

    path = Path(path)
    about = described(path)
    kinds = {"co-simulation": about.coSimulation, "model exchange": about.modelExchange}
    lines = [
        f"{about.modelName}: FMI {about.fmiVersion} for {' and '.join(name for name, each in kinds.items() if each)}",
        *([about.description] if about.description else []),
        f"platforms: {', '.join(sorted(fmpy.supported_platforms(str(path))))}; sha256:{digest_of(path)}",
    ]
    rows = [("variable", "causality", "type", "unit", "start", "port")]
    for each in about.modelVariables:
        port = port_of(each.name) if each.causality in ("input", "output") else ""
        rows.append((each.name, each.causality or "local", each.type, each.unit or "", str(each.start or ""), port))
    widths = [max(len(row[place]) for row in rows) for place in range(len(rows[0]))]
    lines += ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return "\n".join(lines)
