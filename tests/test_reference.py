"""The files that are made from the declarations are up to date.  ``make reference`` writes them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib import import_module
from inspect import getdoc
from pathlib import Path

import pytest

from tests.constructors import stubs

ROOT = Path(__file__).parents[1]
FILES = (
    "models/schema.json",
    "docs/reference.md",
    "actors/constructors.pyi",
    "aspects/constructors.pyi",
    "docs/api.md",
    "docs/problems.md",
)


def texts() -> dict[str, str]:
    """What the files should hold: Epicycle's own types, whatever else is installed."""
    from epicycle.runner.model.catalogue.figure import own_figures
    from epicycle.runner.model.catalogue.types import built_in
    from epicycle.runner.model.language.schema import json_schema, schema_text
    from epicycle.runner.show.report import own_study_figures
    from tests.desk.kinds_page import page
    from tests.reference_page import markdown

    own, figures, of_studies = built_in(), own_figures(), own_study_figures()
    schema = schema_text(json_schema(own, figures, of_studies))
    return dict(zip(FILES, (schema, markdown(own, figures, of_studies), *stubs().values(), api(), page()), strict=True))


def api() -> str:
    """The page of the Python API: its names are written by hand, what they are is said by their docstrings."""
    from epicycle.runner.model.catalogue.reference import first_sentence

    def line(found: re.Match[str]) -> str:
        module, _, name = found[1].rpartition(".")
        said = first_sentence(getdoc(getattr(import_module(module), name)) or "").replace("``", "`")
        return f"- `{found[1]}`: {said}."

    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    return re.sub(r"^- `(epicycle[.\w]+)`.*$", line, page, flags=re.M)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files, made in a process of its own: other tests define types."""
    folder = tmp_path_factory.mktemp("made")
    for name in FILES:
        (folder / name).parent.mkdir(exist_ok=True)
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    subprocess.run([sys.executable, "-m", "tests.test_reference", str(folder)], check=True, cwd=ROOT, env=environment)
    return folder


@pytest.mark.parametrize("name", FILES)
def test_file_is_up_to_date(name: str, made: Path) -> None:
    written = ROOT / name
    assert written.is_file(), f"{name} is missing: run 'make reference'"
    is_same = written.read_text(encoding="utf-8") == (made / name).read_text(encoding="utf-8")
    assert is_same, f"{name} is not what the code declares: run 'make reference' and commit it"


if __name__ == "__main__":
    for name, text in texts().items():
        (Path(sys.argv[1]) / name).write_text(text, encoding="utf-8")
