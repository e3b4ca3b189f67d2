"""Mutated files: whatever comes, it is imported or refused, soon and in words."""

from __future__ import annotations

import re
import time
from pathlib import Path

import numpy as np
import pytest

from epicycle.ptolemy.importing import MomlError, import_moml
from epicycle.runner.model.build.load import load_model
from tests.ptolemy.importing.moml_parts import DE, LIB, TEXT, composite, entity, model, port, prop, wires
from tests.ptolemy.importing.test_modes import around, machine, modal, state, transition

INNER = composite(
    "C",
    port("in", "input", "multiport"),
    port("out", "output"),
    prop("p", 1),
    entity("Scale", "Scale", factor="p"),
    wires("in Scale.input", "Scale.output out"),
    director=True,
)
MODELS = (
    model(
        prop("n", "{1, 2}"),
        entity("Clock", "DiscreteClock", values="n"),
        entity("Expression", "Expression", port("x", "input"), expression="x ^ 2 > 3 ? x : -x"),
        entity("Server", f"{DE}Server"),
        entity("Set", f"{LIB}SetVariable", prop("variableName", "n", TEXT)),
        entity("Test", "Test", correctValues="{1, 2}"),
        INNER,
        wires(
            "Clock.output Expression.x C.in",
            "Expression.output Server.input C.in",
            "Server.output Test.input",
            "C.out Test.input Set.input",
        ),
    ),
    around(
        machine(
            prop("count", 0),
            state("a", isInitialState="true"),
            state("b"),
            transition("t", "a", "b", "in_isPresent && in > 1", "out = in", "count = count + 1"),
            transition("u", "b", "a", "timeout(1)"),
        )
    ),
    around(
        modal(
            state("one", "one", isInitialState="true")
            + state("two")
            + transition("t1", "one", "two", "in == 2", history="true"),
            composite(
                "one",
                port("in", "input"),
                port("out", "output"),
                entity("Ramp", "Ramp"),
                wires("in Ramp.trigger", "Ramp.output out"),
            ),
        )
    ),
)
PIECES = (
    "",
    "&amp;",
    "{",
    "}",
    "(",
    "-1",
    "1e400",
    "NaN",
    "true",
    "&quot;a&quot;",
    "{1, {2}}",
    "{a=1}",
    "$x",
    "x.y",
    "1/0",
    "9^9^9^9^9",
    "in",
    "..",
    "[1;2]",
    "repeat(99999999, 1)",
    f"{LIB}Expression",
    "ptolemy.actor.TypedCompositeActor",
    "99999999999999999999",
    "PI",
    "a b",
    "nil",
)


def mutated(text: str, random: np.random.Generator) -> str:
    for _ in range(int(random.integers(1, 6))):
        lines = text.splitlines()
        quoted = list(re.finditer(r'"[^"]*"', text))
        kind = int(random.integers(4))
        if kind == 0 and quoted:
            match = quoted[int(random.integers(len(quoted)))]
            text = f'{text[: match.start()]}"{PIECES[int(random.integers(len(PIECES)))]}"{text[match.end() :]}'
        elif kind == 1 and quoted:
            one, other = (quoted[int(random.integers(len(quoted)))] for _ in range(2))
            text = text[: one.start()] + other[0] + text[one.end() :]
        elif kind == 2 and len(lines) > 6:
            del lines[int(random.integers(4, len(lines) - 1))]
            text = "\n".join(lines)
        elif len(lines) > 6:
            lines.insert(int(random.integers(4, len(lines))), lines[int(random.integers(4, len(lines)))])
            text = "\n".join(lines)
    return text


@pytest.mark.parametrize("seed", range(6))
def test_whatever_comes(tmp_path: Path, seed: int) -> None:
    random, file, outcomes = np.random.default_rng(seed), tmp_path / "m.xml", set()
    for _ in range(40):
        file.write_text(mutated(MODELS[int(random.integers(len(MODELS)))], random), encoding="utf-8")
        began = time.monotonic()
        try:
            import_moml(file, load_model)
            outcomes.add("imported")
        except MomlError:
            outcomes.add("refused")
        assert time.monotonic() - began < 20
    assert outcomes == {"imported", "refused"}
