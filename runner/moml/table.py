"""The table of counterparts: which of our actors stands for one of Ptolemy II's.

``"input* name=ours | output"`` are inputs and outputs, ``*`` a multiport; a name without ``=`` is ours in snake case.
A parameter says its kind, then ``:ours`` where the name is another, and ``=default`` where Ptolemy's default is another
or ours has none.  Everything is meant for a model with ``like: ptolemy``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from . import checks
from . import special as how
from .counterpart import Counterpart, counterpart, view
from .variables import set_variable

_SOURCES: Mapping[str, Counterpart] = {
    "DiscreteClock": counterpart(
        "Clock",
        "trigger* start stop period | output",
        special=how.finite_stop,
        period="time=1.0",
        offsets="times",
        values="list=[1]",
        stopTime="time",
    ),
    "Clock": counterpart(
        "Clock",
        "trigger* start stop period | output",
        special=how.old_clock,
        fixed={"new_period": "at once", "late_trigger": True},
        period="time=2.0",
        offsets="times=[0.0, 1.0]",
        values="list=[1, 0]",
        stopTime="time",
        numberOfCycles="nothing",
    ),
    "PoissonClock": counterpart(
        "PoissonClock",
        "trigger* | output",
        special=how.poisson_clock,
        meanTime="time:mean_interval",
        values="list=[1, 0]",
        fireAtStart="flag",
        stopTime="time",
    ),
    "SingleEvent": counterpart(
        "SingleEvent", "trigger* | output", special=how.single_event, time="time", value="value"
    ),
    "Const": counterpart("Const", "trigger* | output", needs="trigger", value="value"),
    "StringConst": counterpart("Const", "trigger* | output", needs="trigger", special=how.text_value, value="text"),
    "Ramp": counterpart("Ramp", "trigger* init step | output", init="value", step="value"),
    "Sequence": counterpart(
        "Sequence",
        "trigger* enable | output",
        needs="trigger enable",
        special=how.sequence,
        values="list=[1]",
        repeat="flag",
        holdLastOutput="flag:hold",
    ),
    "Pulse": counterpart("Pulse", "trigger* | output", values="list", indexes="list", repeat="flag"),
    "CurrentTime": counterpart("CurrentTime", "trigger* | output", stopTime="nothing"),
    "CurrentMicrostep": counterpart("CurrentMicrostep", "trigger* | output"),
    "GetCurrentMicrostep": counterpart("CurrentMicrostep", "trigger* input=trigger | output"),
}


def _random(ports: str, special: how.Special) -> Counterpart:
    return counterpart("Random", f"trigger* {ports} | output", special=special)


_NORMAL = _random(
    "mean standardDeviation", how.random("Normal", mean="mean=0.0", standard_deviation="standardDeviation=1.0")
)
_COIN = _random("trueProbability", how.random("Bernoulli", probability="trueProbability=0.5"))
_RANDOM: Mapping[str, Counterpart] = {
    "Gaussian": _NORMAL,
    "ColtNormal": _NORMAL,
    "Uniform": _random("lowerBound upperBound", how.random("Uniform", low="lowerBound=0.0", high="upperBound=1.0")),
    "Bernoulli": _COIN,
    "ColtBernoulli": _COIN,
    "CoinFlip": _COIN,
    "Triangular": _random("min max mode", how.random("Triangular", low="min=0.0", high="max=1.0", mode="mode=0.5")),
    "DiscreteRandomSource": _random("", how.random("Choice", values="values={0, 1}", weights="pmf={0.5, 0.5}")),
    "ColtPoisson": _random("mean", how.random("Poisson", mean="mean=1.0")),
    "ColtBinomial": _random("n p", how.random("Binomial", trials="n=1", probability="p=0.5")),
    "ColtNegativeBinomial": _random("n p", how.colt_negative_binomial),
    "ColtChiSquare": _random("freedom", how.random("ChiSquare", freedom="freedom=1.0")),
    "ColtStudentT": _random("freedom", how.random("StudentT", freedom="freedom=1.0")),
    "ColtBreitWigner": _random("mean gamma cut", how.colt_breit_wigner),
    "ColtVonMises": _random("freedom", how.random("VonMises", concentration="freedom=1.0")),
    "ColtExponential": _random("lambda", how.colt_exponential),
    "ColtGamma": _random("alpha lambda", how.colt_gamma),
}

_TIME: Mapping[str, Counterpart] = {
    "Queue": counterpart(
        "Queue",
        "input trigger* | output size",
        special=how.positive("capacity"),
        capacity="whole",
        persistentTrigger="flag",
    ),
    "SharedQueue": counterpart(
        "SharedQueue",
        "input trigger* | output* size",
        special=how.positive("capacity"),
        capacity="whole",
        persistentTrigger="nothing",
    ),
    "Server": counterpart(
        "Server",
        "input serviceTime | output size",
        special=how.positive("capacity"),
        serviceTime="time",
        capacity="whole",
    ),
    "TimeDelay": counterpart("TimeDelay", "input delay | output", delay="time", minimumDelay="nothing"),
    "MicrostepDelay": counterpart("TimeDelay", fixed={"delay": "0 s"}),
    "ResettableTimer": counterpart("ResettableTimer", value="value", preemptive="flag"),
    "Timer": counterpart("Timer", value="value"),
    "NonInterruptibleTimer": counterpart("ResettableTimer", fixed={"preemptive": False}, value="value"),
    "TimeGap": counterpart("TimeGap"),
    "WaitingTime": counterpart("WaitingTime", "waiter waitee=waited_for | output"),
    "TimeCompare": counterpart("TimeCompare", "input1=first input2=second | output", nonnegative="flag"),
}

_FLOW: Mapping[str, Counterpart] = {
    "Merge": counterpart("Merge", "input* | output", discardEvents="flag:discard"),
    "Sampler": counterpart("Sampler", "input* trigger* | output*"),
    "MostRecent": counterpart("MostRecent", "input* trigger* | output*", initialValue="value:initial"),
    "Register": counterpart("Register", "input* trigger* | output*", initialValue="value:initial"),
    "Inhibit": counterpart("Inhibit", "input* inhibit* | output*"),
    "Previous": counterpart("Previous", initialValue="value:initial"),
    "EventFilter": counterpart("Filter", "input* | output*"),
    "TrueGate": counterpart("Filter", "input* | output*"),
    "QuantizedSampler": counterpart("Changes", special=how.quantum),
    "SuppressSimultaneousEvents": counterpart("FirstOfInstant"),
    "SamplerWithDefault": counterpart("MostRecent", "input* trigger* | output*", initialValue="value:initial"),
    "Wire": counterpart("LatestOfAll", "input* | output*", initialValue="value:initial=0"),
    "Switch": counterpart("Switch", "input control | output*"),
    "BooleanSwitch": counterpart("BooleanSwitch", "input* control | trueOutput* falseOutput*"),
    "ConfigurationSwitch": counterpart(
        "BooleanSwitch", "input* selector=control | trueOutput* falseOutput*", selector="flag:control"
    ),
    "Select": counterpart("Select", "input* control | output"),
    "BooleanSelect": counterpart("BooleanSelect", "trueInput* falseInput* control | output*"),
    "Multiplexor": counterpart("Select", "input* select=control | output", fixed={"unread": "lost", "initial": None}),
    "BooleanMultiplexor": counterpart(
        "BooleanSelect", "trueInput falseInput select=control | output", fixed={"unread": "lost"}
    ),
    "Distributor": counterpart("Router", "input* | output*", special=how.no_trigger("blockSize=1")),
    "Commutator": counterpart("Commutator", "input* | output", blockSize="whole:block"),
    "Synchronizer": counterpart("Synchronizer", "input* | output*"),
    "Repeat": counterpart(
        "Repeat",
        "input numberOfTimes=times | output",
        special=how.repeat,
        numberOfTimes="whole:times",
    ),
    "DownSample": counterpart(
        "BlockExpression", special=how.blocks("block[-1 - {phase}]", "factor", items=False, factor=2, phase=0)
    ),
    "UpSample": counterpart("BlockExpression", special=how.up_sample),
    "Chop": counterpart("BlockExpression", special=how.chop),
    "DelayLine": counterpart("BlockExpression", special=how.delay_line),
    "RecordUpdater": counterpart("RecordAssembler", "input=input | output", special=how.record_updater),
    "SequenceToArray": counterpart("Batch", "input arrayLength | output", arrayLength="whole:number=1"),
    "ArrayToSequence": counterpart("Unbatch", arrayLength="nothing", enforceArrayLength="nothing"),
    "RecordAssembler": counterpart("RecordAssembler", "| output", special=how.fields("input")),
    "RecordDisassembler": counterpart("RecordDisassembler", "input |", special=how.fields("output")),
    "SetVariable": counterpart("SetVariable", special=set_variable, variableName="nothing"),
    "Default": counterpart("Default", "preferred alternate | output"),
    "Sequencer": counterpart("Sequencer", "input sequenceNumber=number | output", startingSequenceNumber="whole:first"),
    "ElementsToArray": counterpart("Collect", "input* | output"),
    "ArrayToElements": counterpart("Spread", "input | output*"),
    "Sleep": counterpart("Filter", "input* | output*", fixed={"condition": "True"}, sleepTime="nothing"),
    "ExecutionTime": counterpart(
        "Const",
        "trigger* | output",
        needs="trigger",
        special=how.execution_time,
        fixed={"value": 0},
        executionTime="nothing",
        realTime="nothing",
        granularity="nothing",
    ),
    "IsPresent": counterpart("IsPresent", "input* | output*"),
}

_GATES = {each: each for each in ("and", "or", "xor", "nand", "nor", "xnor")}
_REPLACE = counterpart(
    "TextFunction",
    "stringToEdit=text pattern=other replacement=new | output",
    special=how.replaced,
    stringToEdit="text:text",
    pattern="text:other",
    replacement="text:new",
)
_SIMPLE_REPLACE = replace(_REPLACE, special=None, fixed={"function": "replace"})
_DOUBLE = counterpart("Expression", "input=input | output", special=how.formula("float(input)"))
_DECIBEL = counterpart("Expression", "input=input | output", special=how.decibel)
_COMPUTING: Mapping[str, Counterpart] = {
    "Comparator": counterpart(
        "Comparator",
        "left right | output",
        special=how.choice(
            "comparison", "comparison", ">", {each: each for each in (">", ">=", "<", "<=", "==", "!=")}
        ),
        tolerance="number",
    ),
    "Equals": counterpart("Equals", "input* | output", tolerance="number"),
    "LogicFunction": counterpart(
        "LogicGate", "input* | output", special=how.choice("function", "function", "and", _GATES)
    ),
    "LogicGate": counterpart("LogicGate", "input* | output", special=how.choice("logic", "function", "and", _GATES)),
    "LogicalNot": counterpart("LogicGate", "input* | output*", special=how.single("input"), fixed={"function": "not"}),
    "AddSubtract": counterpart("AddSubtract", "plus* minus* | output"),
    "MultiplyDivide": counterpart("MultiplyDivide", "multiply* divide* | output"),
    "Scale": counterpart("Scale", "input factor | output", factor="number"),
    "AbsoluteValue": counterpart("MathFunction", fixed={"function": "abs"}),
    "MathFunction": counterpart(
        "MathFunction", "firstOperand=input secondOperand=input | output", special=how.math_function
    ),
    "UnaryMathFunction": counterpart(
        "MathFunction",
        special=how.choice(
            "function", "function", "exp", {each: each for each in ("exp", "log", "sign", "square", "sqrt")}
        ),
    ),
    "TrigFunction": counterpart(
        "MathFunction",
        special=how.choice(
            "function", "function", "sin", {each: each for each in ("sin", "cos", "tan", "asin", "acos", "atan")}
        ),
    ),
    "Round": counterpart("Expression", "input=input | output", special=how.rounding),
    "Accumulator": counterpart(
        "Accumulator",
        "input* reset* | output",
        init="number:initial",
        lowerBound="number:low",
        upperBound="number:high",
    ),
    "Counter": counterpart("Counter", "increment* decrement* reset* | output"),
    "Differential": counterpart("Difference", fixed={"initial": 0}),
    "Derivative": counterpart("Derivative", "input reset | output"),
    "AverageOverTime": counterpart("TimeAverage"),
    "Integrator": counterpart(
        "Integrator", "input reset | output", fixed={"method": "trapezoid"}, initialValue="number:initial"
    ),
    "Expression": counterpart("Expression", "| output", special=how.expression),
    "LookupTable": counterpart("LookupTable", table="list:values=[0, 1]"),
    "Limiter": counterpart("Limiter", special=how.limiter),
    "Quantizer": counterpart("Expression", "input=input | output", special=how.quantizer),
    "Maximum": counterpart("Extreme", "input* | maximumValue=value channelNumber=channel", fixed={"take": "greatest"}),
    "Minimum": counterpart("Extreme", "input* | minimumValue=value channelNumber=channel", fixed={"take": "least"}),
    "Average": counterpart("MovingAverage", "input reset | output", fixed={"span": "1e8 s", "whole": True}),
    "PID": counterpart("PID", "input=measurement reset | output", special=how.pid),
    "IIR": counterpart("DiscreteFilter", numerator="list=[1.0]", denominator="list=[1.0]"),
    "MovingAverage": counterpart("MovingAverage", maxPastInputsToAverage="whole:size=10"),
    "Remainder": counterpart(
        "Expression",
        "input=input | output",
        special=how.formula("input - {divisor} * round(input / {divisor})", divisor=1.0),
    ),
    "ArrayElement": counterpart(
        "Expression", "input=input index=index | output", special=how.formula("input[{index}]", index=0)
    ),
    "ArrayLength": counterpart("Expression", "input=input | output", special=how.formula("len(input)")),
    "ArraySum": counterpart("Expression", "input=input | output", special=how.formula("sum(input)")),
    "ArrayMinimum": counterpart("Expression", "input=input | output", special=how.formula("min(input)")),
    "ArrayMaximum": counterpart("Expression", "input=input | output", special=how.formula("max(input)")),
    "ArrayAverage": counterpart("Expression", "input=input | output", special=how.formula("sum(input) / len(input)")),
    "ArrayExtract": counterpart(
        "Expression",
        "input=input sourcePosition=sourcePosition extractLength=extractLength "
        "destinationPosition=destinationPosition outputArrayLength=outputArrayLength | output",
        special=how.array_extract,
    ),
    "ArrayUpdate": counterpart(
        "Expression",
        "input=input index=index value=value | output",
        special=how.formula("input[:{index}] + [{value}] + input[{index} + 1:]", index=0, value=1),
    ),
    "ArrayRemoveElement": counterpart(
        "Expression",
        "array=array element=element | output",
        special=how.formula("[each for each in array if each != {element}]"),
    ),
    "ArrayAppend": counterpart("Collect", "input* | output", fixed={"joined": True}),
    "ArraySort": counterpart("Expression", "input=input | output", special=how.array_sort),
    "DotProduct": counterpart(
        "Expression",
        "input1=input1 input2=input2 | output",
        special=how.formula("sum([input1[k] * input2[k] for k in range(len(input1))])"),
    ),
    "ArrayContains": counterpart(
        "Expression", "array=array element=element | output", special=how.formula("{element} in array")
    ),
    "BooleanToAnything": counterpart(
        "Expression",
        "input=input | output",
        special=how.formula("{trueValue} if input else {falseValue}", trueValue=1, falseValue=0),
    ),
    "DB": _DECIBEL,
    "dB": _DECIBEL,
    "LongToDouble": _DOUBLE,
    "AnythingToDouble": _DOUBLE,
    "StringToDouble": _DOUBLE,
    "StringToInt": counterpart("Expression", "input=input | output", special=how.formula("int(input)")),
    "StringToBoolean": counterpart("Expression", "input=input | output", special=how.formula("input == 'true'")),
    "StringSubstring": counterpart(
        "Expression",
        "input=input start=start stop=stop | output",
        special=how.formula("input[{start}:{stop}] if {stop} >= {start} else input[{start}:]", start=0, stop=0),
    ),
    "StringCompare": counterpart(
        "TextFunction",
        "firstString=text secondString=other | output",
        special=how.choice(
            "function",
            "function",
            "equals",
            {"equals": "equals", "contains": "contains", "startsWith": "starts with", "endsWith": "ends with"},
        ),
        firstString="text:text",
        secondString="text:other",
        ignoreCase="flag",
    ),
    "StringFunction": counterpart(
        "TextFunction",
        "input=text | output",
        special=how.choice(
            "function", "function", "trim", {"trim": "trim", "toLowerCase": "lower", "toUpperCase": "upper"}
        ),
    ),
    "StringIndexOf": counterpart(
        "TextFunction",
        "inText=text searchFor=other | output",
        special=how.index_of,
        fixed={"function": "find"},
        inText="text:text",
        searchFor="text:other",
        ignoreCase="flag",
    ),
    "StringMatches": counterpart(
        "TextFunction",
        "matchString=text pattern=other | output",
        special=how.plain_pattern("pattern"),
        fixed={"function": "contains"},
        matchString="text:text",
        pattern="text:other",
    ),
    "StringReplace": _REPLACE,
    "StringSimpleReplace": _SIMPLE_REPLACE,
    "StringLength": counterpart("Expression", "input=input | output", special=how.formula("len(input)")),
}

_SINKS: Mapping[str, Counterpart] = {
    "Test": counterpart(
        "Test",
        "input* | output",
        special=checks.strict_test,
        tolerance="number",
        requireAllCorrectValues="flag:complete",
        requireOrderedValues="none",
    ),
    "NonStrictTest": counterpart(
        "Test",
        "input | output",
        special=checks.non_strict_test,
        tolerance="number",
        requireAllCorrectValues="flag:complete",
        requireOrderedValues="none",
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
        "TypeTest",  # of types, which are resolved otherwise here
    }
)
_ALSO = {
    "TimedDelay": "TimeDelay",
    "VariableDelay": "TimeDelay",
    "IntRamp": "Ramp",
}

_NAMED: Mapping[str, Counterpart] = {**_SOURCES, **_RANDOM, **_TIME, **_FLOW, **_COMPUTING, **_SINKS}
# The same name in two packages.
_OTHERS: Mapping[str, str] = {"ptolemy.domains.de.lib.Sampler": "MostRecent"}
_PACKAGES = ("ptolemy.", "org.ptolemy.", "kepler.")


def counterpart_of(java: str) -> Counterpart | None:
    """The row for a Java class; None if there is none."""
    name = _OTHERS.get(java) or java.rpartition(".")[2]
    if not java.startswith(_PACKAGES):
        return None
    if java.startswith("ptolemy.domains.continuous.") or ".ct." in java:
        return None if name not in _SINKS and name not in _VIEWS else _NAMED.get(name) or view()
    if name in _VIEWS:
        return view()
    return _NAMED.get(_ALSO.get(name, name))
