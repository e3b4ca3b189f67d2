"""The notebook among the tutorials runs, and shows what it is to show; how far a run is can be seen in a notebook."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

import epicycle
from epicycle.runner.support import bars

NOTEBOOK = Path(__file__).parents[1] / "docs" / "tutorial" / "14_notebook.ipynb"


@pytest.mark.slow
def test_the_notebook_of_the_tutorials_runs(tmp_path: Path) -> None:
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)  # they are what comes out here
    nbclient.NotebookClient(notebook, timeout=60, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = {}
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            assert output.output_type != "error"
            data = output.get("data", {"text/plain": output.get("text", "")})
            shown[cell.source.splitlines()[-1]] = data.get("text/html", data.get("text/plain", ""))
    tables = {
        "results": ("mm1, seed 3: ", "<td>mean_wait</td>", "<td>wait.output</td>", "<td>digest</td>"),
        "simulation": ("mm1, seed 3: at 499", "of 4000 s, paused", "<td>mean_number</td>"),
        "comparison": ("mm1: as it is, faster, lossy; seeds 1 to 8", "<th>p (Holm)</th>", "<td>lossy</td>"),
        "study": ("load: 24 of 24 runs (24 ok)", "<th>mean_wait (s)</th>", "<td>0.9</td>"),
    }
    for name, parts in tables.items():
        assert [part for part in parts if part not in shown[name]] == []
    pictures = [line for line, text in shown.items() if text.startswith('<img src="data:image/svg+xml;base64,')]
    assert pictures == [
        'epicycle.plot(results, "number")',
        'epicycle.plot(results, "wait.output")',
        "model",
        'epicycle.draw("thermostat", machine="room")',
        'epicycle.plot(study, "mean_wait_mean")',
        "own",
        'epicycle.plot(results, "server.size")',
    ]
    assert "<td>PoissonClock</td>" in shown["own"]
    assert shown["simulation.run().digest == fork.run().digest"] == "True"
    assert "Server has no parameter 'service_tim', did you mean 'service_time'?" in shown["    print(error)"]
    assert shown['[path.name for path in epicycle.save(results, "counter")]'] == "['signals.parquet', 'manifest.json']"


@pytest.fixture
def displayed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What a notebook would have shown in one place, one after the other; there is a terminal in no test."""
    shown: list[str] = []
    place = SimpleNamespace(update=shown.append)
    module: Any = ModuleType("IPython.display")
    module.HTML = str
    module.display = lambda text, display_id: shown.append(text) or place
    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    monkeypatch.setattr(bars, "_OFTEN", 0.0)
    return shown


def test_how_far_a_run_is_is_shown_and_goes_at_the_end(displayed: list[str]) -> None:
    with bars.bar("<b>") as show:
        assert show is not None
        show(2.0, 8.0, "2 s of model time")
    assert displayed == [
        "",
        '<div>&lt;b&gt; <progress value="2" max="8"></progress> 2 s of model time</div>',
        "",
    ]


def test_short_runs_show_nothing(displayed: list[str]) -> None:
    epicycle.run("mm1", until=10)
    epicycle.run("mm1", until=10, progress=False)
    assert displayed == []


def test_elsewhere_there_is_no_bar() -> None:
    with bars.bar("a") as show:
        assert show is None
