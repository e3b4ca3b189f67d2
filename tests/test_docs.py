"""What the documents show is true: their models run, their Python runs, and what is shown of it is what comes out.

``python tests/test_docs.py`` writes into the tutorials what comes out now.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import os
import re
import shlex
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from epicycle.runner import ModelError, Simulation, load_model
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue.metrics import TAKES, TIME, TOKENS
from epicycle.runner.model.catalogue.types import built_in
from epicycle.runner.model.language.study import read_study
from epicycle.runner.study.plan.plan import Plan
from tests.plugins import ABSENT

ROOT = Path(__file__).parent.parent
TUTORIALS = sorted((ROOT / "docs" / "tutorial").glob("*.md"))
PORT = "8786"  # of a scheduler in a tutorial
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


class Block(NamedTuple):
    """A fenced block of a document."""

    language: str
    text: str
    line: int


def blocks(path: Path) -> list[Block]:
    """The fenced blocks of a document, in order."""
    document = path.read_text(encoding="utf-8")
    return [
        Block(found[1], found[2], document[: found.start()].count("\n") + 2)
        for found in re.finditer(r"^```(\w*)\n(.*?)^```$", document, re.M | re.S)
    ]


def snippets(language: str) -> list[tuple[str, str]]:
    """The blocks of a language in all documents that are no tutorials, with names."""
    return [
        (f"{path.name}-{block.line}", block.text)
        for path in DOCUMENTS
        for block in blocks(path)
        if block.language == language
    ]


@pytest.mark.parametrize(("name", "code"), snippets("python"), ids=[name for name, _ in snippets("python")])
def test_python_runs(name: str, code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(code, name, "exec"), {"__name__": name})


@pytest.mark.parametrize(("name", "text"), snippets("yaml"), ids=[name for name, _ in snippets("yaml")])
def test_models_run(name: str, text: str, tmp_path: Path) -> None:
    path, overrides = tmp_path / "model.yaml", tmp_path / "overrides.yaml"
    overrides.write_text("{}")
    if text.startswith("# overrides.yaml"):  # of the model before it
        overrides.write_text(text, encoding="utf-8")
        yaml = snippets("yaml")
        text = yaml[[each for each, _ in yaml].index(name) - 1][1]
    path.write_text(text, encoding="utf-8")
    if text.startswith("study:"):
        assert Plan.made(read_study(path)).size > 0
    elif text.startswith("disturbance:"):
        assert Simulation(load_model("collision_avoidance", disturb=path)).run(until=0.5).events > 0
    else:
        assert Simulation(load_model(path, overrides=[overrides])).run().events > 0


class Reader:
    """Does what a tutorial says, in a folder of its own, as a reader would."""

    def __init__(self) -> None:
        self.names: dict[str, Any] = {"__name__": "tutorial"}
        self._port = ""  # of this machine, in the place of the one that is shown
        self._background: list[subprocess.Popen[bytes]] = []

    def outputs(self, tutorial: list[Block]) -> Iterator[tuple[Block, str, str]]:
        """What each block shows of its output, and what really came out.

        A block whose first line is ``# name`` is a file.  Other Python is run, and its output is the ``text`` block
        that follows; in ``console`` the output of a command stands below it, and ``dask ... &`` goes on until the end.
        """
        for block, after in zip(tutorial, [*tutorial[1:], Block("", "", 0)], strict=True):
            name = re.match(r"# (\w+\.\w+)\n", block.text)
            if name is not None:
                Path(name[1]).write_text(block.text, encoding="utf-8")
            elif block.language == "python":
                printed = self._printed(lambda code=block.text: exec(code, self.names))
                yield block, after.text if after.language == "text" else "", printed
            elif block.language == "console":
                for command, shown in re.findall(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", block.text, re.M):
                    program, *arguments = shlex.split(command.replace(PORT, self._port or PORT))
                    if program == "dask" and arguments[-1] == "&":
                        yield block, shown, self._started(arguments[:-1])
                        continue
                    assert program == "epicycle", command
                    yield block, shown, self._printed(lambda given=arguments: main(given))
            else:
                assert block.language == "text", f"line {block.line}: what is this?"

    def _started(self, arguments: list[str]) -> str:
        """Start a scheduler or worker, and wait until it says where it is."""
        pytest.importorskip("distributed")
        if not self._port:
            with socket.create_server(("127.0.0.1", 0)) as free:
                self._port = str(free.getsockname()[1])
        folder = tempfile.mkdtemp(dir=".")
        said = Path(folder, "said")
        program = [sys.executable, "-m", "dask", *(each.replace(PORT, self._port) for each in arguments)]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        with said.open("w") as output:
            self._background.append(
                subprocess.Popen(program, cwd=folder, env=environment, stdout=output, stderr=output)
            )
        deadline = time.monotonic() + 60
        while " at:" not in said.read_text() and time.monotonic() < deadline:
            time.sleep(0.05)
        return "\n"

    def close(self) -> None:
        """End what goes on in the background."""
        for each in reversed(self._background):
            each.terminate()
        for each in self._background:
            each.wait()

    @staticmethod
    def _printed(act: Any) -> str:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            act()
        return "\n".join(line.rstrip() for line in printed.getvalue().splitlines()) + "\n"


LONG = ("08_a_study", "09_many_machines", "17_recorded_robot")


@pytest.mark.parametrize(
    "path", [pytest.param(each, id=each.stem, marks=[pytest.mark.slow] * (each.stem in LONG)) for each in TUTORIALS]
)
def test_a_tutorial_shows_what_comes_out(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    modules = set(sys.modules)
    checker, shown_something, reader = doctest.OutputChecker(), False, Reader()
    try:
        for block, shown, printed in reader.outputs(blocks(path)):
            where = f"{path.name}, block at line {block.line}, printed:\n{printed}"
            assert checker.check_output(shown or "\n", printed, doctest.ELLIPSIS), where
            shown_something = shown_something or bool(shown)
    finally:
        reader.close()
        for name in set(sys.modules) - modules:  # the files of this tutorial; the next one may name its own so
            if getattr(sys.modules[name], "__file__", None) and str(tmp_path) in str(sys.modules[name].__file__):
                del sys.modules[name]
    assert shown_something


def test_error_of_the_readme_is_what_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (model,) = re.findall(r"^```yaml\n(.*?)^```", readme, re.M | re.S)
    (shown,) = re.findall(r"^```\n(my_model.yaml:.*?)^```", readme, re.M | re.S)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_model.yaml").write_text(model.replace("start: [0, 1]", "start: [0, 1], sped: 2 m/s"))
    with pytest.raises(ModelError) as caught:
        load_model("my_model.yaml")
    assert str(caught.value) + "\n" == shown


def test_links_lead_somewhere() -> None:
    for path in [*DOCUMENTS, *TUTORIALS]:
        prose = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
        for target in re.findall(r"\]\(([^)#]+)\)", prose):
            if "://" not in target and not any(f"{name}/" in target for name in ABSENT):
                assert (path.parent / target).exists(), f"{path.name} links to {target}"


def test_every_aspect_is_in_the_table_of_families() -> None:
    document = (ROOT / "docs" / "aspects.md").read_text(encoding="utf-8")
    families = "".join(line for line in document[: document.index("\n## ")].splitlines() if line.startswith("| "))
    assert set(re.findall(r"`([A-Z]\w+)`", families)) == set(built_in().aspects)


def test_every_metric_counts_what_the_table_says() -> None:
    document = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")
    (table,) = re.findall(r"^\| counts tokens .*\n\|-.*\n((?:\|.*\n)+)", document, re.M)
    found: dict[str, set[str]] = {TOKENS: set(), TIME: set()}
    for row in table.splitlines():
        _, of_tokens, _, of_time, *_ = row.split("|")
        found[TOKENS] |= set(re.findall(r"`(\w+)`", of_tokens)) - {"p", "when"}
        found[TIME] |= set(re.findall(r"`(\w+)`", of_time)) - {"p", "when"}
    assert found == {over: {name for name, each in TAKES.items() if each.over == over} for over in (TOKENS, TIME)}


def refresh(path: Path) -> None:
    """Put what comes out now into a tutorial."""
    document, at, reader = path.read_text(encoding="utf-8"), 0, Reader()
    for block, shown, printed in reader.outputs(blocks(path)):
        if block.language == "python":
            at = document.index(block.text, at) + len(block.text)
        if shown:
            at = document.index(shown, at)
            printed = re.sub(r"(wall time +).*", r"\1...", printed)
            document = document[:at] + printed + document[at + len(shown) :]
            at += len(printed)
    reader.close()
    path.write_text(document, encoding="utf-8")


if __name__ == "__main__":
    for tutorial in TUTORIALS:
        for module in [name for name, each in sys.modules.items() if "tutorial-" in str(getattr(each, "__file__", ""))]:
            del sys.modules[module]
        with (
            tempfile.TemporaryDirectory(prefix="tutorial-") as folder,
            contextlib.chdir(folder),
            pytest.MonkeyPatch.context() as patch,
        ):
            patch.syspath_prepend(folder)
            refresh(tutorial)
