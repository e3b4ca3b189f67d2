"""Rows of the table: time, queues, and actors that route, combine and split tokens."""

from __future__ import annotations

from collections.abc import Mapping

from . import formulas
from . import special as how
from .counterpart import Counterpart, counterpart
from .variables import set_variable

TIME: Mapping[str, Counterpart] = {
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

FLOW: Mapping[str, Counterpart] = {
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
    "ConfigurationSelect": counterpart(
        "Filter",
        "trueInput*=input falseInput*=input | output*",
        special=how.chosen_input,
        fixed={"condition": "True"},
    ),
    "SingleTokenCommutator": counterpart("Commutator", "input* | output", fixed={"waits": False}),
    "Commutator": counterpart("Commutator", "input* | output", blockSize="whole:block"),
    "Synchronizer": counterpart("Synchronizer", "input* | output*"),
    "Repeat": counterpart(
        "Repeat",
        "input numberOfTimes=times | output",
        special=formulas.repeat,
        numberOfTimes="whole:times",
    ),
    "DownSample": counterpart(
        "BlockExpression", special=formulas.blocks("block[-1 - {phase}]", "factor", items=False, factor=2, phase=0)
    ),
    "UpSample": counterpart("BlockExpression", special=formulas.up_sample),
    "Chop": counterpart("BlockExpression", special=formulas.chop),
    "DelayLine": counterpart("BlockExpression", special=formulas.delay_line),
    "RecordUpdater": counterpart("RecordAssembler", "input=input | output", special=how.record_updater),
    "SequenceToArray": counterpart("Batch", "input arrayLength | output", arrayLength="whole:number=1"),
    "ArrayToSequence": counterpart("Unbatch", arrayLength="nothing", enforceArrayLength="nothing"),
    "RecordAssembler": counterpart("RecordAssembler", "| output", special=how.fields("input")),
    "RecordDisassembler": counterpart("RecordDisassembler", "input |", special=how.fields("output")),
    "UnionMerge": counterpart("RecordAssembler", "| output", special=how.fields("input"), fixed={"apart": True}),
    "UnionDisassembler": counterpart(
        "RecordDisassembler", "input |", special=how.fields("output"), fixed={"partial": True}
    ),
    "SetVariable": counterpart("SetVariable", special=set_variable, variableName="nothing"),
    "Default": counterpart("Default", "preferred alternate | output"),
    "Sequencer": counterpart("Sequencer", "input sequenceNumber=number | output", startingSequenceNumber="whole:first"),
    "ElementsToArray": counterpart("Collect", "input* | output"),
    "ArrayToElements": counterpart("Spread", "input | output*"),
    "RemoveNilTokens": counterpart("Filter", fixed={"condition": "True"}),
    "Current": counterpart("Filter", fixed={"condition": "True"}),
    "NonStrictDelay": counterpart("Previous", initialValue="value:initial"),
    "Pre": counterpart("Previous", initialValue="value:initial"),
    "SampleDelay": counterpart("BlockExpression", special=formulas.sample_delay),
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
