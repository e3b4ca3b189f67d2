"""The evaluator of points: the same answers in one process and in several, in the order in which they are asked for."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner.search import evaluator as module
from epicycle.runner.search.evaluator import Evaluator, Recipe, jobs_for
from epicycle.runner.support.apart import WorkerError


class Squares:
    """Makes squares, and says in which process."""

    def __init__(self, pause: float = 0.0) -> None:
        self._pause = pause

    def prepare(self, request: object) -> None:
        """There is nothing to load."""

    def make(self, request: int) -> tuple[int, int]:
        """The square and the process."""
        if request == 13:
            raise EpicycleError("13 has none")
        if request == 14:
            os._exit(3)
        time.sleep(self._pause)
        return request * request, os.getpid()


def test_one_process_works_here() -> None:
    with Evaluator(Squares(), 1, Squares) as evaluator:
        evaluator.expect((each, each) for each in range(5))
        assert [evaluator.make(each, each) for each in range(5)] == [(each * each, os.getpid()) for each in range(5)]
        with pytest.raises(EpicycleError, match=r"^13 has none$"):
            evaluator.make(13, 13)


def test_several_work_ahead_and_answer_in_order() -> None:
    with Evaluator(Squares(), 2, Squares, 0.05, patience=0.0) as evaluator:
        evaluator.expect((each, each) for each in range(8))
        made = [evaluator.make(each, each) for each in range(8)]
        assert [square for square, _ in made] == [each * each for each in range(8)]
        assert len({process for _, process in made} - {os.getpid()}) == 2
        # What was not expected is made as well, and what was expected in vain is left.
        evaluator.expect((each, each) for each in (20, 21, 22))
        assert evaluator.make(5, 5)[0] == 25
        with pytest.raises(EpicycleError, match=r"^13 has none$"):
            evaluator.make(13, 13)


class Noted(Squares):
    """Notes each request in a file of its own."""

    def __init__(self, folder: str) -> None:
        super().__init__(0.1)
        self._folder = folder

    def make(self, request: int) -> tuple[int, int]:
        """The square and the process."""
        Path(self._folder, f"{request}-{os.getpid()}-{time.monotonic_ns()}").touch()
        return super().make(request)


def test_nothing_that_is_expected_is_made_twice(tmp_path: Path) -> None:
    """Neither what was made here before there were processes, nor what is asked for once it is there."""
    with Evaluator(Noted(str(tmp_path)), 2, Noted, str(tmp_path), patience=0.12) as evaluator:
        evaluator.expect((each, each) for each in range(12))
        assert [evaluator.make(each, each)[0] for each in range(12)] == [each * each for each in range(12)]
    requests, processes, _ = zip(*(path.name.split("-") for path in tmp_path.iterdir()), strict=True)
    assert sorted(map(int, requests)) == [*range(12)]
    assert len(set(processes)) == 3  # this one, and two more


class Held(Noted):
    """Makes the first two requests at once, and others only once somebody lets it."""

    def make(self, request: int) -> tuple[int, int]:
        """The square and the process."""
        made, since = super().make(request), time.monotonic()
        while request > 1 and not Path(self._folder, "go").exists():
            assert time.monotonic() < since + 120.0
            time.sleep(0.01)
        return made


def test_what_is_no_longer_expected_is_not_begun(tmp_path: Path) -> None:
    with Evaluator(Held(str(tmp_path)), 2, Held, str(tmp_path), patience=0.0) as evaluator:
        evaluator.expect((each, each) for each in range(12))
        evaluator.make(0, 0)
        evaluator.make(1, 1)  # while two processes are at most at the next two
        evaluator.expect((each, each) for each in range(20, 30))
        (tmp_path / "go").touch()
        evaluator.make(20, 20)
    made = {int(path.name.partition("-")[0]) for path in tmp_path.glob("*-*")}
    assert made >= {0, 1, 20}
    assert not made & {*range(4, 20)}


def test_a_process_rests_until_its_result_is_heard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a search waits for may change what it expects; what it does not wait for yet is no reason to rest."""
    monkeypatch.setattr(module, "GRACE", 60.0)
    with Evaluator(Noted(str(tmp_path)), 2, Noted, str(tmp_path), patience=0.0) as evaluator:
        evaluator.expect((each, each) for each in range(4))
        _, process = evaluator.make(0, 0)
        while len(made := [*tmp_path.iterdir()]) < 4:
            time.sleep(0.01)
        assert [path.name.partition("-")[0] for path in made if f"-{process}-" in path.name] == ["0"]


def test_a_process_that_dies_is_reported() -> None:
    with (
        Evaluator(Squares(), 2, Squares, patience=0.0) as evaluator,
        pytest.raises(WorkerError, match=r"^a process that was making runs died; is there enough memory\?$"),
    ):
        evaluator.make(14, 14)


def test_processes_start_where_the_work_is_long() -> None:
    with Evaluator(Squares(0.06), 2, Squares, patience=0.1) as evaluator:
        assert [evaluator.make(each, each)[1] == os.getpid() for each in range(4)] == [True, True, False, False]


class Waiting(Noted):
    """Makes the first request only once somebody else has begun the second."""

    def make(self, request: int) -> tuple[int, int]:
        """The square and the process."""
        since = time.monotonic()
        while request == 0 and not [*Path(self._folder).glob("1-*")]:
            assert time.monotonic() < since + 120.0
            time.sleep(0.01)
        return super().make(request)


@pytest.mark.slow
def test_processes_start_in_the_middle_of_what_is_made_here(tmp_path: Path) -> None:
    with Evaluator(Waiting(str(tmp_path)), 2, Waiting, str(tmp_path), patience=0.1) as evaluator:
        evaluator.expect((each, each) for each in range(3))
        made = [evaluator.make(each, each) for each in range(3)]
    assert [square for square, _ in made] == [0, 1, 4]
    assert [process == os.getpid() for _, process in made] == [True, False, False]


def test_a_model_that_only_this_program_knows(tmp_path: Path) -> None:
    model = epicycle.load("mm1", set={"load": 0.5})
    recipe = Recipe.of(model)
    assert recipe is not None
    assert recipe.model().parameters["load"] == 0.5
    assert jobs_for(model, 2) == 2
    model.weave("loss", epicycle.aspects.PacketLoss(probability=0.1), at="server.input")
    assert jobs_for(model, None) == 1
    with pytest.raises(EpicycleError) as caught:
        jobs_for(model, 2)
    assert str(caught.value) == (
        "mm1 cannot be made in other processes, which do not know the models and classes of this program\n"
        "   help: leave out jobs"
    )


def test_other_processes_make_no_runs_of_a_model_that_has_changed_since(tmp_path: Path) -> None:
    path = tmp_path / "line.yaml"
    path.write_text(MODEL, encoding="utf-8")
    recipe = Recipe.of(epicycle.load(path))
    assert recipe is not None
    path.write_text(MODEL.replace("slope: 1.0", "slope: 2.0"), encoding="utf-8")
    with pytest.raises(WorkerError) as error:
        recipe.model()
    assert str(error.value) == (
        f"{path} changed while runs were made, and the next ones would be of another model\n"
        "   help: finished runs are kept; undo the change and repeat the command to continue them, or repeat it with "
        "the change to make all runs again"
    )


MODEL = """
model: line
parameters: {slope: 1.0, offset: 0.0}
actors:
  clock: {type: Clock, period: 100 ms}
  noise: {type: Random, distribution: {type: Uniform}}
  walk: {type: Accumulator}
  f: {type: Expression, expression: "(${slope}) * time + (${offset}) + 0 * tick"}
connections:
  - clock.output -> noise.trigger
  - noise.output -> walk.input
  - clock.output -> f.tick
aspects: {loss: {type: PacketLoss, probability: 0.3, at: walk.input}}
run: {stop: 10 s}
monitors: {enough: "eventually within 10 s walk.output > 45"}
"""


@pytest.fixture
def line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A model, where processes start at once."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Evaluator.__init__, "__kwdefaults__", {"patience": 0.0})
    Path("line.yaml").write_text(MODEL, encoding="utf-8")
    rows = "".join(f"{time},{1.5 * time - 0.5 + 0.01 * (time % 3)}\n" for time in range(1, 9))
    Path("measured.csv").write_text(f"time,value\n{rows}", encoding="utf-8")
    return "line.yaml"


@pytest.mark.slow
def test_each_search_answers_the_same_with_several(line: str) -> None:
    def facts(jobs: int) -> list[object]:
        goal, out = epicycle.Match({"f.output": "measured.csv"}), Path(f"jobs {jobs}")
        vary = {"slope": "0..3", "offset": "-2..2"}
        calibration = epicycle.search(line, goal, vary=vary, jobs=jobs, out=out / "calibration")
        explanation = epicycle.explain(line, "enough", seed=1, jobs=jobs, out=out / "explanation")
        rare = epicycle.rare(line, "always walk.output < 45", runs=20, repetitions=4, jobs=jobs, out=out / "rare")
        noted = [sorted(each.read_text() for each in folder.glob("tried-*")) for folder in sorted(out.iterdir())]
        return [calibration.facts(), explanation.facts(), rare.facts(), noted]

    assert facts(1) == facts(2)
    assert module.PATIENCE > 0.0


class StrangeError(EpicycleError):
    """An error that is written as it is, and cannot be read."""

    def __init__(self, one: str, other: str) -> None:
        super().__init__(one + other)


class Unreadable:
    """Raises what only its own process can read, or cannot be read itself."""

    def __init__(self, where: str) -> None:
        self._where = where

    def __setstate__(self, state: dict[str, str]) -> None:
        raise LookupError(f"there is no {state['_where']} here")

    def prepare(self, request: object) -> None:
        """There is nothing to load."""

    def make(self, request: object) -> object:
        """Nothing."""
        raise StrangeError("it is ", "strange")


def test_what_cannot_be_read_is_reported() -> None:
    """Nobody waits for ever for an answer that no process can give, or for one that this process cannot read."""
    with Evaluator(Squares(), 2, Unreadable, "it", patience=0.0) as evaluator:
        with pytest.raises(WorkerError) as caught:
            evaluator.make(1, 1)
        assert str(caught.value) == (
            "the answer of a process cannot be read: TypeError: StrangeError.__init__() missing 1 required positional "
            "argument: 'other'"
        )
        with pytest.raises(EpicycleError) as unread:
            evaluator.make(2, Unreadable("request"))
        assert str(unread.value) == "LookupError: there is no request here"
