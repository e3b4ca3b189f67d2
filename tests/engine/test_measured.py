"""Metrics of several ports, and metrics that are computed from others."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import OutputPort
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.execution.results import Results
from epicycle.runner.interface.cli import main
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.text.problems import ModelError
from tests.engine.engine_parts import load, simulate
from tests.engine.test_monitors import Steps


class Numbers(Steps):
    """Sends whole numbers."""

    output = OutputPort(int)


def model(metrics: str, more: str = "") -> Model:
    """Three drones that send 1, 2 and 3 at first, and then 10, 20 and 30."""
    return load(
        f"""
actors:
  drone: {{type: Numbers, count: 3, values: "${{[[0, index + 1], [1, 10 * (index + 1)]]}}"}}
  silent: {{type: Numbers, values: []}}
run: {{stop: 5 s}}
metrics:
  {metrics}
{more}
""",
        types=[Numbers],
    )


def run(metrics: str, more: str = "") -> Results:
    return Simulation(model(metrics, more)).run()


@pytest.mark.parametrize(
    ("metric", "value"),
    [
        ("{of: [drone[0].output, drone[2].output], take: max}", 30),
        ("{of: [drone[0].output, drone[*].output], take: count}", 6),  # each port once
        ("{of: [drone[2].output, drone[0].output], take: sum, across: mean}", 22.0),
        ("{of: drone[*].output, take: last, across: sum}", 60),
        ("{of: drone[*].output, take: last, across: min}", 10),
        ("{of: drone[*].output, take: last, across: max}", 30),
        ("{of: drone[*].output, take: mean, across: sum}", 33.0),
        ("{of: drone[*].output, take: last, across: mean, unit: m, to: cm}", 2000.0),
        ("{of: [drone[0].output, silent.output], take: count, across: sum}", 2),
    ],
)
def test_metrics_of_several_ports(metric: str, value: Any) -> None:
    found = run(f"it: {_quoted(metric)}").metrics["it"]
    assert (found, type(found)) == (value, type(value))


def _quoted(metric: str) -> str:
    for port in ("drone[0].output", "drone[2].output", "drone[*].output"):
        metric = metric.replace(port, f"'{port}'")
    return metric


def test_a_port_that_has_no_value_is_named() -> None:
    found = run("it: {of: [silent.output, 'drone[0].output'], take: last, across: sum}").outcomes["it"]
    assert found.missing == "of silent.output: no token came"


COMPUTED = """
  ratio: {from: delivered / sent, unit: "1", to: "%", doc: what arrives}
  twice: {from: 2 * ratio}
  sent: {of: 'drone[*].output', take: count}
  delivered: {of: 'drone[0].output', take: count}
  nothing: {of: silent.output, take: count}
  none: {of: silent.output}
  of_nothing: {from: sent / nothing}
  of_none: {from: sent + none}
  margin: {from: low_robustness + 1}
  good: {from: low and ratio > 30}
""".strip()


def test_metrics_computed_from_others() -> None:
    results = run(COMPUTED, "monitors:\n  low: always drone[2].output < 40")
    assert list(results.metrics) == [
        "ratio", "twice", "sent", "delivered", "nothing", "none", "of_nothing", "of_none", "margin", "good",
        "low", "low_robustness",
    ]  # fmt: skip
    assert results.metrics["ratio"] == pytest.approx(100 / 3)
    assert results.units["ratio"] == "%"
    assert results.metrics["twice"] == 2 * results.metrics["ratio"]
    assert results.outcomes["of_nothing"].missing == (
        "'sent / nothing': sent / nothing divides by zero, with sent = 6, nothing = 0"
    )
    assert results.outcomes["of_none"].missing == "none has no value: no token came"
    assert (results.metrics["margin"], results.metrics["good"]) == (11.0, True)


@pytest.mark.parametrize(
    ("metrics", "message"),
    [
        (
            "a: {from: snet / 2}\n  sent: {of: silent.output}",
            "metric a: there is no metric 'snet', did you mean 'sent'?",
        ),
        ("a: {from: a + 1}", "metric a: it is computed from itself: a <- a"),
        ("a: {from: b}\n  b: {from: a}", "metric a: it is computed from itself: a <- b <- a"),
        ("a: {from: 1 + 1}", "metric a: '1 + 1' names no metric"),
        ("a: {from: b +}", "metric a: "),
        ("a: {from: b, of: silent.output}\n  b: {of: silent.output}", "metric 'a': 'of' cannot be used with 'from'"),
        ("a: {from: b, take: mean}\n  b: {of: silent.output}", "metric 'a': 'take' cannot be used with 'from'"),
        ("a: {take: mean}", "metric 'a' has no port"),
        ("a: {of: []}", "metric 'a' has no port"),
        ("a: {of: silent.output, take: mean, across: sum, interval: 0.9}", "metric a: 'interval' cannot be used with"),
        ("a: {of: silent.output, across: product}", "metric a.across: 'product' is not one of"),
    ],
)
def test_metrics_that_are_wrong(metrics: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        model(metrics)
    assert [each.message[: len(message)] for each in caught.value.problems] == [message]


def test_many_metrics_in_a_row() -> None:
    rows = "\n  ".join(f"m{number}: {{from: m{number + 1} + 1}}" for number in range(2000))
    assert run(f"{rows}\n  m2000: {{of: 'drone[0].output'}}").metrics["m0"] == 2010


def test_metrics_of_a_model_built_in_python() -> None:
    built = Model("m", stop=5.0)
    for name in ("a", "b"):
        built.add(Numbers(name, values=[[0, 1], [1, 3]]))
    built.metric("total", of=["a.output", "b.output"], take="sum", across="sum")
    built.metric("half", formula="total / 2", unit="m", to="cm")
    assert Simulation(built).run().metrics == {"total": 8, "half": 400.0}
    with pytest.raises(ModelError, match="metric it: give either 'of' or 'formula'"):
        built.metric("it")
    with pytest.raises(ModelError, match="metric it: 'after' cannot be used with 'formula'"):
        built.metric("it", formula="total", after=3.0)
    with pytest.raises(ModelError, match="metric it: there is no metric 'totl', did you mean 'total'"):
        built.metric("it", formula="totl")


def test_studies_and_listings_have_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "m.yaml"
    file.write_text(
        "model: m\nactors: {a: {type: Clock, period: 1}, b: {type: Clock, period: 2}}\nrun: {stop: 10 s}\n"
        "metrics:\n  all: {of: [a.output, b.output], take: count, across: sum}\n"
        "  each: {of: b.output, take: count}\n  ratio: {from: each / all}\n",
        encoding="utf-8",
    )
    assert main(["describe", str(file), "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["metrics"]
    assert [each["takes"] for each in listed] == [
        "sum of the count of a.output, b.output",
        "count of b.output",
        "each / all",
    ]
    study = tmp_path / "s.yaml"
    study.write_text("study: s\nmodel: ./m.yaml\nreplications: 2\nmetrics: [ratio]\n", encoding="utf-8")
    assert main(["study", str(study), "--out", str(tmp_path / "out")]) == 0
    capsys.readouterr()
    from epicycle.runner.study.judge.study_results import StudyResults

    assert list(StudyResults(tmp_path / "out").to_pandas()["ratio"]) == [6 / 17] * 2


def test_a_ratio_is_given_in_percent() -> None:
    made = model(
        "first: {of: 'drone[0].output', take: last, to: '%'}\n"
        "  second: {of: 'drone[1].output', take: last}\n"
        "  ratio: {from: first / second, to: '%'}"
    )
    results = Simulation(made).run()
    assert results.metrics == {"first": 1000.0, "second": 20, "ratio": 5000.0}
    assert results.units == {"first": "%", "second": "", "ratio": "%"}


def test_a_formula_uses_parameters_in_their_si_units() -> None:
    text = (
        "parameters: {length: {value: 1, unit: h}, times: 3}\n"
        "actors: {t: {type: Ticker, period: 0.5}}\n"
        "run: {stop: 10 s}\n"
        "metrics:\n"
        "  ticks: {of: t.output, take: count}\n"
        "  share: {from: 'times * ticks / ${length}'}\n"
        "  twice: {from: 'ticks * ${times} > ${2 * times}'}\n"
    ).replace("times * ticks", "${times} * ticks")
    _, results = simulate(text)
    assert results.metrics == {"ticks": 21, "share": 3 * 21 / 3600, "twice": True}
