"""Every wrong model gets its message, to the letter.

`NAME.yaml` gets what `NAME.txt` holds from the command line, with the actors and aspects that are there; a first line
`# epicycle validate NAME.yaml ...` says with which options.  The files in `small/` hold many cases each, as
``tests/cases.py`` reads them: models of the small actors in ``model_parts.py``, whose messages do not change as
Epicycle grows.

``python -m tests.bad_models.test_bad_models`` writes all messages anew; read the difference as the author of such a
model would, and keep it only if it helps.
"""

from __future__ import annotations

import contextlib
import io
import shlex
import tempfile
from pathlib import Path

import pytest

from epicycle.aspects import MeasurementFailure, PacketLoss
from epicycle.runner.interface.cli import main
from epicycle.runner.model.build import load as load_module
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.catalogue.types import Catalogue
from epicycle.runner.model.text.problems import ModelError
from tests import cases
from tests.cases import Case
from tests.model.model_parts import TYPES
from tests.plugins import ABSENT

FOLDER = Path(__file__).parent
NAMES = sorted(path.stem for path in FOLDER.glob("*.yaml"))
COMMAND = "# epicycle "

SMALL = sorted((FOLDER / "small").glob("*.txt"))
CASES = [pytest.param(case, id=f"{path.stem}: {case.name}") for path in SMALL for case in cases.read(path)]
# Only these types, so that messages that list them stay the same when the houses grow.
CATALOGUE = Catalogue({}, {"PacketLoss": PacketLoss, "MeasurementFailure": MeasurementFailure})


def said(name: str) -> tuple[int, str]:
    """The exit code of `epicycle validate` and what it says."""
    with (FOLDER / f"{name}.yaml").open(encoding="utf-8", errors="replace") as file:
        first = file.readline()
    arguments = shlex.split(first.removeprefix(COMMAND)) if first.startswith(COMMAND) else ["validate", f"{name}.yaml"]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(FOLDER), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(arguments)
    return code, err.getvalue()


@pytest.mark.parametrize("name", NAMES)
def test_message(name: str) -> None:
    assert said(name) == (2, (FOLDER / f"{name}.txt").read_text(encoding="utf-8"))


def test_each_message_has_its_model() -> None:
    assert sorted(path.stem for path in FOLDER.glob("*.txt")) == NAMES
    assert len(NAMES) >= 60


def said_of(case: Case) -> str:
    """What load_model says about a case, in an empty folder."""
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setattr(load_module, "installed", lambda: CATALOGUE)
        for file, text in case.files("m.yaml").items():
            Path(file).parent.mkdir(exist_ok=True)
            Path(file).write_text(text, encoding="utf-8")
        given: dict[str, list[str]] = {"set": [], "disturb": [], "aspects": [], "without_aspects": [], "overrides": []}
        name = "./m.yaml"
        for option, value in case.options:
            if option == "model":
                name = value
            else:
                given[option].append(value)
        try:
            model = load_model(name, types=TYPES, **given)
        except ModelError as error:
            return f"{error}\n"
        return "\n\n".join(map(str, model.warnings or ("nothing",))) + "\n"


@pytest.mark.parametrize("case", CASES)
def test_message_of_small_models(case: Case) -> None:
    if any(name in case.message.lower() + said_of(case).lower() for name in ABSENT):
        pytest.skip("about a plug-in that is not there")
    assert said_of(case) == case.message


def test_nothing_was_done() -> None:
    """Some of them would leave a file behind if they were obeyed."""
    assert not list(FOLDER.rglob("harm")) + list(Path.cwd().glob("harm"))


def write_anew() -> None:
    """Write the messages of today."""
    for name in NAMES:
        code, text = said(name)
        if code != 2:
            print(f"{name} is not refused, the exit code is {code}")
        (FOLDER / f"{name}.txt").write_text(text, encoding="utf-8")
    for path in SMALL:
        cases.write(path, said_of)


if __name__ == "__main__":
    write_anew()
