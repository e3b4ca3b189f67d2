"""What is said about models that are wrong: whole messages, from the files in ``bad/``.

A case is ``### its name``, ``$ option=value`` lines for what stands on the command line, the model, ``>>>``, and the
message.  ``python tests/model/test_bad_models.py`` writes the messages anew; read the difference before keeping it.
"""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path

import pytest

from epicycle.aspects import MeasurementFailure, PacketLoss
from epicycle.runner.model import ModelError, load_model
from epicycle.runner.model import load as load_module
from epicycle.runner.model.catalogue import Catalogue
from tests.model.model_parts import TYPES

# Only these types, so that messages that list them stay the same when the houses grow.
CATALOGUE = Catalogue({}, {"PacketLoss": PacketLoss, "MeasurementFailure": MeasurementFailure})
FOLDER = Path(__file__).parent / "bad"
CASE = re.compile(r"^### ([^\n]+)\n((?:\$ [^\n]*\n)*)(.*?)^>>>\n(.*?)(?=^### |\Z)", re.MULTILINE | re.DOTALL)
CASES = [
    pytest.param(*case[1:], id=f"{path.stem}: {case[0]}")
    for path in sorted(FOLDER.glob("*.txt"))
    for case in CASE.findall(path.read_text(encoding="utf-8"))
]


def message(options: str, model: str, folder: Path) -> str:
    """What load_model says about a model in a file."""
    files = re.split(r"^# file: (.+)\n", model, flags=re.MULTILINE)
    for name, text in zip(["m.yaml", *files[1::2]], files[::2], strict=True):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    given: dict[str, list[str]] = {"set": [], "disturb": [], "aspects": [], "without_aspects": [], "overrides": []}
    name = "./m.yaml"
    for option in options.splitlines():
        key, _, value = option.removeprefix("$ ").partition(" ")
        if key == "model":
            name = value
        else:
            given[key].append(value)
    try:
        model = load_model(name, types=TYPES, **given)
    except ModelError as error:
        return f"{error}\n"
    return "\n\n".join(map(str, model.warnings or ("nothing",))) + "\n"


@pytest.mark.parametrize(("options", "model", "expected"), CASES)
def test_message(options: str, model: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(load_module, "installed", lambda: CATALOGUE)
    assert message(options, model, tmp_path) == expected.rstrip("\n") + "\n"


def write_anew() -> None:
    """Put the present messages into the files."""
    load_module.installed = lambda: CATALOGUE
    for path in sorted(FOLDER.glob("*.txt")):
        cases = []
        for name, options, model, _ in CASE.findall(path.read_text(encoding="utf-8")):
            with tempfile.TemporaryDirectory() as folder:
                os.chdir(folder)
                cases.append(f"### {name}\n{options}{model}>>>\n{message(options, model, Path(folder))}\n")
        path.write_text("".join(cases).rstrip("\n") + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_anew()
