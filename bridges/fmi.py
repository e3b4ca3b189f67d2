"""FMUs as actors: units of FMI 2 and 3 for co-simulation."""

from __future__ import annotations

import math
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import fmpy
import numpy as np

from epicycle.actors import (
    NEVER,
    Actor,
    EpicycleError,
    InputPort,
    MappingParameter,
    OutputPort,
    Parameter,
    ParameterError,
    any_parameter,
    brief,
    convert,
    did_you_mean,
    shaped,
    to_nanoseconds,
    to_seconds,
)
from epicycle.runner.model.catalogue import given_programs, types_of_file
from epicycle.runner.support.apart import Apart

from .names import ports_of, reason_of
from .slaves import CLOCK, KINDS, TIMED, Event, FMUError, Slave, described, digest_of, runnable

_SETTABLE = ("parameter", "structuralParameter", "input")


def trust(path: str | Path) -> Path:
    """Let an FMU run, as ``--types`` does; the path.  Raises ``TypesError`` if it cannot be read."""
    types_of_file(Path(path))
    return Path(path)


class FMU(Actor):
    """An FMU for co-simulation: its inputs and outputs are ports, its parameters are given values.

    It communicates every ``step``, and when a token arrives.  An FMU of FMI 3 with event mode runs ahead to its next
    event, which is a firing at its own time; a token that arrives before that takes it back, if it can save its state.
    Otherwise tokens act from the next communication on, as with an FMU that cannot vary its steps.  At each
    communication all outputs are sent, but those with clocks only when one of these ticks.  Arrays are arrays.

    Clocks are ports: a token at a triggered input clock ticks it, an output clock sends true when it ticks.  An input
    clock with an interval ticks by itself, at its own times, and is an output, too, which says so.

    The output ``fmu`` sends, once, the digest of the file, which so is part of that of the run.  An FMU is a program:
    it runs only if its file was named (``--types``), or ``trust`` was called.  What an FMU computes is outside of the
    promise of bits: another machine may give others.
    """

    is_source: ClassVar[bool] = True
    copies_share: ClassVar[tuple[str, ...]] = ("_about",)

    fmu = OutputPort(str, doc="once, the SHA-256 of the FMU, outside of whose promise of bits its outputs are")

    file = Parameter(Path, doc="the .fmu file")
    step = Parameter(float, None, unit="s", above=0, doc="time between two communications; default: the FMU's own")
    values = MappingParameter(any_parameter(), {}, doc="values of its parameters, and of inputs before a token")
    apart = Parameter(bool, False, doc="whether it runs in a process of its own")
    limit = Parameter(float, 60.0, unit="s", above=0, doc="longest time for a call of one that is apart")

    @staticmethod
    def told(path: Path) -> str:
        """What ``epicycle describe`` says of an FMU: version, platforms, and its variables."""
        about = described(path)
        kinds = {"co-simulation": about.coSimulation, "model exchange": about.modelExchange}
        kinds["scheduled execution"] = about.scheduledExecution
        lines = [f"{about.modelName}: FMI {about.fmiVersion} for {' and '.join(kind for kind in kinds if kinds[kind])}"]
        lines += [about.description] if about.description else []
        lines += [f"platforms: {', '.join(sorted(fmpy.supported_platforms(str(path))))}; sha256:{digest_of(path)}"]
        rows, ports = [("variable", "causality", "type", "unit", "start", "port")], _ports(about)
        for each in about.modelVariables:
            kind = f"{each.type}{list(each.shape) if each.shape else ''}"
            rows.append((each.name, each.causality, kind, each.unit or "", each.start or "", ports.get(each.name, "")))
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return "\n".join([*lines, *("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)])

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        about = self._about = described(self.file)
        runnable(self.file, about)
        self._variables = {each.name: each for each in about.modelVariables}
        self._has_events = bool(about.fmiVersion != "2.0" and about.coSimulation.hasEventMode)
        self._shapes = {name: shape for name in self._variables if (shape := self._shape(name))}
        self._input_of: dict[str, str] = {}
        self._output_of: dict[str, str] = {}
        depends = {each.variable.name: each.dependencies for each in about.outputs}
        found: dict[str, InputPort[Any] | OutputPort[Any]] = {}
        for name, port in _ports(about).items():
            each = self._variables[name]
            if each.type not in KINDS:
                raise ParameterError(
                    f"file: {self.file.name}: {name} is of type {each.type}, which is none of FMI 2 or 3"
                )
            if each.type == CLOCK and not self._has_events:
                raise ParameterError(
                    f"file: {self.file.name}: {name} is a clock, and there is no event mode to tick in"
                )
            kind, said = KINDS[each.type], f"{each.description or name}{f', in {each.unit}' if each.unit else ''}"
            shape = self._shapes.get(name, ())
            tokens: Any = Any if kind is bytes else kind
            if shape:
                tokens = list if kind in (bytes, str) else shaped(np.ndarray, shape)
            if each.causality == "output" or each.intervalVariability in TIMED:
                self._output_of[port] = name
                found[port] = OutputPort(tokens, doc=said, depends_on=() if each.causality == "input" else None)
            else:
                self._input_of[port] = name
                tokens = Any if each.type == CLOCK else tokens | list if shape else tokens
                found[port] = InputPort(tokens, required=False, doc=said)
        for port, name in self._output_of.items():
            known = depends.get(name)
            if known is not None:
                names = {each.name for each in known}
                found[port].change("depends_on", tuple(one for one, other in self._input_of.items() if other in names))
        return found

    def _shape(self, name: str) -> tuple[int, ...]:
        """The lengths of an array; () of a scalar."""
        sizes = []
        for each in self._variables[name].dimensions:
            size = each.start if each.variable is None else self.values.get(each.variable.name, each.variable.start)
            sizes.append(int(size) if isinstance(size, (int, str)) else 0)  # check() says what is wrong with others
        return tuple(sizes)

    def check(self) -> None:
        for name, value in self.values.items():
            if name not in self._variables:
                raise ParameterError(f"values: {self.file.name} has no {name!r}{did_you_mean(name, self._variables)}")
            if (causality := self._variables[name].causality) not in _SETTABLE:
                raise ParameterError(f"values: {name} of {self.file.name} is of causality {causality}, and has its own")
            self._given(name, value)
        own = getattr(self._about.defaultExperiment, "stepSize", None) or self._about.coSimulation.fixedInternalStepSize
        self._step = to_nanoseconds(self.step or float(own or 0.01))

    def _given(self, name: str, value: Any) -> list[Any]:
        """The elements of a value that may be a text with a unit."""
        variable = self._variables[name]
        if isinstance(value, str) and KINDS[variable.type] in (float, int):
            try:
                value = convert(value, variable.unit or "1")
            except Exception as error:
                raise ParameterError(f"values: {name}: {error}") from None
        return self._elements(name, value, "values")

    def _elements(self, name: str, value: Any, where: str) -> list[Any]:
        """The elements of a value, of which a scalar has one; raises ``ParameterError`` if it does not fit."""
        kind, shape = self._variables[name].type, self._shapes.get(name, ())
        array = np.array(value if shape else [value], dtype=object)
        if array.shape == (shape or (1,)) and all(_is_of(kind, each) for each in array.ravel()):
            return [KINDS[kind](each) for each in array.ravel()]
        wanted = f"{kind}{list(shape) or ''}"
        raise ParameterError(f"{where}: {name} of {self.file.name} is of type {wanted}, not {brief(value)}")

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
        file = str(self.file)
        self._slave = Apart(file, self.limit, Slave, file) if self.apart else Slave(file)
        self._can_go_back = bool(co.canGetAndSetFMUstate)
        self._varies = bool(co.canHandleVariableCommunicationStepSize)
        outputs = {name: math.prod(self._shapes.get(name, ())) for name in self._output_of.values()}
        sizes = {name: size for name, size in outputs.items() if variables[name].type != CLOCK}
        self._clocked = {name: size for name, size in sizes.items() if variables[name].clocks}
        self._unclocked = {name: size for name, size in sizes.items() if not variables[name].clocks}
        timed = [variables[name] for name in self._output_of.values() if variables[name].causality == "input"]
        # Of clocks that tick by themselves: when, from the start on, and how often (s).
        self._intervals = {each.name: each.intervalDecimal for each in timed if each.intervalDecimal is not None}
        self._due = {each.name: each.shiftDecimal or Fraction() for each in timed if each.name in self._intervals}
        self._origin = self.context.time
        self._time = to_seconds(self._origin)  # of the FMU
        self._next = self._origin  # communication
        self._waiting: dict[str, list[Any]] = {}  # values for inputs
        self._sampled: dict[str, list[Any]] = {}  # for those with clocks
        self._ticked: list[str] = []  # by tokens
        self._event, self._ends, self._following = self._has_events, False, NEVER
        given = {name: self._given(name, value) for name, value in self.values.items()}
        intervals, shifts = self._call("start", given, self._time)
        self._plan([], intervals)
        self._due |= {name: Fraction(shift) for name, shift in shifts.items()}
        self._saved_at = self._time
        self._is_first = True
        self._wake = self.wake_in(0.0)

    def wrapup(self) -> None:
        if self._slave is not None:
            self._slave.close()
            self._slave = None

    def _call(self, name: str, *given: Any) -> Any:
        """Call a function of the FMU; what it fails with names the file."""
        try:
            return getattr(self._slave, name)(*given)
        except Exception as error:  # of FMPy, of ctypes, or of its process
            reason = str(error) if isinstance(error, EpicycleError) else f"{self.file}: {reason_of(error)}"
            with suppress(Exception):  # whose process may have ended
                reason += f": {self._slave.said()}".removesuffix(": ")
            raise FMUError(reason) from None

    def fire(self) -> None:
        now = self.context.time
        for port, name in self._input_of.items():
            if not self.inputs[port].present:
                continue
            if self._variables[name].type == CLOCK:
                self._ticked.append(name)
            else:
                kept = self._sampled if self._variables[name].clocks else self._waiting
                kept[name] = self._elements(name, self.inputs[port].value, f"{self.path}.{port}")
        if self._is_first:
            self.fmu.send(f"sha256:{digest_of(self.file)}")
            self._is_first = False
        if not self._reached(now):
            return
        ticks = [*dict.fromkeys(self._ticked), *(name for name, time in self._due.items() if self._at(time) <= now)]
        values: dict[str, list[Any]] = {}
        if self._has_events and (self._event or self._waiting or ticks or now >= self._following):
            event: Event = self._call("event", {**self._waiting, **self._sampled}, ticks, self._clocked)
            self._plan(ticks, event.intervals)
            values, ticks = event.values, [*ticks, *event.ticks]
            self._following = NEVER if event.following is None else to_nanoseconds(event.following)
            self._ends = self._ends or event.ends
        elif self._waiting:
            self._call("put", self._waiting)
        self._waiting, self._ticked, self._event = {}, [], False
        values |= self._call("get", self._unclocked)
        for port, name in self._output_of.items():
            if name in values:
                self.outputs[port].send(self._token(name, values[name]))
            elif name in ticks:
                self.outputs[port].send(True)
        if self._ends:
            self.context.stop(f"{self.path}: the FMU ends the simulation")
            return
        while self._next <= now:
            self._next += self._step
        self._go_ahead()

    def _token(self, name: str, elements: list[Any]) -> Any:
        if name not in self._shapes:
            return elements[0]
        kind, shape = self._variables[name].type, self._shapes[name]
        if KINDS[kind] in (bytes, str):
            return np.array(elements, dtype=object).reshape(shape).tolist()
        array: Any = np.array(elements, dtype=np.uint64 if kind == "UInt64" else KINDS[kind]).reshape(shape)
        array.setflags(write=False)
        return array

    def _plan(self, ticks: list[str], told: dict[str, float]) -> None:
        """Find out when clocks tick next that do so by themselves."""
        now = Fraction(self.context.time - self._origin, 10**9)
        for name in ticks:
            if name in self._intervals:
                self._due[name] += self._intervals[name]
            else:
                self._due.pop(name, None)
        for name, interval in told.items():
            self._due[name] = now + Fraction(interval)
            if self._variables[name].intervalVariability != "countdown":
                self._intervals[name] = Fraction(interval)

    def _at(self, time: Fraction) -> int:
        return self._origin + round(time * 10**9)

    def _reached(self, now: int) -> bool:
        """Bring the FMU to the present, if that is possible now; whether it is there."""
        there = to_nanoseconds(self._time)
        if there == now:
            return True
        if there > now:  # it has run ahead, and a token has come
            if not self._can_go_back:
                return False
            self._call("restore")
            self._time, self._event, self._ends = self._saved_at, False, False
        elif not self._varies and now < self._next:
            return False
        while to_nanoseconds(self._time) < now and not self._ends:
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
        target = min(self._next, self._following, *map(self._at, self._due.values()))
        if self._has_events and target > self.context.time:
            if self._can_go_back and self._input_of:
                self._call("save")
                self._saved_at = self._time
            self._advance(to_seconds(target))
            target = to_nanoseconds(self._time)
        self._wake.cancel()
        self._wake = self.context.wake(self, max(target, self.context.time))


def _ports(about: Any) -> dict[str, str]:
    """The ports of inputs and outputs."""
    names = (each.name for each in about.modelVariables if each.causality in ("input", "output"))
    return ports_of(names, "fmu")


def _is_of(kind: str, value: Any) -> bool:
    """Whether a value is one of a type of FMI."""
    value = value.item() if isinstance(value, np.generic) else value
    if KINDS[kind] is float:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and not math.isnan(value)
    if KINDS[kind] is not int:
        return isinstance(value, KINDS[kind])
    values = 1 << int(kind.partition("Int")[2] or 32)
    return type(value) is int and value in range(*((0, values) if kind[0] == "U" else (-values // 2, values // 2)))
