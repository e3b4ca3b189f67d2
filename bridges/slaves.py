"""FMUs for co-simulation: what ``fmi`` needs of versions 2 and 3."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping
from contextlib import suppress
from ctypes import byref, c_double, c_int, c_uint32
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple, TypeVar
from zipfile import ZipFile

import fmpy
from defusedxml.ElementTree import fromstring
from fmpy import fmi2
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.logging import addLoggerProxy

from epicycle.actors import EpicycleError

from .names import reason_of

CLOCK = "Clock"
TIMED = ("constant", "fixed", "calculated", "tunable", "changing", "countdown")  # clocks that the importer lets tick
APERIODIC = ("changing", "countdown")  # of these, those that begin with their first interval
DISCARD = 2  # the status of a step that has not been completed
BEYOND = 4e9  # s, longer than any run
CHANGED = 2  # the qualifier of an interval that the importer has not heard of
KINDS: Mapping[str, type] = {
    **dict.fromkeys(("Real", "Float32", "Float64"), float),
    **dict.fromkeys(("Integer", "Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32", "UInt64"), int),
    "Enumeration": int,
    "Boolean": bool,
    "String": str,
    "Binary": bytes,
    CLOCK: bool,
}

T = TypeVar("T")


class FMUError(EpicycleError):
    """An FMU that cannot be used, or that has failed; the message names the file."""


class Event(NamedTuple):
    """What an event has brought."""

    ticks: list[str]  # output clocks
    values: dict[str, list[Any]]  # of outputs whose clocks tick
    intervals: dict[str, float]  # s until clocks tick, where the FMU decides
    following: float | None  # time of the next event (s)
    ends: bool  # whether the FMU ends the simulation


def described(path: Path) -> Any:
    """The description of an FMU, as FMPy reads it, with the intervals of clocks; raises ``FMUError``."""
    try:
        about = fmpy.read_model_description(str(path), validate=False)
        with ZipFile(path) as archive:
            clocks = {each.get("name"): each for each in fromstring(archive.read("modelDescription.xml")).iter(CLOCK)}
        for each in about.modelVariables:
            each.clocks = [clock.name for clock in each.clocks or ()]
            if each.type == CLOCK:
                each.intervalDecimal = _seconds(clocks[each.name], "interval", 1e-9)
                each.shiftDecimal = _seconds(clocks[each.name], "shift", 0.0)
    except Exception as error:  # of many kinds: no archive, no description, wrong XML
        raise FMUError(f"{path} is not an FMU: {reason_of(error)}") from None
    return about


def _seconds(clock: Any, name: str, least: float) -> Fraction | None:
    """The interval or the shift of a clock, a decimal number or counted in its resolution."""
    counter = clock.get(f"{name}Counter")
    number = clock.get(f"{name}Decimal") if counter is None else counter
    if number is None:
        return None
    parts = 1 if counter is None else int(clock.get("resolution"))
    _within(least, float(number) / parts, name, clock.get("name"))  # before the fraction of 1e999999999, which is huge
    return Fraction(number) / parts


def _within(least: float, seconds: float, name: str, clock: str) -> float:
    if least <= seconds <= BEYOND:
        return seconds
    raise ValueError(f"the {name} of the clock {clock} is not from {least:g} s to {BEYOND:g} s")


def runnable(path: Path, about: Any) -> None:
    """Raise ``FMUError`` if an FMU cannot run here."""
    if about.coSimulation is None:
        raise FMUError(f"{path} is not for co-simulation, but for model exchange or scheduled execution only")
    if about.fmiVersion not in ("2.0",) and not about.fmiVersion.startswith("3.0"):
        raise FMUError(f"{path} is of version {about.fmiVersion} of FMI, and this needs version 2 or 3")
    here = fmpy.platform if about.fmiVersion == "2.0" else fmpy.platform_tuple
    known = fmpy.supported_platforms(str(path))
    if here not in known and fmpy.platform not in known:
        raise FMUError(f"{path} has no binary for {here}; it has: {', '.join(sorted(known)) or 'none'}")


class Slave:
    """An FMU that runs; times are in s."""

    def __init__(self, path: str) -> None:
        self.path = Path(path)
        self.about = described(self.path)
        runnable(self.path, self.about)
        self.variables = {each.name: each for each in self.about.modelVariables}
        self.is_new = self.about.fmiVersion != "2.0"
        self.has_events = bool(self.is_new and self.about.coSimulation.hasEventMode)
        clocks = {name: each for name, each in self.variables.items() if each.type == CLOCK}
        self._outward = [name for name, each in clocks.items() if each.causality == "output"]
        timed = {name: each for name, each in clocks.items() if each.intervalVariability in TIMED}
        self._asked = [name for name, each in timed.items() if each.intervalDecimal is None]  # as the FMU decides
        self._periodic = [name for name in self._asked if timed[name].intervalVariability not in APERIODIC]
        self._is_stepping = False  # and not handling events, with which it begins
        self._folder = fmpy.extract(str(self.path))
        self._saved: Any = None
        self._said = ""
        given = {
            "guid": self.about.guid,
            "unzipDirectory": self._folder,
            "modelIdentifier": self.about.coSimulation.modelIdentifier,
            "instanceName": self.about.modelName or "fmu",
        }
        try:
            self._fmu = FMU3Slave(**given) if self.is_new else fmi2.FMU2Slave(**given)
        except Exception as error:  # of the system, for a library that it cannot load
            raise FMUError(f"{path} cannot be loaded: {reason_of(error)}") from None

    def start(self, values: Mapping[str, list[Any]], time: float) -> tuple[dict[str, float], dict[str, float]]:
        """Initialise it with values of parameters and inputs; the intervals and shifts of clocks that it decides."""
        sizes = {name for name in values if self.variables[name].causality == "structuralParameter"}
        others = {name: value for name, value in values.items() if name not in sizes}
        if self.is_new:
            events = self.has_events
            self._fmu.instantiate(eventModeUsed=events, earlyReturnAllowed=events, logMessage=self._hear)
            if sizes:
                self._fmu.enterConfigurationMode()
                self.put({name: values[name] for name in sizes})
                self._fmu.exitConfigurationMode()
            self.put(others)
            self._fmu.enterInitializationMode(startTime=time)
        else:
            callbacks = fmi2.fmi2CallbackFunctions.from_buffer_copy(fmi2.defaultCallbacks)
            callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._hear)
            addLoggerProxy(byref(callbacks))
            self._fmu.instantiate(callbacks=callbacks)
            self._fmu.setupExperiment(startTime=time)
            self.put(others)
            self._fmu.enterInitializationMode()
        told = self._intervals(), {name: self._shift(name) for name in self._periodic}
        self._fmu.exitInitializationMode()
        return told

    def _hear(self, *given: Any) -> None:
        """Keep what the FMU says of an error; all else that it would write to the terminal is nobody's business."""
        *_, status, _, message = given
        if status > DISCARD:
            self._said = message.decode("utf-8", "replace")

    def said(self) -> str:
        """What the FMU has said of its latest error."""
        return self._said

    def _function(self, name: str) -> str:
        kind: str = self.variables[name].type
        return kind if kind != "Enumeration" else "Int64" if self.is_new else "Integer"

    def put(self, values: Mapping[str, list[Any]]) -> None:
        """Set variables; the values are those of all elements."""
        for name, elements in values.items():
            getattr(self._fmu, f"set{self._function(name)}")([self.variables[name].valueReference], elements)

    def get(self, sizes: Mapping[str, int]) -> dict[str, list[Any]]:
        """The values of variables with so many elements."""
        found = {}
        for name, size in sizes.items():
            kind, function = KINDS[self.variables[name].type], f"get{self._function(name)}"
            elements = getattr(self._fmu, function)([self.variables[name].valueReference], *[size] * self.is_new)
            if kind is str:
                elements = [each if isinstance(each, str) else each.decode("utf-8", "replace") for each in elements]
            found[name] = [kind(each) for each in elements]
        return found

    def step(self, time: float, until: float) -> tuple[float, bool, bool]:
        """Go on; the time that was reached, whether there is an event, and whether it ends the simulation."""
        if not self.is_new:
            try:
                self._fmu.doStep(time, until - time)
            except FMICallException as error:
                if error.status != DISCARD:
                    raise
                # It has come only so far, perhaps because it ends the simulation.
                last = float(self._fmu.getRealStatus(fmi2.fmi2LastSuccessfulTime))
                return last, False, bool(self._fmu.getBooleanStatus(fmi2.fmi2Terminated))
            return until, False, False
        event, ends, early, last = self._fmu.doStep(time, until - time, self._saved is None)
        return (last if early else until), bool(event), bool(ends)

    def event(self, values: Mapping[str, list[Any]], ticks: list[str], sizes: Mapping[str, int]) -> Event:
        """Handle an event: inputs change, those with clocks if one of these ticks.

        ``ticks`` are the input clocks that tick, ``sizes`` those of the outputs that have clocks.
        """
        if self._is_stepping:
            self._fmu.enterEventMode()
        self.put({name: value for name, value in values.items() if not self.variables[name].clocks})
        if ticks:
            self._fmu.setClock([self.variables[name].valueReference for name in ticks], [True] * len(ticks))
        came: list[str] = []
        told: dict[str, list[Any]] = {}
        intervals: dict[str, float] = {}
        following: float | None = None
        for _ in range(1000):
            self.put(self._of(ticks, values))
            new = [name for name in self._outward if self._fmu.getClock([self.variables[name].valueReference])[0]]
            self.put(self._of(new, values))
            told |= self.get(self._of([*ticks, *new], sizes))
            came += new
            again, ends, _, _, defined, when = self._fmu.updateDiscreteStates()
            intervals |= self._intervals()
            following, ticks = (float(when) if defined and when < BEYOND else None), []
            if ends or not again:
                break
        else:
            raise ValueError("its discrete states do not settle")
        self._fmu.enterStepMode()
        self._is_stepping = True
        return Event(came, told, intervals, following, bool(ends))

    def _intervals(self) -> dict[str, float]:
        """The intervals of clocks that the FMU has changed."""
        found = {}
        for name in self._asked:
            interval, qualifier = (c_double * 1)(), (c_int * 1)()
            self._fmu.getIntervalDecimal((c_uint32 * 1)(self.variables[name].valueReference), interval, qualifier)
            if qualifier[0] == CHANGED:
                found[name] = _within(0.0, interval[0], "interval", name)
        return found

    def _shift(self, name: str) -> float:
        shift = (c_double * 1)()
        self._fmu.getShiftDecimal((c_uint32 * 1)(self.variables[name].valueReference), shift)
        return _within(0.0, shift[0], "shift", name)

    def _of(self, clocks: list[str], each: Mapping[str, T]) -> dict[str, T]:
        """Those variables that have one of these clocks."""
        return {name: value for name, value in each.items() if not set(clocks).isdisjoint(self.variables[name].clocks)}

    def save(self) -> None:
        """Keep the present state."""
        if self._saved is not None:
            self._fmu.freeFMUState(self._saved)
        self._saved = self._fmu.getFMUState()

    def restore(self) -> None:
        """Go back to the state that is kept."""
        self._fmu.setFMUState(self._saved)

    def close(self) -> None:
        """End it, and remove its files; whatever it does then."""
        for act in (self._fmu.terminate, self._fmu.freeInstance):
            with suppress(Exception):
                act()
        shutil.rmtree(self._folder, ignore_errors=True)


def digest_of(path: Path) -> str:
    """The SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
