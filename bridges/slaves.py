"""FMUs for co-simulation, in this process or in one of their own: what ``fmi`` needs of versions 2 and 3."""

from __future__ import annotations

import hashlib
import os
import secrets
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from multiprocessing.connection import Client, Listener
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2LastSuccessfulTime, fmi2Terminated
from fmpy.fmi3 import FMU3Slave

from epicycle.actors import EpicycleError

CLOCK = "Clock"
DISCARD = 2  # the status of a step that has not been completed
BEGIN_LIMIT = 30.0  # s until a process has started
# What FMPy calls the functions for each type of variables, in version 2 and 3.
TYPES: Mapping[str, tuple[str, type]] = {
    **dict.fromkeys(("Real",), ("Real", float)),
    **dict.fromkeys(("Integer",), ("Integer", int)),
    **dict.fromkeys(("Float32", "Float64"), ("", float)),
    **dict.fromkeys(("Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32", "UInt64"), ("", int)),
    "Enumeration": ("Int64", int),
    "Boolean": ("Boolean", bool),
    "String": ("String", str),
    "Binary": ("Binary", bytes),
    CLOCK: (CLOCK, bool),
}


class FMUError(EpicycleError):
    """An FMU that cannot be used, or that has failed; the message names the file."""


def described(path: Path) -> Any:
    """The description of an FMU, as FMPy reads it; raises ``FMUError``."""
    try:
        return fmpy.read_model_description(str(path), validate=False)
    except Exception as error:  # of many kinds: no archive, no description, wrong XML
        said = " ".join(str(error).split())[:200]
        raise FMUError(f"{path} is not an FMU: {said or type(error).__name__}") from None


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
        self._folder = fmpy.extract(str(self.path))
        self._saved: Any = None
        given = {
            "guid": self.about.guid,
            "unzipDirectory": self._folder,
            "modelIdentifier": self.about.coSimulation.modelIdentifier,
            "instanceName": self.about.modelName or "fmu",
        }
        try:
            self._fmu = FMU3Slave(**given) if self.is_new else FMU2Slave(**given)
        except Exception as error:  # of the system, for a library that it cannot load
            raise FMUError(f"{path} cannot be loaded: {' '.join(str(error).split())[:300]}") from None

    def start(self, values: Mapping[str, Any], time: float) -> None:
        """Initialise it with values of parameters and inputs."""
        if self.is_new:
            self._fmu.instantiate(eventModeUsed=self.has_events, earlyReturnAllowed=self.has_events)
            self.put(values)
            self._fmu.enterInitializationMode(startTime=time)
        else:
            self._fmu.instantiate()
            self._fmu.setupExperiment(startTime=time)
            self.put(values)
            self._fmu.enterInitializationMode()
        self._fmu.exitInitializationMode()

    def _function(self, name: str) -> str:
        kind = self.variables[name].type
        return TYPES[kind][0] if self.is_new is False or TYPES[kind][0] else kind

    def put(self, values: Mapping[str, Any]) -> None:
        """Set variables."""
        for name, value in values.items():
            kind = self._function(name)
            kind = "Integer" if kind == "Int64" and not self.is_new else kind
            getattr(self._fmu, f"set{kind}")([self.variables[name].valueReference], [value])

    def get(self, names: Iterable[str]) -> dict[str, Any]:
        """The values of variables."""
        found = {}
        for name in names:
            kind = self._function(name)
            kind = "Integer" if kind == "Int64" and not self.is_new else kind
            (value,) = getattr(self._fmu, f"get{kind}")([self.variables[name].valueReference])
            value = value.decode("utf-8", "replace") if isinstance(value, bytes) and kind == "String" else value
            found[name] = TYPES[self.variables[name].type][1](value)
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
                last = float(self._fmu.getRealStatus(fmi2LastSuccessfulTime))
                return last, False, bool(self._fmu.getBooleanStatus(fmi2Terminated))
            return until, False, False
        event, ends, early, last = self._fmu.doStep(time, until - time)
        return (last if early else until), bool(event), bool(ends)

    def event(self, values: Mapping[str, Any], clocks: Iterable[str]) -> tuple[list[str], float | None, bool]:
        """Handle an event, at which inputs change; the clocks that tick, the next time event, and whether it ends."""
        self._fmu.enterEventMode()
        self.put(values)
        return self.settle(clocks)

    def settle(self, clocks: Iterable[str]) -> tuple[list[str], float | None, bool]:
        """Let discrete states settle, in event mode, and leave it."""
        ticking = [name for name in clocks if self.get([name])[name]]
        following: float | None = None
        for _ in range(1000):
            again, ends, _, _, defined, when = self._fmu.updateDiscreteStates()
            following = float(when) if defined else None
            if ends or not again:
                break
        else:
            raise FMUError("its discrete states do not settle")
        self._fmu.enterStepMode()
        return ticking, following, bool(ends)

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


class Apart:
    """An FMU in a process of its own: the same methods, each within a limit of time (s)."""

    def __init__(self, path: str, limit: float) -> None:
        self._path, self._limit = path, limit
        key = secrets.token_bytes(16)
        with Listener(authkey=key) as listener:
            address = str(listener.address)
            words = [sys.executable, "-c", "from epicycle.bridges.slaves import serve; serve()", address, path]
            environment = {**os.environ, "EPICYCLE_FMU_KEY": key.hex(), "PYTHONPATH": os.pathsep.join(sys.path)}
            self._process = subprocess.Popen(words, env=environment)
            self._connection = listener.accept()
        self._answer("loading", BEGIN_LIMIT)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)

        def call(*given: Any) -> Any:
            self._connection.send((name, given))
            return self._answer(name, self._limit)

        return call

    def _answer(self, doing: str, limit: float) -> Any:
        try:
            if not self._connection.poll(limit):
                self._end()
                raise FMUError(f"{self._path}: {doing} takes longer than {limit:g} s; its process was ended")
            is_right, answer = self._connection.recv()
        except (EOFError, OSError):
            code = self._process.wait()
            ended = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            raise FMUError(f"{self._path}: its process ended in {doing}, with {ended}") from None
        if not is_right:
            raise FMUError(answer)
        return answer

    def close(self) -> None:
        """End it."""
        with suppress(Exception):
            self._connection.send(("close", ()))
            self._connection.poll(1.0)
        self._end()

    def _end(self) -> None:
        self._process.kill()
        self._process.wait()
        self._connection.close()


def serve() -> None:
    """What the process does: the methods of a ``Slave``, as it is asked for them."""
    address, path = sys.argv[-2:]
    with Client(address, authkey=bytes.fromhex(os.environ.pop("EPICYCLE_FMU_KEY"))) as connection:
        try:
            slave = Slave(path)
            connection.send((True, None))
        except Exception as error:
            connection.send((False, str(error)))
            return
        name = ""
        while name != "close":
            try:
                name, given = connection.recv()
            except EOFError:
                slave.close()
                return
            try:
                connection.send((True, getattr(slave, name)(*given)))
            except Exception as error:
                connection.send((False, f"{path}: {' '.join(str(error).split())}"))


def digest_of(path: Path) -> str:
    """The SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
