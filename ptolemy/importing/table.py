"""The table of counterparts: which of our actors replaces which of Ptolemy II's.

``"input* name=ours | output"`` lists inputs and outputs; ``*`` marks a multiport; a name without ``=`` is ours in snake
case.  A parameter states its kind, then ``:ours`` if the name differs, and ``=default`` if Ptolemy's default differs or
ours has none.  All rows assume a model with ``like: ptolemy``.
"""

from __future__ import annotations

from collections.abc import Mapping

from . import checks
from . import special as how
from .computing_rows import COMPUTING
from .counterpart import Counterpart, counterpart, view
from .flow_rows import FLOW, TIME
from .source_rows import RANDOM, SOURCES

_SINKS: Mapping[str, Counterpart] = {
    "Test": counterpart(
        "Test",
        "input* | output",
        special=checks.strict_test,
        tolerance="number",
        requireAllCorrectValues="flag:complete",
    ),
    "NonStrictTest": counterpart(
        "Test",
        "input | output",
        special=checks.non_strict_test,
        tolerance="number",
        requireAllCorrectValues="flag:complete",
    ),
    "Recorder": counterpart("Recorder", "input* |", special=how.positive("capacity"), capacity="whole"),
    "Stop": counterpart("Stop", "input* |"),
}

_VIEWS = frozenset(
    {
        "Display",
        "MonitorValue",
        "Discard",
        "TimedPlotter",
        "SequencePlotter",
        "XYPlotter",
        "XYScope",
        "TimedScope",
        "SequenceScope",
        "HistogramPlotter",
        "BarGraph",
        "RealTimePlotter",
        "ArrayPlotter",
        "PlotterBase",
        "Console",
        "FileWriter",
        "LineWriter",
        "DoubleMatrixWriter",
        "ExpressionWriter",
        "CSVWriter",
        "SequentialTimedPlotter",
        "SequentialScope",
        "Publisher0",
        "MatrixViewer",
        "LEDMatrix",
        "ComputeHistogramPlotter",
        "TableDisplay",
        "AWTDisplay",
        "ArrayPlotterXY",
        "DiscardDoubles",
        "DiscardDoublesArray",
        "FileWrite",
        "ImageDisplay",
        "LEDArray",
        "MatrixVisualizer",
        "ModelDisplay",
        "Plotter",
        "SketchedSink",
        "TimedDisplay",
        "TimedMonitorValue",
        "TokenWriter",
        "TextWriter",
        "XMLWriter",
        "Exit",
        "Pause",
        "TypeTest",  # checks types, which are resolved differently here
    }
)
_ALSO = {
    "SimpleDelay": "TimeDelay",
    "TriggeredClock": "Clock",
    "MovingMaximum": "RunningMaximum",
    "OrderedRecordAssembler": "RecordAssembler",
    "TimedDelay": "TimeDelay",
    "VariableDelay": "TimeDelay",
    "IntRamp": "Ramp",
    "ConstPlaceable": "Const",
}

_NAMED: Mapping[str, Counterpart] = {**SOURCES, **RANDOM, **TIME, **FLOW, **COMPUTING, **_SINKS}
# The same name in two packages.
_OTHERS: Mapping[str, str] = {"ptolemy.domains.de.lib.Sampler": "MostRecent"}
_PACKAGES = ("ptolemy.", "org.ptolemy.", "kepler.")
# Packages in which names of the table mean something else.
_FOREIGN = ("ptolemy.actor.lib.vhdl.", "ptolemy.matlab.", "ptolemy.domains.ci.", "ptolemy.domains.ptera.")


def counterpart_of(java: str) -> Counterpart | None:
    """The row for a Java class; None if there is none."""
    name = _OTHERS.get(java) or java.rpartition(".")[2]
    if not java.startswith(_PACKAGES) or java.startswith(_FOREIGN):
        return None
    if java.startswith("ptolemy.domains.continuous.") or ".ct." in java:
        return None if name not in _SINKS and name not in _VIEWS else _NAMED.get(name) or view()
    if name in _VIEWS:
        return view()
    return _NAMED.get(_ALSO.get(name, name))
