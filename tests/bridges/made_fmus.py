"""FMUs for tests: two of FMI 3 with events and clocks, written in C, and one of FMI 2, written in Python."""

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
CLOCKS = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="clocks" instantiationToken="clocks">
  <CoSimulation modelIdentifier="clocks" canGetAndSetFMUState="true" canHandleVariableCommunicationStepSize="true"
    hasEventMode="true"/>
  <DefaultExperiment stepSize="5"/>
  <ModelVariables>
    <UInt64 name="n" valueReference="1" causality="structuralParameter" variability="fixed" start="3"/>
    <Float64 name="factor" valueReference="2" causality="parameter" variability="fixed" start="1"/>
    <Float64 name="u" valueReference="3" causality="input" start="0 0 0"><Dimension valueReference="1"/></Float64>
    <Float64 name="y" valueReference="4" causality="output">
      <Dimension start="2"/><Dimension valueReference="1"/>
    </Float64>
    <Clock name="push" valueReference="5" causality="input" intervalVariability="triggered"/>
    <Float64 name="amount" valueReference="6" causality="input" variability="discrete" clocks="5" start="0"/>
    <Float64 name="total" valueReference="7" causality="output" variability="discrete" clocks="5"/>
    <Clock name="sample" valueReference="8" causality="input" intervalVariability="constant" intervalDecimal="0.25"
      shiftDecimal="0.1"/>
    <Float64 name="sampled" valueReference="9" causality="output" variability="discrete" clocks="8"/>
    <Clock name="delay" valueReference="10" causality="input" intervalVariability="countdown"/>
    <Int32 name="late" valueReference="11" causality="output" variability="discrete" clocks="10"/>
    <Clock name="thirds" valueReference="12" causality="input" intervalVariability="fixed" supportsFraction="true"
      resolution="3" intervalCounter="1"/>
    <Clock name="full" valueReference="13" causality="output" intervalVariability="triggered"/>
    <Int32 name="overflows" valueReference="14" causality="output" variability="discrete"/>
    <String name="words" valueReference="15" causality="output"><Dimension start="2"/></String>
    <Clock name="pulse" valueReference="16" causality="input" intervalVariability="changing"/>
    <Clock name="paced" valueReference="17" causality="input" intervalVariability="fixed"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="4" dependencies="3"/>
    <Output valueReference="7" dependencies="5 6"/>
    <Output valueReference="9" dependencies="8 3"/>
    <Output valueReference="11" dependencies="10"/>
    <Output valueReference="13" dependencies="5 6"/>
    <Output valueReference="14" dependencies="5 6"/>
    <Output valueReference="15" dependencies=""/>
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
    """A counter that steps each period, a vessel that fills, a feedthrough."""
    return _built(folder, "events", DESCRIPTION.format(back=back), platform)


def clocks(folder: Path) -> Path:
    """Clocks that a token ticks, that tick by themselves, once or again and again, and that tick at events; arrays."""
    return _built(folder, "clocks", CLOCKS)


def _built(folder: Path, name: str, description: str, platform: str = "x86_64-linux") -> Path:
    """An FMU of FMI 3, from its C source."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    library, path = folder / f"{name}.so", folder / f"{name}.fmu"
    sources = [HERE / f"{name}.c", HERE / "unused.c"]
    subprocess.run([compiler, "-shared", "-fPIC", "-o", library, *sources], check=True)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{platform}/{name}.so")
    return path


def decay(folder: Path) -> Path:
    """The FMU of FMI 2: x' = u - rate x, by Euler's method."""
    builder = pytest.importorskip("pythonfmu.builder")
    script = folder / "decay.py"
    script.write_text(DECAY, encoding="utf-8")
    builder.FmuBuilder.build_FMU(script, dest=folder)
    return folder / "Decay.fmu"
