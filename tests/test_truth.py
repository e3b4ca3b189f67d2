"""The truth board: its models load, its queues have the values of theory, and a small part is run."""

from __future__ import annotations

from math import exp, factorial, prod
from pathlib import Path

import numpy as np
import pytest

import epicycle
from benchmarks.truth import board, stone_soup
from epicycle.runner import Simulation
from website.truth import draw_truth, truth_page

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


def polling(queues: int, load: float, walk: float, discipline: str) -> float:
    """The mean wait at queues that are visited in turn; services and walks have exponential times (Takagi)."""
    sign, slow = {"exhaustive": (-1, 0.0), "gated": (1, 0.0), "limited": (1, load * walk)}[discipline]
    return walk / 2 + (2 * load + walk * (queues + sign * load) + slow * walk) / (2 * (1 - load - slow))


def impatient(load: float, servers: int, patience: float) -> tuple[float, float]:
    """The share of calls that are given up, and how many wait (birth and death)."""
    weights = [1.0]
    for n in range(1, 400):
        weights.append(weights[-1] * load / (min(n, servers) + max(n - servers, 0) / patience))
    waiting = sum(max(n - servers, 0) * weight for n, weight in enumerate(weights)) / sum(weights)
    return waiting / patience / load, waiting


def time_to_deadlock(arrivals: float, services: float, again: float, places: int) -> float:
    """The mean time from an empty queue until a served customer wants to join a full one (linear equations)."""
    rates, ones = np.zeros((places + 1, places + 1)), np.ones(places + 1)
    for n in range(places + 1):
        up, down = arrivals * (n < places), services * (1 - again) * (n > 0)
        rates[n, n] = up + down + services * again * (n == places)
        if n < places:
            rates[n, n + 1] = -up
        if n > 0:
            rates[n, n - 1] = -down
    return float(np.linalg.solve(rates, ones)[0])


def clocked(load: float) -> float:
    """The mean stay in D/M/1: a fixed point."""
    share = 0.5
    for _ in range(1000):
        share = exp(-(1 - share) / load)
    return 1 / (1 - share)


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
        "priority_unequal": {
            "first": [0.8 / (1 - urgent) for urgent in (0.2, 0.6)],
            "second": [0.8 / (1 - urgent) / 0.2 for urgent in (0.2, 0.6)],
        },
        "preemptive": {
            "first": [urgent / (1 - urgent) for urgent in (0.3, 0.6)],
            "second": [other / (1 - urgent) / (1 - urgent - other) for urgent, other in ((0.3, 0.4), (0.6, 0.2))],
        },
        "polling_cyclic": {
            "wait": [
                polling(*system, discipline)
                for discipline in ("exhaustive", "gated", "limited")
                for system in ((3, 0.5, 0.5), (5, 0.6, 0.25))
            ]
        },
        "deadlock": {"deadlock": [time_to_deadlock(6, 5, 0.5, 4), time_to_deadlock(4, 5, 0.25, 4)]},
        "blocking": {"throughput": [(buffer + 2) / (buffer + 3) for buffer in (0, 1, 4)]},
        "erlang_a": {
            name: [impatient(*line)[number] for line in ((4, 4, 2), (6, 5, 1))]
            for number, name in enumerate(("abandoned", "waiting"))
        },
        "vacations": {"wait": [load / (1 - load) + pause for load, pause in ((0.5, 2), (0.7, 1))]},
        "shortest_first": {
            "short": [rate / (1 - 0.4 * rate) for rate in (0.5, 0.7)],
            "long": [rate / (1 - 0.4 * rate) / (1 - rate) for rate in (0.5, 0.7)],
        },
        "dm1": {"stay": [clocked(load) for load in (0.5, 0.8)]},
        "batches": {"number": [load * (1 + group) / 2 / (1 - load) for load, group in ((0.5, 3), (0.7, 2))]},
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


def test_lines_are_read_as_they_were_written() -> None:
    numbers = board._line("m", {"c": 1, "d": 2}, "share", (0.5, 0.41234567, 0.2, 0.6), "epicycle study a")
    assert numbers == board.Line(
        "m c=1, d=2", "share", "0.5", "0.41 (0.20 to 0.60)", True, "epicycle study a",
        numbers=(0.5, 0.41, 0.2, 0.6),
    )  # fmt: skip
    found = {"queues": [numbers], "simpy": [board.Line("x", "y", "1", "2", False, "z", is_interval=False)]}
    assert board.of_text(board.as_text(found)) == found


def test_what_was_found_is_the_committed_page() -> None:
    found = board.of_text(board.FOUND.read_text(encoding="utf-8"))
    assert list(found) == list(board.SOURCES)
    assert board.page(found) == (board.HERE.parent / "TRUTH.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_page_of_the_site_has_a_picture_of_each_source_with_numbers(tmp_path: Path) -> None:
    made = draw_truth(tmp_path)
    assert [path.name for path in made] == ["stochastic.svg", "queues.svg", "tracking.svg"]
    text = truth_page()
    assert [line for line in text.splitlines() if line.startswith("![")] == [
        f"![What is published, and ours](truth/{path.name}){{ .wide }}" for path in made
    ]
    assert all(path.read_text(encoding="utf-8").rstrip().endswith("</svg>") for path in made)


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


@pytest.mark.slow
def test_a_filter_beside_stone_soups(monkeypatch: pytest.MonkeyPatch) -> None:
    file = board.HERE / "tracking" / "late.yaml"
    (line,) = stone_soup.compared(file, "filter", 1)
    assert line.is_met
    assert line.theirs == line.ours == "7.092013"
    exact = stone_soup._in_order
    monkeypatch.setattr(stone_soup, "_in_order", lambda *run: [each + 0.001 for each in exact(*run)])
    (line,) = stone_soup.compared(file, "filter", 1)
    assert (line.is_met, line.ours) == (False, "7.092013; estimates are up to 0.001 apart")


@pytest.mark.slow
def test_a_tracker_beside_stone_soups() -> None:
    found = list(stone_soup.compared(board.HERE / "tracking" / "crossing.yaml", "tracker", 3))
    assert [each.asked for each in found] == [f"{metric}, mean of 3 runs" for metric in stone_soup.METRICS]
    assert all(each.is_met for each in found)
    assert all(float(each.ours.split()[0]) < 5.0 for each in found)


def test_herman_begins_with_three_tokens() -> None:
    for number in (3, 7, 15):
        model = epicycle.load(board.HERE / "stochastic" / "herman.yaml", set={"N": number})
        model.record("tokens.output")
        assert Simulation(model).run(until=0)["tokens.output"].tokens[0] == 3
