"""``epicycle lsp`` in a real editor: Neovim without a display."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from epicycle.runner.model.build.load import load_model
from tests.desk.editor_parts import PATIENCE

NVIM = shutil.which("nvim")
README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
MODEL = next(
    each for each in re.findall(r"```yaml\n(.*?)```", README, re.DOTALL) if each.startswith("model: two_bodies")
)


@pytest.mark.slow
@pytest.mark.skipif(NVIM is None, reason="there is no Neovim: install the distribution's package neovim")
def test_a_model_is_opened_completed_renamed_in_and_written(tmp_path: Path) -> None:
    path, told = tmp_path / "two_bodies.yaml", tmp_path / "said.json"
    block = "\n    period: 500 ms\n    type: Cloc"
    text = "# é\n" + MODEL.replace(" {type: Clock, period: 500 ms}", block)
    path.write_text(text, "utf-8")
    script = Path(__file__).with_name("neovim.lua")
    environment = {
        **os.environ,
        "XDG_STATE_HOME": str(tmp_path),
        "XDG_CACHE_HOME": str(tmp_path),
        "LSP": json.dumps([sys.executable, "-m", "epicycle", "lsp"]),
        "SAID": str(told),
    }
    command = [str(NVIM), "--headless", "-u", "NONE", "-i", "NONE", "-n", str(path), "-c", f"luafile {script}"]
    subprocess.run(command, cwd=tmp_path, env=environment, check=True, timeout=3 * PATIENCE, capture_output=True)
    said = json.loads(told.read_text("utf-8"))
    ((line, column, code, message),) = said.pop("before")
    assert (line, column, code) == (7, 10, "E0301")
    assert message.startswith(
        "clock: there is no actor type 'Cloc', did you mean 'Clock'?\nhelp: valid types: those that"
    )
    assert said == {
        "completed": "Ticks at fixed times without drift: in cycle k at `offset + k * period` plus each of `offsets`",
        "hover": (
            "**left**: actor, `CircularMotion`\n\n"
            "A body on a circle of radius `speed / turn_rate` (Table III), computed from the time alone"
        ),
    }
    assert path.read_text("utf-8") == text.replace("type: Cloc\n", "type: Clock\n").replace("left", "planet")
    assert "planet" in load_model(path).graph.actors
