"""Problems say where, what and what would be right."""

import copy
import pickle

import pytest

from epicycle.actors import did_you_mean, nearest
from epicycle.actors.core.errors import EpicycleError
from epicycle.runner.model.text.problems import MAX_PROBLEMS, ModelError, Position, Problem, Problems

LINE = "    vehicle: {type: Vehicle, sped: 8 m/s}"
MISTYPED = Problem(
    "main.vehicle: Vehicle has no parameter 'sped', did you mean 'speed'?",
    Position("models/x.yaml", 12, 30, 4, LINE),
    ("valid parameters: mass, speed",),
)
MISTYPED_TEXT = """\
models/x.yaml:12:30: error: main.vehicle: Vehicle has no parameter 'sped', did you mean 'speed'?
   12 |     vehicle: {type: Vehicle, sped: 8 m/s}
      |                              ^^^^
   help: valid parameters: mass, speed"""


def excerpt(source: str, column: int, length: int, line: int = 1) -> list[str]:
    return str(Problem("no", Position("f", line, column, length, source))).splitlines()[1:]


def test_problem_shows_the_line_and_a_caret() -> None:
    assert str(MISTYPED) == MISTYPED_TEXT


def test_problem_without_position() -> None:
    assert str(Problem("no model", help=("try x",))) == "error: no model\n   help: try x"


def test_carets_stand_below_tabs_wide_and_combining_characters() -> None:
    assert excerpt("\ta漢e\u0301x", 6, 1) == ["    1 |     a漢e\u0301x", "      |         ^"]
    assert excerpt("漢字: 1", 1, 2) == ["    1 | 漢字: 1", "      | ^^^^"]


def test_caret_may_stand_behind_the_line() -> None:
    assert excerpt("a:", 3, 1) == ["    1 | a:", "      |   ^"]
    assert excerpt("", 1, 1) == ["    1 |", "      | ^"]
    assert excerpt("ab", 2, 50) == ["    1 | ab", "      |  ^"]


def test_gutter_grows_with_the_line_number() -> None:
    assert excerpt("ab", 2, 1, line=1_234_567) == ["1234567 | ab", "        |  ^"]


def test_control_characters_are_escaped_everywhere() -> None:
    problem = Problem("\x1b[31m bad\nx", Position("f\r", 1, 1, 1, "\x1b\u202e"), ("\x07",))
    assert str(problem) == ("f\\r:1:1: error: \\x1b[31m bad\\nx\n    1 | \\x1b\\u202e\n      | ^^^^\n   help: \\x07")


@pytest.mark.parametrize("column", [1, 2, 60, 119, 120, 121, 300, 5_000, 99_990, 99_999])
def test_long_lines_are_cut_around_the_caret(column: int) -> None:
    source = "x" * (column - 1) + "Y" + "x" * (100_000 - column)
    line, carets = excerpt(source, column, 1)
    shown = line.partition("| ")[2]
    assert len(shown) <= 120
    assert line[carets.index("^")] == "Y"
    assert shown.endswith("...") is (column < 99_900)
    assert shown.startswith("...") is (column > 39)


def test_a_line_of_120_characters_is_shown_whole() -> None:
    assert excerpt("x" * 120, 1, 1)[0] == "    1 | " + "x" * 120
    assert excerpt("x" * 121, 1, 1)[0] == "    1 | " + "x" * 114 + "..."


def test_model_error_counts_its_problems() -> None:
    one = ModelError([MISTYPED])
    assert str(one) == MISTYPED_TEXT
    assert isinstance(one, EpicycleError)
    two = ModelError([MISTYPED, Problem("other", Position("y.yaml", 1, 1, 1, "a"))])
    assert str(two) == (
        MISTYPED_TEXT + "\n\ny.yaml:1:1: error: other\n    1 | a\n      | ^\n2 errors in models/x.yaml, y.yaml"
    )
    assert str(ModelError([Problem("a"), Problem("b")])) == "error: a\n\nerror: b\n2 errors"


@pytest.mark.parametrize("rebuild", [copy.copy, copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))])
def test_model_error_can_be_rebuilt(rebuild: object) -> None:
    error = ModelError([MISTYPED], 3)
    again = rebuild(error)  # type: ignore[operator]
    assert type(again) is ModelError
    assert (again.problems, again.more, str(again)) == ((MISTYPED,), 3, str(error))


def test_problems_are_raised_together_and_once() -> None:
    problems = Problems()
    problems.raise_if_any()
    assert len(problems) == 0
    problems.add("a", None, "help")
    problems.add("b")
    problems.add("a", None, "help")
    assert len(problems) == 2
    assert problems.found == (Problem("a", None, ("help",)), Problem("b"))
    with pytest.raises(ModelError) as caught:
        problems.raise_if_any()
    assert caught.value.problems == problems.found


def test_problems_are_capped() -> None:
    problems = Problems()
    for number in range(MAX_PROBLEMS):
        problems.add(f"problem {number}")
        problems.add(f"problem {number}")
    with pytest.raises(ModelError) as caught:
        problems.raise_if_any()
    assert str(caught.value).endswith("error: problem 99\n100 errors")
    with pytest.raises(ModelError) as caught:
        problems.add("one too many")
    assert len(caught.value.problems) == MAX_PROBLEMS
    assert str(caught.value).endswith("error: problem 99\nmore than 100 errors")


@pytest.mark.parametrize(
    ("name", "candidates", "expected"),
    [
        ("sped", ["mass", "speed"], "speed"),
        ("SPEED", ["mass", "speed"], "speed"),
        ("speed", ["speed"], None),
        ("xyz", ["mass", "speed"], None),
        ("", ["a"], None),
        ("s" * 10_000, ["s" * 10_000 + "x"], None),
    ],
)
def test_nearest(name: str, candidates: list[str], expected: str | None) -> None:
    assert nearest(name, candidates) == expected
    assert did_you_mean(name, candidates) == (f", did you mean {expected!r}?" if expected else "")
