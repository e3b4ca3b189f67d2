"""`epicycle completion`: the scripts complete commands, options and names, each in its shell where there is one."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main
from epicycle.runner.interface.commands import commands
from epicycle.runner.model.catalogue.packaged import packaged_disturbances, packaged_models


def script(shell: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["completion", shell]) == 0
    return capsys.readouterr().out


def in_bash(text: str, line: str, folder: Path) -> list[str]:
    """What bash offers for the last word of a line."""
    (folder / "script").write_text(text)
    (folder / "my_model.yaml").write_text("")
    (folder / "my_folder").mkdir(exist_ok=True)
    words = f'epicycle {line}""' if line.endswith(" ") else f"epicycle {line}"
    ask = f"source ./script; COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _shtab_epicycle; "
    ask += 'printf "%s\\n" "${COMPREPLY[@]}"'
    done = subprocess.run(["bash", "-c", ask], cwd=folder, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return sorted(done.stdout.split())


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_commands_options_and_names(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    text = script("bash", capsys)
    offers = {
        "": sorted(each.name for each in commands()),
        "--": ["--help", "--version"],
        "comp": ["compare", "completion"],
        "run mm": ["mm1"],
        "run my": ["my_folder", "my_model.yaml"],
        "run mm1 --se": ["--seed", "--set"],
        "run mm1 --disturb wi": ["wifi_burst"],
        "run mm1 --seed ": [],
        "run mm1 --out ": ["my_folder"],
        "study wait": ["waiting_time"],
        "describe Pois": ["PoissonClock"],
        "describe Pack": ["PacketLoss"],
        "completion ": ["bash", "fish", "powershell", "tcsh", "zsh"],
        "recording f": ["fit"],
        "recording fit link.csv --delay": ["--delay", "--delay-unit"],
        "study load --executor ": ["dask", "local"],
        "list schema -o my": ["my_folder", "my_model.yaml"],
        "run --debu": ["--debug"],
    }
    found = {line: in_bash(text, line or '""', tmp_path) for line in offers}
    assert found == offers


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_read_theirs(shell: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    text = script(shell, capsys)
    for name in (*packaged_models(), *packaged_disturbances(), *(each.name for each in commands())):
        assert name in text
    if (found := shutil.which(shell)) is not None:
        (tmp_path / "script").write_text(text)
        subprocess.run([found, "-n", str(tmp_path / "script")], check=True)


def test_every_option_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    """The scripts have everything that the commands' own help has."""
    texts = {shell: script(shell, capsys) for shell in ("bash", "zsh", "fish")}
    for each in commands():
        with pytest.raises(SystemExit):
            main([each.name, "--help"])
        for flag in set(re.findall(r"^  (?:-\w, |-\w \S+, )?(--[a-z-]+)", capsys.readouterr().out, re.M)):
            assert flag in texts["bash"]
            assert flag in texts["zsh"]
            assert f" -l {flag[2:]} " in texts["fish"]
