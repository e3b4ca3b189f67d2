"""Options that a command does not have are refused by it, with those that it has."""

from __future__ import annotations

import pytest

from epicycle.runner.interface.cli import main


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (
            "completion bash --bogus 3",
            (
                "usage: epicycle completion [-h] [--debug] {bash,zsh,fish,tcsh,powershell}\n"
                "epicycle completion: error: unrecognized arguments: --bogus 3\n"
            ),
        ),
        (
            "status results --bogus",
            (
                "usage: epicycle status [-h] [--conditions] [--json] [--debug] DIR\n"
                "epicycle status: error: unrecognized arguments: --bogus\n"
            ),
        ),
        (
            "status results --condition --jsn",
            (
                "usage: epicycle status [-h] [--conditions] [--json] [--debug] DIR\n"
                "epicycle status: error: unrecognized arguments: --jsn, did you mean '--json'?\n"
            ),
        ),
        (
            "completion --debig=3",
            (
                "usage: epicycle completion [-h] [--debug] {bash,zsh,fish,tcsh,powershell}\n"
                "epicycle completion: error: unrecognized arguments: --debig, did you mean '--debug'?\n"
            ),
        ),
        (
            "recording fit link.csv and more",
            (
                "usage: epicycle recording fit [-h] [--at PORTS] [--time COLUMN] [--lost COLUMN] [--received COLUMN] "
                "[--delay COLUMN] [--sequence COLUMN] [--wraps N] [--delay-unit {s,ms,us,ns}] [-o FILE] [--json] "
                "[--debug] TRACE\nepicycle recording fit: error: unrecognized arguments: and more\n"
            ),
        ),
    ],
)
def test_the_command_tells_its_own_options(
    given: str, told: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    with pytest.raises(SystemExit) as ended:
        main(given.split())
    assert ended.value.code == 2
    assert capsys.readouterr().err == told
