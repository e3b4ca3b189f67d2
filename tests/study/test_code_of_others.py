"""Code that a results folder names runs only if the user has chosen it."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path

import pytest

from epicycle.actors import EpicycleError
from epicycle.runner import open_study
from epicycle.runner.interface.cli import main
from epicycle.runner.study.run.manifest import manifest_text
from tests.study.study_parts import write

STUDY = """
study: walks
model: ./walk.yaml
replications: 1
metrics: {place: place}
figures: {way: {type: Series, signal: walk.output}}
"""
MODEL = """
model: walk
actors:
  clock: {type: Clock, period: 1 s}
  walk: {type: NAME}
connections: [clock.output -> walk.input]
run: {stop: 3 s, record: [walk.output]}
metrics: {place: {of: walk.output, take: last}}
"""
CODE = """
from pathlib import Path
from epicycle.actors import Actor, InputPort, OutputPort
from NAME_part import STEP

Path(__file__).with_name("ran").touch()


class NAME(Actor):
    '''Steps.'''

    input: InputPort[float] = InputPort(float)
    output: OutputPort[float] = OutputPort(float)

    def fire(self) -> None:
        self.input.value
        self.output.send(STEP)
"""


class Place:
    """A study with code of its own, which leaves a file where it has run; another process would load it anew."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.code = folder, folder / f"{name}.py"
        write(folder, STUDY, MODEL.replace("NAME", name))
        self.code.write_text(CODE.replace("NAME", name))
        (folder / f"{name}_part.py").write_text("STEP = 1.0\n")
        self.part, self.ran, self.out = folder / f"{name}_part.py", folder / "ran", folder / "out"
        assert main(["study", str(folder / "walks.yaml"), "--types", str(self.code), "--out", str(self.out)]) == 0
        assert self.has_run()

    def has_run(self) -> bool:
        """Whether the code has run in a process since this was asked before."""
        import sys

        sys.modules.pop(self.code.stem, None)
        sys.modules.pop(self.part.stem, None)
        was = self.ran.exists()
        self.ran.unlink(missing_ok=True)
        return was

    def change(self, **entries: object) -> None:
        """Write the manifest as another machine might."""
        path = self.out / "manifest.json"
        path.write_text(manifest_text({**json.loads(path.read_text()), **entries}))


@pytest.fixture(autouse=True)
def _state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def said(capsys: pytest.CaptureFixture[str], place: Place) -> str:
    return capsys.readouterr().err.replace(f"{place.folder}/", "")


NOT_YOURS = (
    "the results were not made here by you, and loading their model would run the code of {0}.py\n"
    "   help: if you trust it, add --types {0}.py; in Python, types=[...]\n"
)


@pytest.mark.slow
@pytest.mark.parametrize("how", ["another key", "forged", "no seal", "more code"])
def test_a_folder_of_somebody_else_runs_no_code(
    tmp_path: Path, how: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    place = Place(tmp_path / "study", "Sent" + how.title().replace(" ", ""))
    run = open_study(place.out).table().column("run")[0].as_py()
    if how == "another key":
        monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "other"))
    elif how == "forged":
        place.change(seal="0" * 64)
    elif how == "no seal":
        place.change(seal=None)
    else:
        more = tmp_path / "evil.py"
        more.write_text(place.code.read_text())
        place.change(types=[str(more)])
    capsys.readouterr()
    name = place.code.stem if how != "more code" else str(tmp_path / "evil")
    for words in (["study", str(place.out)], ["run", str(place.out / run)], ["report", str(place.out)]):
        assert main(words) != 0
        assert said(capsys, place).endswith(NOT_YOURS.format(name)), words
    assert main(["status", str(place.out)]) == 0
    results = open_study(place.out)
    for act in (lambda: results.plan.load(results.plan.condition(0)), results.plan.manifest):
        with pytest.raises(EpicycleError, match="were not made here by you"):
            act()
    assert not place.has_run()
    assert not (tmp_path / "ran").exists()
    # With leave, it does.
    options = ["--types", str(place.code)]
    assert main(["study", str(place.out), *options]) == 0
    assert main(["report", str(place.out), *options]) == 0
    assert main(["run", str(place.out / run), *options]) == 0
    assert place.has_run()


def test_what_one_has_made_oneself_needs_no_leave(tmp_path: Path) -> None:
    place = Place(tmp_path / "study", "Mine")
    run = open_study(place.out).table().column("run")[0].as_py()
    for words in (["study", str(place.out)], ["report", str(place.out)], ["run", str(place.out / run)]):
        assert main(words) == 0
        assert place.has_run()
    key = tmp_path / "state" / "epicycle" / "key"
    assert (stat.S_IMODE(key.stat().st_mode), key.stat().st_size, os.listdir(key.parent)) == (0o600, 32, ["key"])


@pytest.mark.parametrize("part", ["code", "part"])
def test_changed_code_is_not_run(tmp_path: Path, part: str, capsys: pytest.CaptureFixture[str]) -> None:
    place = Place(tmp_path / "study", f"Changed{part.title()}")
    changed: Path = getattr(place, part)
    changed.write_text(changed.read_text() + "\n# other\n")
    capsys.readouterr()
    assert main(["study", str(place.out)]) == 2
    assert said(capsys, place) == (
        f"error: code has changed since the results were made, and is not run: {changed.name}\n"
        f"   help: if you trust it, add --types {place.code.name}; in Python, types=[...]\n"
    )
    assert not place.has_run()


@pytest.mark.slow
def test_a_study_notices_that_what_its_types_import_has_changed(tmp_path: Path) -> None:
    place = Place(tmp_path / "study", "Importing")
    words = ["study", str(tmp_path / "study" / "walks.yaml"), "--types", str(place.code), "--out", str(place.out)]
    place.part.write_text("STEP = 25.0\n")
    place.has_run()
    assert main(words) == 0
    assert open_study(place.out).table().column("place").to_pylist() == [25.0]


def test_a_key_that_others_can_read_seals_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = Place(tmp_path / "study", "Open")
    (tmp_path / "state" / "epicycle" / "key").chmod(0o644)
    capsys.readouterr()
    assert main(["study", str(place.out)]) == 2
    assert said(capsys, place) == "error: " + NOT_YOURS.format("Open")
    assert not place.has_run()


@pytest.mark.slow
def test_a_model_that_a_folder_of_somebody_else_names_is_not_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    study, out = tmp_path / "walks.yaml", tmp_path / "out"
    text = MODEL.replace("NAME", "Scale").replace("stop: 3 s", "stop: 2 s").replace("place", "way")
    write(tmp_path, STUDY.replace("place", "way"), text)
    assert main(["study", str(study), "--out", str(out)]) == 0
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "other"))
    capsys.readouterr()
    for words in ("study", "report"):
        assert main([words, str(out)]) != 0
        told = capsys.readouterr().err.replace(f"{tmp_path}/", "")
        assert told.endswith(
            "the results were not made here by you, and loading their model would read walk.yaml\n"
            "   help: if you trust it, make the runs yourself: epicycle study walks.yaml --out DIR\n"
        )
    assert main(["status", str(out)]) == 0
    # A model of the library is read by anyone.
    study.write_text("study: queue\nmodel: mm1\nreplications: 1\n")
    assert main(["study", str(study), "--out", str(tmp_path / "queue")]) == 0
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "third"))
    assert main(["study", str(tmp_path / "queue")]) == 0
