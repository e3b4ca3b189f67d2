"""The tool that makes mutants, on a project of one file."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("cosmic_ray")

from tests.mutation import __main__ as tool
from tests.mutation import mutants, recorder, trial
from tests.mutation.__main__ import Result, argued, attempt, is_below, report, stages
from tests.mutation.mutants import Mutant

SOURCE = '''"""A file."""

from __future__ import annotations

LIMIT = 3


def larger(value: int | None, limit: int = LIMIT) -> int | None:
    """Nobody tests what becomes of None."""
    if value is None:
        return 0 - 1
    return value * 2 if value < limit else value
'''
TESTS = """
from actors.core.some import larger

def test_it():
    assert [larger(value) for value in (-1, 2, 3, 4)] == [-2, 4, 3, 4]

def test_nothing():
    pass
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pyproject.toml").write_text('[tool.pytest.ini_options]\npythonpath = ["."]\n', encoding="utf-8")
    for name, text in (("actors/core/some.py", SOURCE), ("tests/test_some.py", TESTS)):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def changes(found: list[Mutant]) -> set[tuple[int, str]]:
    return {(mutant.line, mutant.made(SOURCE).lines(SOURCE)[1]) for mutant in found}


def test_what_runs_is_mutated_and_what_does_not_is_not(project: Path) -> None:
    found = changes(list(mutants.mutants_of(project)))
    assert {line for line, _ in found} == {5, 10, 11, 12}
    assert {(5, "LIMIT = 4"), (5, "LIMIT = 2"), (10, "if value is not None:")} <= found
    assert (12, "return value * 2 if value <= limit else value") in found
    assert not any(sign in text for _, text in found for sign in (" | ", ">>", " == None"))


def test_every_file_and_folder_that_is_named_is_there() -> None:
    named = (*mutants.GUARDED, *mutants.KERNELS, *mutants.TOLERANCES, *tool.COMPILERS, *tool.TESTS)
    assert [each for each in named if not (tool.ROOT / each).exists()] == []


def test_a_change_that_python_does_not_see_is_none() -> None:
    before = "limit = 9007199254740992.0\n"
    assert [
        mutants._is_another(Mutant("some.py", 1, 0, "some", 0, text), before)
        for text in (before, "", "limit =\n", "limit = 1.0\n")
    ] == [False, False, False, True]


def test_every_survivor_is_a_change_of_a_line_that_there_is() -> None:
    """A decorator that is left out has no line: that of what it decorates stands for it."""
    kept = {
        file: {line.strip() for line in (tool.ROOT / file).read_text("utf-8").splitlines()} for file, _, _ in argued()
    }
    assert [change for change in argued() if (change[1] or change[2]) not in kept[change[0]]] == []


def test_a_sample_is_spread_over_all_places_and_the_same_each_time(project: Path) -> None:
    every = list(mutants.mutants_of(project))
    places = {mutant[:3] for mutant in every}
    whole = mutants.sample(project, every, 100, 1)
    assert {mutant[:3] for mutant in whole} == places
    assert len(whole) == len(places)
    few = mutants.sample(project, every, 4, 1)
    assert [mutant[:-1] for mutant in few] == [mutant[:-1] for mutant in mutants.sample(project, every, 4, 1)]
    assert len({mutant.line for mutant in few}) >= 3
    assert all(compile(mutant.text, "some.py", "exec") for mutant in whole)


def test_tests_of_a_line_are_asked_until_one_fails(project: Path) -> None:
    test, idle = "tests/test_some.py::test_it", "tests/test_some.py::test_nothing"
    recorded = {test: (0.01, {"actors/core/some.py": [10, 12]}), idle: (0.01, {}), "gone": (9.0, {})}
    known = recorder.Map(recorded)
    assert known.tests("actors/core/some.py", SOURCE, 12) == [test]
    assert known.tests("actors/core/some.py", SOURCE, 11) == [test]  # nobody runs it: those that run its function
    assert known.tests("actors/core/some.py", SOURCE, 5) == [test]
    assert known.tests("actors/core/other.py", SOURCE, 5) == [test]  # its neighbours'
    assert known.tests("aspects/other.py", SOURCE, 5) == []
    results = {}
    for mutant in mutants.mutants_of(project):
        if mutant.operator.endswith(("_Mul_Add", "_Sub_Add")):
            result = attempt(mutant.made(SOURCE), project, {True: known, False: known})
            results[result.after] = (result.killed, result.by)
    assert (project / "actors/core/some.py").read_text(encoding="utf-8") == SOURCE
    assert results == {
        "return value + 2 if value < limit else value": (True, test),
        "return 0 + 1": (False, ""),
    }


def test_every_file_with_tests_of_a_line_is_asked_early() -> None:
    assert recorder.in_turn(["a::1", "a::2", "a::3", "b::1", "c::1", "b::2"]) == [
        "a::1", "b::1", "c::1", "a::2", "b::2", "a::3",
    ]  # fmt: skip


def test_heaps_of_tests_are_small_at_first() -> None:
    tests = [f"t{number}" for number in range(40)]
    heaps = list(stages(tests, dict.fromkeys(tests, 0.05)))
    assert [len(heap) for heap, _ in heaps] == [25, 15]
    assert list(stages(["slow", "quick"], {"slow": 5.0, "quick": 0.1})) == [(["slow"], 5.0), (["quick"], 0.1)]


def test_what_dies_or_hangs_has_failed(project: Path) -> None:
    (project / "tests/test_ends.py").write_text(
        "import os, time\ndef test_dies(): os._exit(3)\ndef test_hangs():\n    while True: pass\n", encoding="utf-8"
    )
    assert trial.run_tests(project, ["tests/test_ends.py::test_dies"], True, 5.0)[:2] == (False, "died")
    hung = trial.run_tests(project, ["tests/test_ends.py::test_hangs"], True, 0.5)
    assert hung[:2] == (False, "ended by signal 24")


def test_what_cannot_be_killed_does_not_count(capsys: pytest.CaptureFixture[str]) -> None:
    known, *_ = [entry for entry in argued().values() if entry["kind"] == "equivalent"]
    place = Mutant(known["file"], 3, 1, "some", 0, "")
    results = [
        Result(place, True, "a test", 1, 0.1, "a", "b"),
        Result(place, False, "", 2, 0.1, "a", "c"),
        Result(place, False, "", 2, 0.1, known["from"], known["to"]),
    ]
    assert report(results) == (1, 2)
    *told, folder, every, survivors, without = capsys.readouterr().out.splitlines()
    assert sorted(told) == sorted(
        [
            *[f"{known['file']}:3: survived 2 tests"] * 2, "    - a", "    + c", "    not looked at yet",
            f"    - {known['from']}", f"    + {known['to']}", f"    equivalent: {known['why']}", "",
        ]
    )  # fmt: skip
    assert folder == f"{'actors/core':16}     1 of     3 killed,  33.3%"
    assert every == f"{'all':16}     1 of     3 killed,  33.3%"
    assert survivors == "survivors: 1 equivalent, 1 new"
    assert without == "without those that are equivalent: 1 of 2, 50.0%"


def test_a_sample_may_be_a_little_worse_than_the_whole() -> None:
    assert [is_below(0.9, killed, 200) for killed in (200, 180, 173, 172, 150)] == [False, False, False, True, True]
    assert not is_below(0.9, 0, 1)
