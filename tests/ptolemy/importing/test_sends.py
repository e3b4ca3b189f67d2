"""Some of the conformance cases, written in MoML and imported: every send as in Ptolemy."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conformance.test_conformance import RESOLUTION, own_name, own_token, recorded
from tests.ptolemy.importing.moml_parts import DE, LIB, composite, entity, model, port, sent, wires


def values(*numbers: float) -> str:
    return "{" + ", ".join(map(repr, numbers)) + "}"


OUT, IN = port("port", "output"), port("port2", "input")
CASES = {
    "TimeDelayZeroDelay": model(
        entity("Merge", f"{DE}Merge", discardEvents="true"),
        entity("SingleEvent", f"{DE}SingleEvent", value="1.0"),
        entity("TimedDelay", f"{DE}TimedDelay", delay="0.0"),
        entity("Ramp", "Ramp"),
        entity("NonStrictTest", "NonStrictTest", correctValues=values(*[1.0] * 12)),
        entity("Expression", "Expression", port("input", "input"), expression="input > 10"),
        entity("Stop", "Stop"),
        wires(
            "TimedDelay.output Merge.input",
            "SingleEvent.output Merge.input",
            "Merge.output TimedDelay.input Ramp.trigger NonStrictTest.input",
            "Ramp.output Expression.input",
            "Expression.output Stop.input",
        ),
        stop=1,
    ),
    "MergeWithoutDiscard": model(
        entity("Merge", f"{DE}Merge", discardEvents="false"),
        entity("CurrentMicrostep", "CurrentMicrostep"),
        entity("CurrentTime", "CurrentTime"),
        *(entity(f"SingleEvent{each}", f"{DE}SingleEvent", value=each or 1) for each in ("", 2, 3)),
        entity("Test", "Test", correctValues="{1, 2, 3}"),
        wires(
            "SingleEvent.output Merge.input",
            "SingleEvent2.output Merge.input",
            "SingleEvent3.output Merge.input",
            "Merge.output CurrentMicrostep.trigger CurrentTime.trigger",
            "CurrentMicrostep.output Test.input",
        ),
    ),
    "VariableDelay2": model(
        entity("Clock", "Clock", stopTime="3.0"),
        entity("Ramp", "Ramp"),
        entity("TimeDelay", "TimeDelay", delay="3.0"),
        entity("NonStrictTest", "NonStrictTest", correctValues="{0, 1, 2, 3}"),
        wires(
            "Clock.output Ramp.trigger",
            "Ramp.output TimeDelay.input TimeDelay.delay",
            "TimeDelay.output NonStrictTest.input",
        ),
    ),
    "ResettableTimer3": model(
        entity("Merge", f"{DE}Merge", discardEvents="true"),
        entity("SingleEvent", f"{DE}SingleEvent", value="0.0"),
        entity("ResettableTimer", "ResettableTimer", value="1.0"),
        entity("CurrentTime", "CurrentTime"),
        entity("NonStrictTest2", "NonStrictTest", correctValues="{0.0, 0.0, 1.0, 2.0, 3.0}"),
        wires(
            "ResettableTimer.output Merge.input",
            "SingleEvent.output Merge.input",
            "Merge.output ResettableTimer.input CurrentTime.trigger",
            "CurrentTime.output NonStrictTest2.input",
        ),
        stop=3,
    ),
    "TimeDelayMicrosteps2": model(
        entity("DiscreteClock", "DiscreteClock", offsets="{0.0, 0.0}", values="{1, 2}"),
        entity("TimeDelay", "TimeDelay", delay="0.0"),
        entity("CurrentMicrostep", "CurrentMicrostep"),
        entity("CurrentTime", "CurrentTime"),
        entity("Ramp", "Ramp"),
        entity("Sequence", "Sequence", values="{1.0, 0.0}", repeat="true"),
        entity("Const", "Const", value="true"),
        entity("NonStrictTest3", "NonStrictTest", correctValues="{1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11}"),
        wires(
            "DiscreteClock.output Ramp.trigger Const.trigger",
            "Ramp.output TimeDelay.input",
            "TimeDelay.output CurrentMicrostep.trigger CurrentTime.trigger NonStrictTest3.input",
            "Sequence.output TimeDelay.delay",
            "Const.output Sequence.enable",
        ),
        stop=5,
    ),
    "transferInputsandOutputs": model(
        composite(
            "CompositeActor",
            OUT,
            entity("SingleEvent", f"{DE}SingleEvent"),
            entity("Repeat", "Repeat"),
            wires("Repeat.output port", "SingleEvent.output Repeat.input"),
            director=True,
        ),
        composite(
            "CompositeActor2",
            OUT,
            IN,
            entity("Repeat", "Repeat"),
            wires("Repeat.output port", "port2 Repeat.input"),
            director=True,
        ),
        entity("CurrentMicrostep", "CurrentMicrostep"),
        entity("Test2", "Test", correctValues="{true, true, true, true}"),
        wires("CompositeActor.port CompositeActor2.port2", "CompositeActor2.port Test2.input CurrentMicrostep.trigger"),
        stop="Infinity",
    ),
    "ServerWithVariableDelay3": model(
        entity("Server", f"{DE}Server", serviceTime="1.0"),
        entity("Clock", "Clock"),
        entity("Clock2", "Clock", period="2.0", values="{1.5, 0.0}"),
        entity("CurrentTime", "CurrentTime"),
        wires("Clock.output Server.input", "Server.output CurrentTime.trigger", "Clock2.output Server.serviceTime"),
    ),
    "QueueAndServer": model(
        entity("Queue", f"{DE}Queue", capacity=0),
        entity("PoissonClock", "PoissonClock", fireAtStart="true"),
        entity("Ramp", "Ramp"),
        entity("PoissonClock2", "PoissonClock", fireAtStart="false"),
        entity("ColtExponential", f"{LIB}colt.ColtExponential", seed="1L", resetOnEachRun="true"),
        entity("Server", f"{DE}Server", serviceTime="2.3691327454755"),
        entity("NonStrictTest", "NonStrictTest", correctValues=values(*range(33))),
        wires(
            "Ramp.output Queue.input ColtExponential.trigger Server.input",
            "PoissonClock2.output Queue.trigger",
            "PoissonClock.output Ramp.trigger",
            "ColtExponential.output Server.serviceTime",
            "Server.output NonStrictTest.input",
        ),
        stop=50,
        name="QueueAndServer",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_sends(tmp_path: Path, case: str) -> None:
    """The checks in the model hold, too: a Test that fails ends the run."""
    found = [(time, microstep, own_name(port), *rest) for time, microstep, port, *rest in sent(tmp_path, CASES[case])]
    expected = recorded(case)
    assert [send[1:4] for send in found] == [send[1:4] for send in expected]
    for ours, theirs in zip(found, expected, strict=True):
        assert abs(ours[0] - theirs[0]) <= RESOLUTION
        assert ours[4] == pytest.approx(own_token(theirs[4]), abs=1e-9)
