"""One budget for a whole import: whatever a file computes, copies or joins, it ends soon, and says why."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from epicycle.ptolemy.importing import MomlError, import_moml
from epicycle.runner.model.build.load import load_model
from tests.ptolemy.importing.moml_parts import (
    COMPOSITE,
    LIB,
    TEXT,
    composite,
    entity,
    imported,
    model,
    port,
    prop,
    wires,
)
from tests.ptolemy.importing.test_modes import modal, state

SPENT = "m.xml cannot be imported: it takes more than 1,000,000 steps"
RELATION = '<relation name="r{0}" class="ptolemy.actor.TypedIORelation">{1}</relation>\n'
ALL = "[0:1:9999].matrixToArray()"


def computed(text: str, **parameters: str) -> str:
    """An expression over an input and parameters."""
    return model(
        entity("Clock", "DiscreteClock"),
        entity("E", "Expression", port("x", "input"), expression=f"x + {text}"),
        entity("Recorder", "Recorder"),
        wires("Clock.output E.x", "E.output Recorder.input"),
        **parameters,
    )


def refused(reason: str) -> str:
    return f"m.xml cannot be imported:\n   - E: expression: {reason}"


def doubled(first: str, again: str, number: int = 40) -> dict[str, str]:
    """Parameters of which each is made of the one before: ``P``."""
    return {"a0": first, **{f"a{each}": again.replace("P", f"a{each - 1}") for each in range(1, number + 1)}}


def copies() -> str:
    inside = "".join(prop(f"p{each}", each) for each in range(500))
    large = f'<class name="K" extends="{COMPOSITE}">{inside}</class>'
    return model(large, *(f'<entity name="e{each}" class="K"/>' for each in range(500)))


def sorts() -> str:
    """Each parameter sorts the large array 40 times."""
    sums = {f"p{each}": " + ".join([f"sort(b)({each})"] * 40) for each in range(40)}
    return computed(" + ".join(sums), b=ALL, **sums)


def wide() -> str:
    width = prop("width", 1_000)
    nets = (RELATION.format(each, width) for each in range(200))
    links = (f'<link port="a{end}.plus" relation="r{each}"/>' for end in range(30) for each in range(200))
    return model(*nets, *(entity(f"a{end}", "AddSubtract") for end in range(30)), *links)


TOO_MUCH = {"sorts": sorts, "copies": copies, "wide": wide}
INTEGER = "a whole number must be at least -2^63 and less than 2^63"
LONG_TEXT = "a text of more than 10,000 characters is too long"
LIST = "a list of more than 100,000 elements is too long"
TOO_LARGE = {
    "integers": (
        lambda: computed("a40", **doubled("3", "P * P")),
        f"it cannot be evaluated: the result of a * b is too large, with a = {3**32}, b = {3**32}",
    ),
    "digits": (lambda: computed("7" * 4_000), INTEGER),
    "parsed": (
        lambda: computed(f"parseInt('{'9' * 30}')"),
        f"it cannot be evaluated: the result of int(a) is too large, with a = '{'9' * 30}'",
    ),
    "repeated": (
        lambda: computed("length(a8)", **doubled("{1}", "repeat(1000, P)")),
        f"it cannot be evaluated: [b] * a: {LIST}, with a = 1000, b = [{'[1], ' * 7}[1],",
    ),
    "arrays": (lambda: computed("length(a40)", **doubled("{1}", "{P, P}")), LIST),
    "texts": (
        lambda: computed("length(a40)", **doubled("'aaaaaaaaaa'", "P + P")),
        f"it cannot be evaluated: a + b: {LONG_TEXT}, with a = '{'a' * 39}, b = '{'a' * 39}",
    ),
    "remainders": (lambda: computed(" % ".join(["x"] * 40)), "it has more than the maximum of 500 parts"),
}
LARGE = {
    "properties": lambda: model(*(prop(f"p{each}", f"q{each}") for each in range(8_000))),
    "tests": lambda: model(
        entity("Clock", "DiscreteClock"),
        *(entity(f"t{each}", "Test", correctValues="{1}", trainingMode="false") for each in range(2_000)),
        wires("Clock.output " + " ".join(f"t{each}.input" for each in range(2_000))),
    ),
    "joined": lambda: model(
        *(RELATION.format(each, "") for each in range(8_000)),
        *(f'<link relation1="r{each}" relation2="r{each + 1}"/>' for each in range(7_999)),
    ),
    "names": lambda: model(*(entity(f"a{'-' * (each % 90)}{'!' * (each // 90)}", "Const") for each in range(3_000))),
}


def refusal(tmp_path: Path, text: str) -> str:
    file = tmp_path / "m.xml"
    file.write_text(text, encoding="utf-8")
    began = time.process_time()
    with pytest.raises(MomlError) as caught:
        import_moml(file, load_model)
    assert time.process_time() - began < 15
    return str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    "make",
    [pytest.param(make, id=name) for name, make in TOO_MUCH.items()],
)
def test_too_much_for_one_import(tmp_path: Path, make: Callable[[], str]) -> None:
    assert refusal(tmp_path, make()) == SPENT


@pytest.mark.slow
@pytest.mark.parametrize(("make", "reason"), [pytest.param(*each, id=name) for name, each in TOO_LARGE.items()])
def test_values_that_are_too_large(tmp_path: Path, make: Callable[[], str], reason: str) -> None:
    assert refusal(tmp_path, make()) == refused(reason)


@pytest.mark.slow
@pytest.mark.parametrize("make", [pytest.param(make, id=name) for name, make in LARGE.items()])
def test_large_files_take_time_in_proportion(tmp_path: Path, make: Callable[[], str]) -> None:
    began = time.process_time()
    imported(tmp_path, make())
    assert time.process_time() - began < 10


def test_variables_of_a_composite_that_comes_later(tmp_path: Path) -> None:
    """An expression is converted though a variable belongs to a composite that has not been reached yet."""
    setter = entity("Set", f"{LIB}SetVariable", prop("variableName", "p", TEXT))
    late = composite("Late", port("in", "input"), prop("p", 1), setter, wires("in Set.input"))
    early = composite(
        "Early",
        port("in", "input"),
        prop("q", 1),
        entity("Set", f"{LIB}SetVariable", prop("variableName", "q", TEXT)),
        entity("E", "Expression", port("x", "input"), expression="x + q"),
        wires("in Set.input E.x"),
    )
    clock = entity("Clock", "DiscreteClock")
    text = imported(tmp_path, model(clock, early, late, wires("Clock.output Early.in Late.in"))).text
    assert "p_variable" in text
    assert "q_variable" in text


def test_a_state_machine_holds_no_variable(tmp_path: Path) -> None:
    refinement = composite("one", port("out", "output"), entity("C", "Const", value="p"), wires("C.output out"))
    said = prop("p", 1, "ptolemy.actor.parameters.PortParameter")
    machine = modal(state("one", "one", isInitialState="true"), said, refinement)
    text = model(entity("Clock", "DiscreteClock"), machine, wires("Clock.output M.p"))
    assert refusal(tmp_path, text) == (
        "m.xml cannot be imported:\n   - M.p changes during the run, and a state machine cannot hold it"
    )
