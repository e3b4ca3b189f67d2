"""What the documents show is true: their models run, their Python runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from epicycle.runner import ModelError, Simulation, load_model

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def snippets(language: str) -> list[tuple[str, str]]:
    """The fenced blocks of a language, with names."""
    found = []
    for path in DOCUMENTS:
        blocks = re.findall(rf"^```{language}\n(.*?)^```", path.read_text(encoding="utf-8"), re.M | re.S)
        found += [(f"{path.name}-{number}", block) for number, block in enumerate(blocks)]
    return found


@pytest.mark.parametrize(("name", "code"), snippets("python"), ids=[name for name, _ in snippets("python")])
def test_python_runs(name: str, code: str) -> None:
    exec(compile(code, name, "exec"), {"__name__": name})


@pytest.mark.parametrize(("name", "text"), snippets("yaml"), ids=[name for name, _ in snippets("yaml")])
def test_models_run(name: str, text: str, tmp_path: Path) -> None:
    path = tmp_path / "model.yaml"
    path.write_text(text, encoding="utf-8")
    assert Simulation(load_model(path)).run().events > 0


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
    for path in DOCUMENTS:
        for target in re.findall(r"\]\(([^)#]+)\)", path.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (path.parent / target).exists(), f"{path.name} links to {target}"
