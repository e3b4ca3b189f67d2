"""Commands of installed packages: found by their entry points, imported when they are called or listed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main
from epicycle.runner.interface.commands import COMMANDS, commands
from tests.catalogue.test_catalogue import install

GREET = """
from epicycle.runner.interface.commands import DONE, command, option, tell
@command("say hello, 100 % of it", option("name", help="to whom"), imports=())
def greet(options):
    tell(f"hello {options.name}")
    return DONE
"""


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder whose packages are installed while the test runs."""
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("acme_")]:
        del sys.modules[name]


def test_a_command_of_a_package(site: Path, capsys: pytest.CaptureFixture[str]) -> None:
    install(site, "acme_a", GREET, commands="greet = acme_a:greet")
    assert main(["greet", "world"]) == 0
    assert capsys.readouterr() == ("hello world\n", "")
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "  greet       say hello, 100 % of it\n" in capsys.readouterr().out


def test_nothing_is_imported_for_our_own_commands(site: Path, capsys: pytest.CaptureFixture[str]) -> None:
    install(site, "acme_a", "raise SystemExit(7)", commands="run = acme_a:run\nrepair = acme_a:repair")
    assert commands(["--debug", "list"]) is COMMANDS
    assert main(["completion", "bash"]) == 0
    assert [each.name for each in commands()].count("run") == 1
    assert next(each for each in commands() if each.name == "run") is COMMANDS[0]


@pytest.mark.parametrize(
    ("source", "points", "reason"),
    [
        ("raise SystemExit(7)", "greet = acme_a:greet", "of the package 'acme-a' cannot be loaded: SystemExit: 7"),
        (
            GREET.replace("def greet", "def meet"),
            "greet = acme_a:meet",
            "of the package 'acme-a' cannot be used: acme_a:meet: expected a Command that is called 'greet'",
        ),
        ("greet = print", "greet = acme_a:greet",
         "of the package 'acme-a' cannot be used: acme_a:greet: expected a Command that is called 'greet'"),
    ],
)  # fmt: skip
def test_a_command_that_cannot_be_had(
    site: Path, source: str, points: str, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It says why when it is called, and does not disturb the others."""
    install(site, "acme_a", source, commands=points)
    assert main(["greet"]) == 2
    assert capsys.readouterr() == ("", f"error: command 'greet' {reason}\n")
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "  greet       (cannot be loaded)\n" in capsys.readouterr().out


def test_a_command_that_two_packages_offer(site: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("acme_a", "acme_b"):
        install(site, name, GREET, commands=f"greet = {name}:greet")
    assert main(["greet"]) == 2
    told = "error: command 'greet' is offered by the packages 'acme-a' and 'acme-b': uninstall one of them\n"
    assert capsys.readouterr() == ("", told)


def test_a_list_of_commands_that_cannot_be_read(site: Path, capsys: pytest.CaptureFixture[str]) -> None:
    install(site, "acme_a", GREET)
    (site / "acme_a-1.0.dist-info" / "entry_points.txt").write_bytes(b"[epicycle.commands]\ngreet\n")
    with pytest.raises(SystemExit):
        main(["--help"])
    told = capsys.readouterr()
    assert told.err.startswith("warning: the commands of installed packages cannot be read: ")
    assert "  run         run a model" in told.out
