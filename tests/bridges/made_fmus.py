"""FMUs for tests: one of FMI 3 with events, written in C, and one of FMI 2, written in Python."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest

HERE = Path(__file__).parent / "fmus"
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="events" instantiationToken="events">
  <CoSimulation modelIdentifier="events" canGetAndSetFMUState="{back}" canHandleVariableCommunicationStepSize="true"
    hasEventMode="true" canReturnEarlyAfterIntermediateUpdate="true"/>
  <UnitDefinitions><Unit name="s"/></UnitDefinitions>
  <DefaultExperiment stepSize="0.3"/>
  <ModelVariables>
    <Float64 name="period" valueReference="1" causality="parameter" variability="fixed" start="1" unit="s"/>
    <Float64 name="flow" valueReference="2" causality="input" start="0"/>
    <Float64 name="in" valueReference="3" causality="input" start="0"/>
    <Float64 name="out" valueReference="4" causality="output"/>
    <Float64 name="level" valueReference="5" causality="output"/>
    <Int32 name="counter" valueReference="6" causality="output" variability="discrete"/>
    <Int32 name="fills" valueReference="7" causality="output" variability="discrete"/>
    <Clock name="full" valueReference="8" causality="output" intervalVariability="triggered"/>
    <Int32 name="mistake" valueReference="9" causality="parameter" variability="fixed" start="0"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="4" dependencies="3"/>
    <Output valueReference="5" dependencies=""/>
    <Output valueReference="6" dependencies=""/>
    <Output valueReference="7" dependencies=""/>
    <Output valueReference="8" dependencies=""/>
  </ModelStructure>
</fmiModelDescription>
"""
DECAY = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Decay(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x, self.rate, self.u, self.y = 1.0, 0.5, 0.0, 0.0
        self.register_variable(Real("rate", causality=Fmi2Causality.parameter, variability="tunable"))
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("x", causality=Fmi2Causality.output))

    def do_step(self, time, step):
        self.x += step * (self.u - self.rate * self.x)
        return True
"""


def events(folder: Path, platform: str = "x86_64-linux", back: str = "true") -> Path:
    """The FMU of FMI 3: a counter that steps each period, a vessel that fills, a feedthrough."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    library, path = folder / "events.so", folder / "events.fmu"
    subprocess.run([compiler, "-shared", "-fPIC", "-o", library, HERE / "events.c"], check=True)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION.format(back=back))
        archive.write(library, f"binaries/{platform}/events.so")
    return path


def decay(folder: Path) -> Path:
    """The FMU of FMI 2: x' = u - rate x, by Euler's method."""
    builder = pytest.importorskip("pythonfmu.builder")
    script = folder / "decay.py"
    script.write_text(DECAY, encoding="utf-8")
    builder.FmuBuilder.build_FMU(script, dest=folder)
    return folder / "Decay.fmu"
