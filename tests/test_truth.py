"""The truth board: its models load, its queues have the values of theory, and a small part is run."""

from __future__ import annotations

from math import factorial, prod
from pathlib import Path

import pytest

import epicycle
from benchmarks.truth import board
from epicycle.runner import Simulation

FILES = sorted(path for name in board.SOURCES for path in (board.HERE / name).glob("*.yaml"))
STUDIES = sorted(path for name in board.SOURCES for path in (board.HERE / name / "studies").glob("*.yaml"))


def erlang_b(load: float, servers: int) -> float:
    """The share of calls that find all lines busy."""
    terms = [load**n / factorial(n) for n in range(servers + 1)]
    return terms[-1] / sum(terms)


def erlang_c(load: float, servers: int) -> float:
    """The share of calls that have to wait."""
    blocked = erlang_b(load, servers)
    return servers * blocked / (servers - load * (1 - blocked))


def number(load: float, servers: int = 1) -> float:
    """The mean number in M/M/c."""
    return load + erlang_c(load, servers) * load / (servers - load)


def expected() -> dict[str, dict[str, list[float]]]:
    """The values by study and metric, in the order of the conditions."""
    lines_b, lines_c = [(2, 3), (5, 7), (9, 10)], [(2, 3), (4, 6), (7, 10)]
    blocked = [erlang_b(*each) for each in lines_b]
    networks = [(2.0 * share, 1.2 * share, 1.04 * share) for share in (1.0, 0.5)]
    closed = []
    for customers in (2, 5):
        weights = [prod([1.0] * first + [0.5] * (customers - first)) for first in range(customers + 1)]
        idle = weights[0] / sum(weights)
        closed.append((1 - idle, sum(n * weight for n, weight in enumerate(weights)) / sum(weights)))
    waits = [0.75 / 0.25 * (1 + variation) / 2 for variation in (0.25, 1, 4)]
    return {
        "erlang_b": {
            "blocked": blocked,
            "busy": [load * (1 - b) for (load, _), b in zip(lines_b, blocked, strict=True)],
        },
        "erlang_c": {
            "stay": [number(*each) / each[0] for each in lines_c],
            "delayed": [erlang_c(*each) for each in lines_c],
        },
        "mg1": {"mean_wait": waits, "mean_number": [0.75 * (wait + 1) for wait in waits]},
        "jackson": {
            "first": [number(0.3 * each[0]) for each in networks],
            "second": [number(each[1], 2) for each in networks],
            "third": [number(0.5 * each[2]) for each in networks],
        },
        "closed": {"throughput": [each[0] for each in closed], "first": [each[1] for each in closed]},
        "priority": {
            "first": [2 * load / (1 - load) for load in (0.3, 0.4)],
            "second": [2 * load / (1 - load) / (1 - 2 * load) for load in (0.3, 0.4)],
        },
        "retrial": {"orbit": [0.5 * (0.5 + 0.5 / pause) / (0.5 / pause) for pause in (1, 5)], "busy": [0.5, 0.5]},
    }


def test_the_published_values_of_queues_are_those_of_theory() -> None:
    cases = {case["study"]: case["published"] for case in board.source("queues")["cases"]}
    assert cases.keys() == expected().keys()
    for name, metrics in expected().items():
        for metric, values in metrics.items():
            assert cases[name][metric] == pytest.approx(values, rel=1e-9), (name, metric)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_models_load(path: Path) -> None:
    model = epicycle.load(path)
    assert model.name == path.stem
    assert model.doc


def test_what_programs_about_time_assert_holds() -> None:
    lines = board.lines_of("superdense")
    assert len(lines) == 20
    assert [line.case for line in lines if not line.is_met] == []


def test_an_assertion_that_does_not_hold_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = tmp_path / "superdense"
    folder.mkdir()
    text = (board.HERE / "superdense" / "timers.yaml").read_text(encoding="utf-8")
    (folder / "timers.yaml").write_text(text.replace("2 s to 2 s counter.count == 1", "2 s to 2 s counter.count == 2"))
    monkeypatch.setattr(board, "HERE", tmp_path)
    monkeypatch.setattr(board, "ROOT", tmp_path)
    (line,) = board._of_check("superdense", {"check": "timers", "published": "it"}, None)
    assert (line.ours, line.is_met) == ("end broken", False)


@pytest.mark.slow
@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_studies_run(path: Path, tmp_path: Path) -> None:
    results = epicycle.study(path, replications=2, out=tmp_path / "out", jobs=1, show_progress=False)
    assert not results.failures()
    case = next(
        each for name in board.SOURCES for each in board.source(name)["cases"] if each.get("study") == path.stem
    )
    assert {*case["published"]} == {*results.factors, *results.metrics} - {"replication"}


def test_a_line_says_what_is_met() -> None:
    """Of a value inside and one outside of an interval."""
    lines = [
        board.Line("m c=1", "share", "0.5", "0.4 (0.3 to 0.5)", True, "epicycle study a"),
        board.Line("m c=2", "share", "0.5", "0.3 (0.2 to 0.4)", False, "epicycle study a"),
    ]
    assert board.section({"title": "T", "source": "S", "undecided": "u"}, lines).splitlines() == [
        "## T", "", "S", "", "1 of 2 are met.", "", "Not compared: u", "",
        "| case | what | published | ours (95 % interval) | met | repeat with |",
        "|---|---|---|---|---|---|",
        "| m c=2 | share | 0.5 | 0.3 (0.2 to 0.4) | **no** | `epicycle study a` |",
        "| m c=1 | share | 0.5 | 0.4 (0.3 to 0.5) | yes | `epicycle study a` |",
    ]  # fmt: skip


def test_herman_begins_with_three_tokens() -> None:
    for number in (3, 7, 15):
        model = epicycle.load(board.HERE / "stochastic" / "herman.yaml", set={"N": number})
        model.record("tokens.output")
        assert Simulation(model).run(until=0)["tokens.output"].tokens[0] == 3
