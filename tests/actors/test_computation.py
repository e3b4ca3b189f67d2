"""Actors that compute, against NumPy, the statistics module and plain arithmetic."""

from __future__ import annotations

import itertools
import math
import operator
import re
from importlib import metadata
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.actors import EpicycleError, Function, ParameterError
from epicycle.actors.expression import Formula, operand
from epicycle.runner.execution.engine import ActorError, Simulation
from epicycle.runner.model.text.problems import ModelError
from tests.actors.feeding import feed, load, model_of, seconds, tokens

# -- Expression -----------------------------------------------------------------------------------------------------


def test_names_of_an_expression_are_its_ports_and_hold_their_tokens() -> None:
    it, sent, _ = feed(
        {"type": "Expression", "expression": "b - 10 * a + time"},
        {"a": [(1.0, 1), (3.0, 2)], "b": [(2.0, 5), (3.0, 6)]},
    )
    assert list(it.inputs) == ["b", "a"]
    # At 1 s b is not there yet, at 2 s a holds, at 3 s both come at the same tag.
    assert sent["output"] == [(2.0, 5 - 10 + 2.0), (3.0, 6 - 20 + 3.0)]


def test_without_hold_all_inputs_are_needed_at_the_same_tag() -> None:
    _, sent, _ = feed(
        {"type": "Expression", "expression": "a + b", "hold": False},
        {"a": [(1.0, 1), (3.0, 2)], "b": [(2.0, 5), (3.0, 6)]},
    )
    assert sent["output"] == [(3.0, 8)]


def test_tokens_of_one_tag_are_taken_in_rounds() -> None:
    _, sent, _ = feed(
        {"type": "Expression", "expression": "10 * a + b"}, {"a": [(1.0, 1), (1.0, 2), (1.0, 3)], "b": [(1.0, 4)]}
    )
    assert sent["output"] == [(1.0, 14), (1.0, 24), (1.0, 34)]


@pytest.mark.parametrize(
    ("expression", "gives", "token", "value"),
    [
        ("x > 10", None, 11, True),
        ("not (x > 10)", None, 11, False),
        ("x > 1 and x < 5", None, 3, True),
        ("x if x > 0 else -x", None, -3, 3),
        ("x['position'][1]", None, {"position": [1.0, 2.0]}, 2.0),
        ("sum(x) / len(x)", None, [1, 2, 6], 3.0),
        ("'n' + str(x)", "text", 3, "n3"),
        ("[x, 2 * x]", "any value", 3, [3, 6]),
        ("hypot(x, 4) * pi / e", None, 3, 5 * math.pi / math.e),
    ],
)
def test_expressions(expression: str, gives: str | None, token: Any, value: Any) -> None:
    _, sent, _ = feed({"type": "Expression", "expression": expression, "gives": gives}, {"x": [(1.0, token)]})
    assert tokens(sent) == [value]
    assert type(tokens(sent)[0]) is type(value)


def test_an_expression_without_names_has_nothing_to_wait_for() -> None:
    model = model_of({"type": "Expression", "expression": 7}, {})
    assert Formula("7").names == ()
    assert model.graph.actors["it"].inputs == {}
    assert [each.message for each in model.warnings] == ["it can never fire: it is not a source, and nothing feeds it"]


@pytest.mark.parametrize(
    ("expression", "token", "message"),
    [
        ("1 / x", 0, "it failed in fire() at (1 s, 1): '1 / x': 1 / x divides by zero, with x = 0"),
        (
            "[x]",
            1,
            "it failed in fire() at (1 s, 1): '[x]' gives [1], which is not a number; set 'gives: any value'",
        ),
        (
            "x",
            True,
            "it failed in fire() at (1 s, 1): 'x' gives True, which is not a number; set 'gives: truth value'",
        ),
        (
            "sqrt(x)",
            -1,
            "it failed in fire() at (1 s, 1): 'sqrt(x)': sqrt(x): sqrt is not defined for -1, with x = -1",
        ),
    ],
)
def test_an_expression_that_fails_tells_its_values(expression: str, token: Any, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        feed({"type": "Expression", "expression": expression}, {"x": [(1.0, token)]})
    assert str(caught.value).partition("\n")[0] == message


@pytest.mark.parametrize("number", [0.0, np.float64(0.0), np.array(0.0)])
def test_a_number_of_numpy_divides_as_any_other(number: Any) -> None:
    assert operand(number) == 0.0
    with pytest.raises(EpicycleError) as caught:
        Formula("1.0 / x")({"x": operand(number)})
    assert str(caught.value) == "'1.0 / x': 1.0 / x divides by zero, with x = 0.0"


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("x +", "it.expression: 'x +' is not an expression: invalid syntax"),
        ("open('x')", None),
        ("x.real", None),
        ("max + x", "it.expression: 'max + x' is not an expression: 'max' is a function: write max(...)"),
        ([1], "it.expression: [1] is not an expression"),
        ("output + 1", "it: there would be two ports named 'output'"),
    ],
)
def test_a_bad_expression_is_refused_at_load(expression: Any, message: str | None) -> None:
    with pytest.raises(ModelError) as caught:
        model_of({"type": "Expression", "expression": expression}, {})
    assert len(caught.value.problems) == 1
    if message is not None:
        assert caught.value.problems[0].message == message


def test_a_wrong_port_of_an_expression_is_told_with_the_right_ones() -> None:
    with pytest.raises(ModelError) as caught:
        load(
            "model: m\n"
            "actors:\n"
            "  clock: {type: Clock, period: 1 s}\n"
            "  area: {type: Expression, expression: width * height}\n"
            "connections:\n"
            "  - clock.output -> area.widht\n"
        )
    first = caught.value.problems[0]
    assert first.message == "area: Expression has no input port 'widht', did you mean 'width'?"
    assert first.help == ("valid input ports: width, height",)


@pytest.mark.parametrize(("kind", "told"), [("Sum", "Accumulator, AddSubtract"), ("Delay", "Link, TimeDelay")])
def test_types_are_found_by_what_they_do(kind: str, told: str) -> None:
    with pytest.raises(ModelError) as caught:
        load(f"model: m\nactors:\n  one: {{type: {kind}}}\n")
    assert caught.value.problems[0].help == (
        "valid types: those that 'epicycle list actors' lists",
        f"types about '{kind.lower()}': {told}",
        "for your own types, add '--types FILE.py'; in Python, pass the classes as types=[...]",
    )


def test_a_port_unlike_all_others_of_an_expression() -> None:
    with pytest.raises(ModelError) as caught:
        load(
            "model: m\n"
            "actors:\n"
            "  clock: {type: Clock, period: 1 s}\n"
            "  two: {type: Expression, expression: 1 + 1}\n"
            "connections:\n"
            "  - clock.output -> two.trigger\n"
        )
    (only,) = caught.value.problems
    assert only.message == "two: Expression has no input port 'trigger'"
    assert only.help == (
        "valid input ports: none",
        "its parameters determine further ports; 'epicycle describe Expression' says how",
    )


def test_instances_may_differ_in_their_ports() -> None:
    text = (
        "model: m\n"
        "actors:\n"
        "  clock: {type: Clock, period: 1 s}\n"
        "  each: {type: Expression, count: 2, expression: \"${['x', 'y'][index]} + 1\"}\n"
        "connections:\n"
    )
    load(text + "  - clock.output -> each[0].x, each[1].y\n")
    with pytest.raises(ModelError) as caught:
        load(text + "  - clock.output -> each[*].x\n")
    assert [problem.message for problem in caught.value.problems] == [
        "Expression has no input port each[1].x, unlike others in its array"
    ]


def test_an_expression_that_cannot_be_made_makes_no_problems_downstream() -> None:
    with pytest.raises(ModelError) as caught:
        load(
            "model: m\n"
            "actors:\n"
            "  clock: {type: Clock, period: 1 s}\n"
            "  bad: {type: Expression, expression: x +}\n"
            "  sink: {type: Recorder}\n"
            "connections:\n"
            "  - clock.output -> bad.x\n"
            "  - bad.output -> sink.input\n"
            "run: {record: bad.output}\n"
        )
    assert [problem.message for problem in caught.value.problems] == [
        "bad.expression: 'x +' is not an expression: invalid syntax"
    ]


# -- Function -------------------------------------------------------------------------------------------------------


def magnitude(x: float, y: float, scale: float = 1.0) -> float:
    return scale * math.hypot(x, y)


def only_even(n, /):  # type: ignore[no-untyped-def]
    return n if n % 2 == 0 else None


def any_number(*values: float) -> float:
    return sum(values)


def test_parameters_of_a_function_are_its_ports() -> None:
    knowing = Function.knowing(magnitude, only_even)
    it, sent, _ = feed(
        {"type": "Function", "function": "magnitude"}, {"x": [(1.0, 3.0)], "y": [(2.0, 4.0)]}, types=[knowing]
    )
    assert sent["output"] == [(2.0, 5.0)]
    assert {name: (port.type, port.required) for name, port in it.inputs.items()} == {
        "x": (float, True),
        "y": (float, True),
        "scale": (float, False),
    }
    assert it.outputs["output"].type is float
    _, sent, _ = feed({"type": "Function", "function": "only_even"}, {"n": seconds(1, 2, 3, 4)}, types=[knowing])
    assert sent["output"] == [(2.0, 2), (4.0, 4)]


def test_a_model_calls_only_functions_that_are_offered(monkeypatch: pytest.MonkeyPatch) -> None:
    point = metadata.EntryPoint("hypotenuse", "math:dist", "epicycle.functions")
    monkeypatch.setattr(
        "epicycle.actors.functions.entry_points",
        lambda group: metadata.EntryPoints([point] if group == "epicycle.functions" else []),
    )
    for name in ("hypotenuse", "math:dist"):
        _, sent, _ = feed({"type": "Function", "function": name}, {"p": [(1.0, [0, 0])], "q": [(1.0, [3, 4])]})
        assert tokens(sent) == [5.0]
    with pytest.raises(ModelError) as caught:
        model_of({"type": "Function", "function": "os:system"}, {}, [Function.knowing(magnitude)])
    (problem,) = caught.value.problems
    known = ", ".join(sorted(["hypotenuse", "magnitude", f"{__name__}:magnitude"]))
    assert problem.message == (
        "it.function: 'os:system' is not a function that models may call; they may call: "
        f"{known}; packages offer functions as entry points of the group "
        "'epicycle.functions', Python programs with load_model(types=[Function.knowing(f)])"
    )
    with pytest.raises(ModelError) as caught:
        model_of({"type": "Function", "function": "any_number"}, {}, [Function.knowing(any_number)])
    assert caught.value.problems[0].message == (
        "it: function: any_number takes any number of arguments (values), so its ports are unknown"
    )


def test_a_function_from_python_needs_no_name() -> None:
    assert Function("f", function=math.sqrt).function is math.sqrt
    with pytest.raises(ParameterError, match="'math:sqrt' is not a function that models may call"):
        Function("f", function="math:sqrt")


# -- arithmetic and logic -------------------------------------------------------------------------------------------

NUMBERS = st.lists(st.integers(-50, 50), min_size=1, max_size=6)


@settings(max_examples=25, deadline=None)
@given(plus=st.lists(NUMBERS, min_size=1, max_size=3), minus=st.lists(NUMBERS, min_size=1, max_size=3))
def test_add_subtract_works_in_rounds(plus: list[list[int]], minus: list[list[int]]) -> None:
    _, sent, _ = feed(
        {"type": "AddSubtract"},
        {
            "plus": [[(1.0, value) for value in each] for each in plus],
            "minus": [[(1.0, value) for value in each] for each in minus],
        },
    )
    sums = [
        sum(value or 0 for value in added) - sum(value or 0 for value in taken)
        for added, taken in itertools.zip_longest(
            itertools.zip_longest(*plus), itertools.zip_longest(*minus), fillvalue=()
        )
    ]
    assert tokens(sent) == sums


def test_multiply_divide_and_scale() -> None:
    inputs = {"multiply": [seconds(3, 5), seconds(2, 1)], "divide": seconds(4)}
    _, sent, _ = feed({"type": "MultiplyDivide"}, inputs)
    assert tokens(sent) == [1.5, 5]
    with pytest.raises(ActorError, match=r"it failed in fire\(\) at \(1 s, 1\): 3 cannot be divided by 0"):
        feed({"type": "MultiplyDivide"}, {"multiply": seconds(3), "divide": seconds(0)})
    _, sent, _ = feed({"type": "Scale", "factor": 2, "offset": 1}, {"input": seconds(1, 2, 3), "factor": [(3.0, -1.5)]})
    assert tokens(sent) == [3, 5, -3.5]


@pytest.mark.parametrize(
    ("function", "oracle"),
    [
        ("abs", np.abs), ("negate", np.negative), ("sign", np.sign), ("square", np.square), ("sqrt", np.sqrt),
        ("exp", np.exp), ("log", np.log), ("log10", np.log10), ("sin", np.sin), ("cos", np.cos), ("tan", np.tan),
        ("asin", np.arcsin), ("acos", np.arccos), ("atan", np.arctan), ("floor", np.floor), ("ceil", np.ceil),
        ("round", np.round),
    ],
)  # fmt: skip
def test_math_functions(function: str, oracle: Any) -> None:
    arguments = [-2.5, -1.0, -0.5, 0.0, 0.25, 0.5, 1.0, 2.5, 1e300]
    with np.errstate(all="ignore"):
        expected = [float(oracle(each)) for each in arguments]
    for argument, value in zip(arguments, expected, strict=True):
        actor = {"type": "MathFunction", "function": function}
        if math.isfinite(value):
            _, sent, _ = feed(actor, {"input": [(1.0, argument)]})
            assert tokens(sent) == [pytest.approx(value, rel=1e-14)]
        else:
            with pytest.raises(ActorError, match=re.escape(f"{function} of {argument!r} is not a real number")):
                feed(actor, {"input": [(1.0, argument)]})


@pytest.mark.parametrize(
    ("actor", "inputs", "reason"),
    [
        ({"type": "Comparator", "comparison": "<"}, {"left": [(1.0, "a")]}, "'a' and 0 cannot be compared by <"),
        ({"type": "Comparator", "comparison": "==", "value": "a", "tolerance": 1}, {"left": [(1.0, "a")]},
         "'a' and 'a' cannot be compared by ==, with a tolerance"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared(actor: dict[str, Any], inputs: dict[str, Any], reason: str) -> None:
    with pytest.raises(ActorError) as caught:
        feed(actor, inputs)
    assert caught.value.reason == reason


@pytest.mark.parametrize(
    ("actor", "reason"),
    [
        ("MathFunction, function: sign", "sign of nan is not a real number, or is too large"),
        ("Extreme, take: least", "nan is neither greater nor less than a number"),
        ("Timer", "it.input is nan s, but a timer needs a time >= 0"),
        ("ResettableTimer", "it.input is nan s, which is neither a time nor negative"),
    ],
)
def test_nan_has_no_order(actor: str, reason: str) -> None:
    text = f"""
model: m
actors:
  clock: {{type: Clock, period: 1 s, values: [1.0, .nan]}}
  it: {{type: {actor}}}
connections: [clock.output -> it.input]
run: {{stop: 1 s}}
"""
    with pytest.raises(ActorError) as caught:
        Simulation(load(text)).run()
    assert (caught.value.reason, caught.value.tag.time) == (reason, 10**9)


GATES = {
    "and": all,
    "or": any,
    "xor": lambda bits: bool(np.logical_xor.reduce(bits)),
    "nand": lambda bits: not all(bits),
    "nor": lambda bits: not any(bits),
    "xnor": lambda bits: not np.logical_xor.reduce(bits),
}


@pytest.mark.parametrize("function", GATES)
def test_truth_tables(function: str) -> None:
    table = list(itertools.product([False, True], repeat=3))
    channels = [seconds(*(row[channel] for row in table)) for channel in range(3)]
    _, sent, _ = feed({"type": "LogicGate", "function": function}, {"input": channels})
    assert tokens(sent) == [GATES[function](row) for row in table]


def test_gates_count_what_is_there_or_hold() -> None:
    channels = [[(1.0, True), (2.0, False)], [(1.0, True), (3.0, True)]]
    _, sent, _ = feed({"type": "LogicGate", "function": "and"}, {"input": channels})
    assert tokens(sent) == [True, False, True]
    _, sent, _ = feed({"type": "LogicGate", "function": "and", "hold": True}, {"input": channels})
    assert tokens(sent) == [True, False, False]
    _, sent, _ = feed({"type": "LogicGate", "function": "not"}, {"input": seconds(True, False)})
    assert tokens(sent) == [False, True]


SIGNS = {"==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


@pytest.mark.parametrize("comparison", SIGNS)
def test_comparisons(comparison: str) -> None:
    pairs = list(itertools.product([1, 2.0, 3], repeat=2))
    inputs = {"left": seconds(*(left for left, _ in pairs)), "right": seconds(*(right for _, right in pairs))}
    _, sent, _ = feed({"type": "Comparator", "comparison": comparison}, inputs)
    assert tokens(sent) == [SIGNS[comparison](*pair) for pair in pairs]
    _, sent, _ = feed({"type": "Comparator", "comparison": comparison, "value": 2}, {"left": inputs["left"]})
    assert tokens(sent) == [SIGNS[comparison](left, 2) for left, _ in pairs]
    about_2 = {"type": "Comparator", "comparison": comparison, "value": 2, "tolerance": 0.5}
    _, sent, _ = feed(about_2, {"left": seconds(1.5, 2.4, 2.6)})
    near = {"==": [True, True, False], "!=": [False, False, True], "<": [True, True, False],
            "<=": [True, True, False], ">": [False, True, True], ">=": [True, True, True]}  # fmt: skip
    assert tokens(sent) == near[comparison]
