"""MoML: files of Ptolemy II with accidents, and with what is computed, copied or joined without end."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.fuzz.surfaces.case import Case, Surface, chosen, spoiled, write
from tests.fuzz.surfaces.expressions import PIECES, grown
from tests.ptolemy.importing.moml_parts import COMPOSITE, LIB, TEXT, composite, entity, model, port, prop, wires

JAVA = (
    "DiscreteClock", "Expression", "Scale", "Ramp", "Test", "AddSubtract", "Const", "Publisher", "Subscriber",
    "SubscriptionAggregator", f"{LIB}SetVariable", f"{LIB}hoc.MultiInstanceComposite", f"{LIB}hoc.Case", COMPOSITE,
    "ptolemy.domains.modal.kernel.FSMActor", "ptolemy.domains.modal.modal.ModalModel", "SequencePlotter", "Unknown",
    "ptolemy.actor.lib.gui.Display", "ptolemy.domains.de.lib.Server", "RecordAssembler", "MathFunction", "Quantizer",
)  # fmt: skip
NAMES = ("n", "value", "factor", "expression", "correctValues", "nInstances", "channel", "variableName", "period",
         "values", "stopTime", "width", "control", "delay", "seed", "initialValue")  # fmt: skip
OF_PTOLEMY = (
    "repeat(9000, {P, P})", "P * P", "P + P", "map(function(i) P, repeat(9000, 1))", "iterate(function(i) P, 9000, 1)",
    "function(i) P", "P(0)", "sort(P)", "[0:1:9999]", "fold(function(a, b) a * b, 1, P)", "{a = P, b = P}", "eval('P')",
    "0xfffffffffffffffffffff", "P % P % P", "'$P$P$P'", "P.replace('', P)", "2 ^ P", "1 << P", "parseInt('9', P)",
    "[P, P; P, P] * [P, P; P, P]", "identityMatrixInt(P)", "cast({double}, P)", "P ? P : P", "P.length()",
)  # fmt: skip


def expression(random: np.random.Generator) -> str:
    """Of Ptolemy's language, over parameters p0 to p5, which may hold each other."""
    if random.random() < 0.2:
        return grown(random)
    text = str(chosen(random, OF_PTOLEMY))
    return "".join(f"p{int(random.integers(6))}" if each == "P" else each for each in text)


def _said(random: np.random.Generator) -> str:
    java = {"java": TEXT} if random.random() < 0.2 else {}
    value = expression(random) if random.random() < 0.7 else chosen(random, PIECES)
    return prop(chosen(random, NAMES), value, **java)


def _part(random: np.random.Generator, number: int, depth: int = 0) -> str:
    inner = [_said(random) for _ in range(int(random.integers(3)))]
    inner += [port(each, chosen(random, ("input", "output")), "multiport") for each in ("in", "out")]
    if depth < 3 and random.random() < 0.3:
        inner += [_part(random, each, depth + 1) for each in range(int(random.integers(4)))]
    return entity(f"a{number}", str(chosen(random, JAVA)), *inner)


def _made(random: np.random.Generator) -> str:
    count = int(chosen(random, (2, 4, 8, 300)))
    values = {f"p{each}": expression(random) for each in range(6)}
    parts = [_part(random, each) for each in range(count)]
    if random.random() < 0.3:
        inside = "".join(_said(random) for _ in range(int(chosen(random, (1, 300)))))
        copies = "".join(f'<entity name="k{each}" class="K"/>' for each in range(int(chosen(random, (2, 2_000)))))
        parts.append(f'<class name="K" extends="{COMPOSITE}">{inside}</class>{copies}')
    ends = ("output", "input", "in", "out", "trigger", "plus", "control")
    nets = [
        " ".join(f"a{int(random.integers(count))}.{chosen(random, ends)}" for _ in range(int(random.integers(1, 5))))
        for _ in range(count)
    ]
    return model(*parts, wires(*nets), stop=expression(random), **values)


def _good() -> str:
    inner = composite("C", port("in", "input"), entity("Scale", "Scale", factor="n"), wires("in Scale.input"))
    clock = entity("Clock", "DiscreteClock", values="{1, 2, n}")
    said = entity("E", "Expression", port("x", "input"), expression="x ^ 2 > n ? x : -x")
    nets = wires("Clock.output E.x C.in", "E.output Test.input")
    return model(prop("n", 3), clock, said, inner, entity("Test", "Test", correctValues="{1, -2}"), nets)


def _prepare(home: Path) -> None:
    write(home, "good.xml", _good())


def _make(random: np.random.Generator, home: Path, folder: Path) -> Case:
    file = folder / "m.xml"
    if random.random() < 0.5:
        write(folder, file.name, _made(random))
    else:
        file.write_bytes(spoiled((home / "good.xml").read_bytes(), random))
    return Case(("import", file, "-o", folder / "m.yaml"))


SURFACE = Surface("MoML", _prepare, _make)
