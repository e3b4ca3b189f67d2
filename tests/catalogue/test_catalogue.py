"""Types of other packages: found by their entry points, imported when a model names them, never a traceback."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from epicycle.runner.execution.engine import Simulation
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.catalogue.figure import own_figures
from epicycle.runner.model.catalogue.like import dialects
from epicycle.runner.model.catalogue.reference import TOPICS, describe, doc_of
from epicycle.runner.model.catalogue.types import CatalogueError, Types, _offered, built_in, figure_types, installed
from epicycle.runner.model.language.study import read_study
from epicycle.runner.model.text.problems import ModelError
from epicycle.runner.show.report import check_figures
from epicycle.runner.study.plan.plan import Plan

THIRD_PARTY = Path(__file__).parents[1] / "third_party"
GOOD = """
from epicycle.actors import Actor
class Lidar(Actor):
    '''Looks.'''
    def fire(self): pass
"""
MODEL = """\
model: weather
actors:
  clock: {type: Clock, period: 1}
  outside: {type: Thermometer, start: 270 K, rise: 1 K/s}
connections: [clock.output -> outside.trigger]
aspects: {icing: {type: Icing, at: outside.temperature}}
run: {stop: 5, record: outside.temperature}
metrics: {coldest: {of: outside.temperature, take: min}, last: {of: outside.temperature}}
figures: {span: {type: Extremes, signal: outside.temperature}}
"""
STUDY = """\
study: icy
model: ./weather.yaml
figures: {runs: {type: acme_sensing.Ladder, metric: coldest, doc: Coldest of all}}
"""


def install(folder: Path, name: str, source: str, **groups: str) -> None:
    """Put a package where it looks installed: a module ``name`` and entry points ``Name = module:Class`` by group."""
    (folder / f"{name}.py").write_text(source, encoding="utf-8")
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name.replace('_', '-')}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("".join(f"[epicycle.{g}]\n{lines}\n" for g, lines in groups.items()))


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder whose packages are installed while the test runs."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.chdir(tmp_path)
    installed.cache_clear()
    _offered.cache_clear()
    yield folder
    installed.cache_clear()
    _offered.cache_clear()
    for name in [name for name in sys.modules if name.startswith("acme_")]:
        del sys.modules[name]


def error_of(actor: str = "", aspect: str = "") -> str:
    """What is said about a model with such an actor or aspect."""
    lines = ["model: m", *([f"actors: {{a: {{type: {actor}}}}}"] if actor else [])]
    lines += [f"aspects: {{x: {{type: {aspect}, at: a.b}}}}"] if aspect else []
    Path("m.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        load_model("./m.yaml")
    return str(caught.value)


def test_entry_points_that_cannot_be_read(site: Path) -> None:
    install(site, "acme_garbled", GOOD)
    (site / "acme_garbled-1.0.dist-info" / "entry_points.txt").write_bytes(b"[epicycle.actors]\nLidar\n")
    with pytest.raises(CatalogueError) as caught:
        list(installed().actors)
    assert caught.value.message.startswith("the entry points of the package 'acme-garbled' cannot be read: ")
    assert caught.value.help == ("fix or uninstall 'acme-garbled'",)


def test_type_is_imported_when_a_model_names_it(site: Path) -> None:
    install(site, "acme_lidar", GOOD, actors="Lidar = acme_lidar:Lidar")
    install(site, "acme_bomb", "raise SystemExit('boom')", actors="Bomb = acme_bomb:Bomb")
    assert {"Lidar", "Bomb", "Clock"} <= set(installed().actors)
    assert "acme_lidar" not in sys.modules
    Path("m.yaml").write_text("model: m\nactors: {a: {type: Lidar}, b: {type: acme_lidar.Lidar}}\n", encoding="utf-8")
    actors = load_model("./m.yaml").graph.actors
    assert [type(actor).__name__ for actor in actors.values()] == ["Lidar", "Lidar"]
    assert "acme_bomb" not in sys.modules


@pytest.mark.parametrize(
    ("source", "entry", "reason"),
    [
        ("import no_such_module", "acme_a:Lidar", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("def broken(:", "acme_a:Lidar", "SyntaxError: invalid syntax (acme_a.py, line 1)"),
        ("raise SystemExit('boom')", "acme_a:Lidar", "SystemExit: boom"),
        ("", "acme_a:Lidar", "AttributeError: module 'acme_a' has no attribute 'Lidar'"),
        ("Lidar = 3", "acme_a:Lidar", "acme_a:Lidar is not a complete subclass of Actor"),
        ("class Lidar: pass", "acme_a:Lidar", "acme_a:Lidar is not a complete subclass of Actor"),
        (GOOD, "acme_a", "its entry point is not of the form package.module:Class"),
        (
            GOOD.replace("Lidar", "Radar"),
            "acme_a:Radar",
            "the class is called Radar, and its entry point must have the same name",
        ),
    ],
)
def test_broken_package_is_named(source: str, entry: str, reason: str, site: Path) -> None:
    install(site, "acme_a", source, actors=f"Lidar = {entry}")
    assert error_of("Lidar") == (
        f"m.yaml:2:20: error: a: actor 'Lidar' of the package 'acme-a' cannot be loaded: {reason}\n"
        "    2 | actors: {a: {type: Lidar}}\n"
        "      |                    ^^^^^\n"
        f"   help: its entry point in the group epicycle.actors is Lidar = {entry}\n"
        "   help: fix or uninstall 'acme-a'"
    )
    catalogue, errors = installed().loaded()
    assert "Lidar" not in catalogue.actors
    assert "Clock" in catalogue.actors
    assert [error.message for error in errors] == [f"actor 'Lidar' of the package 'acme-a' cannot be loaded: {reason}"]


def test_broken_figure_is_named(site: Path) -> None:
    install(site, "acme_a", "1 / 0", figures="Dial = acme_a:Dial", study_figures="Dial = acme_a:Dial")
    Path("m.yaml").write_text("model: m\nfigures: {x: {type: Dial}, y: {type: Dail}}\n", encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        load_model("./m.yaml")
    valid = "Dial, Histogram, TimeSeries, Trajectories"
    assert str(caught.value) == (
        "m.yaml:2:21: error: figure x: figure 'Dial' of the package 'acme-a' cannot be loaded: "
        "ZeroDivisionError: division by zero\n"
        "    2 | figures: {x: {type: Dial}, y: {type: Dail}}\n"
        "      |                     ^^^^\n"
        "   help: its entry point in the group epicycle.figures is Dial = acme_a:Dial\n"
        "   help: fix or uninstall 'acme-a'\n\n"
        "m.yaml:2:38: error: figure y: there is no figure type 'Dail', did you mean 'Dial'?\n"
        "    2 | figures: {x: {type: Dial}, y: {type: Dail}}\n"
        "      |                                      ^^^^\n"
        f"   help: valid types: {valid}\n"
        "2 errors in m.yaml"
    )
    Path("s.yaml").write_text("study: s\nmodel: mm1\nfigures: {x: {type: Dial}}\n", encoding="utf-8")
    with pytest.raises(ModelError, match="study figure 'Dial' of the package 'acme-a' cannot be loaded"):
        check_figures(Plan.made(read_study("./s.yaml")))


def test_figure_of_a_package_goes_by_its_entry_point(site: Path) -> None:
    source = "from epicycle.runner.show import Figure\nclass Dial(Figure):\n    def signal_patterns(self): return ()\n"
    install(site, "acme_a", source, figures="Dial = acme_a:Dial")
    install(site, "acme_b", source, figures="Dial = acme_b:Dial")
    assert figure_types()["acme_a.Dial"].__module__ == "acme_a"
    with pytest.raises(CatalogueError, match="figure type 'Dial' is offered by the packages 'acme-a' and 'acme-b'"):
        figure_types()["Dial"]  # although the class of one of them is there by now


def test_broken_aspect_is_named(site: Path) -> None:
    install(site, "acme_a", "1 / 0", aspects="Fog = acme_a:Fog")
    assert error_of(aspect="Fog") == (
        "m.yaml:2:21: error: aspect x: aspect 'Fog' of the package 'acme-a' cannot be loaded: "
        "ZeroDivisionError: division by zero\n"
        "    2 | aspects: {x: {type: Fog, at: a.b}}\n"
        "      |                     ^^^\n"
        "   help: its entry point in the group epicycle.aspects is Fog = acme_a:Fog\n"
        "   help: fix or uninstall 'acme-a'"
    )


def test_name_of_two_packages_must_be_qualified(site: Path) -> None:
    install(site, "acme_a", GOOD, actors="Lidar = acme_a:Lidar")
    install(site, "acme_b", GOOD, actors="Lidar = acme_b:Lidar")
    assert error_of("Lidar") == (
        "m.yaml:2:20: error: a: actor type 'Lidar' is offered by the packages 'acme-a' and 'acme-b'\n"
        "    2 | actors: {a: {type: Lidar}}\n"
        "      |                    ^^^^^\n"
        "   help: write acme_a.Lidar or acme_b.Lidar"
    )
    Path("m.yaml").write_text("model: m\nactors: {a: {type: acme_b.Lidar}}\n", encoding="utf-8")
    assert type(load_model("./m.yaml").graph.actors["a"]).__module__ == "acme_b"
    names = set(installed().actors)
    assert {"acme_a.Lidar", "acme_b.Lidar"} <= names
    assert "Lidar" not in names


DIALECTS = """
from epicycle.runner.model.catalogue import Dialect
from epicycle.runner.execution.engine import Director
class Odd(Dialect):
    name = "odd"
    @classmethod
    def director(cls): return cls.made
    made = type("OddDirector", (Director,), {})
class Even(Odd):
    name = "even"
    made = type("EvenDirector", (Director,), {})
"""


def error_of_dialect(name: str, more: str = "") -> str:
    """What is said about a model with such a dialect."""
    Path("m.yaml").write_text(f"model: m\ndirector: {{like: {name}}}\n{more}", encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        load_model("./m.yaml")
    return str(caught.value)


def test_a_dialect_that_cannot_be_loaded(site: Path) -> None:
    install(site, "acme_a", "1 / 0", dialects="odd = acme_a:Odd\neven = acme_a:Even")
    assert error_of_dialect("odd") == (
        "m.yaml:2:18: error: m: director.like: dialect 'odd' of the package 'acme-a' cannot be loaded: "
        "ZeroDivisionError: division by zero; its entry point in the group epicycle.dialects is odd = acme_a:Odd; "
        "fix or uninstall 'acme-a'\n"
        "    2 | director: {like: odd}\n"
        "      |                  ^^^"
    )
    assert error_of_dialect("evn").splitlines()[0] == (
        "m.yaml:2:18: error: m: director.like: 'evn' is not one of "
        f"{', '.join(sorted(dialects()))}, did you mean 'even'?"
    )


def test_a_dialect_with_another_name(site: Path) -> None:
    install(site, "acme_a", DIALECTS, dialects="strange = acme_a:Odd")
    assert "the class is called odd, and its entry point must have the same name" in error_of_dialect("strange")


def test_a_model_has_one_director(site: Path) -> None:
    install(site, "acme_a", DIALECTS, dialects="odd = acme_a:Odd\neven = acme_a:Even")
    parts = "composites: {C: {director: {like: even}}, D: {director: {}}}\nactors: {c: {type: C}, d: {type: D}}\n"
    assert error_of_dialect("odd", parts) == (
        "m.yaml:4:10: error: c is like even, but other parts of the model are like odd\n"
        "    4 | actors: {c: {type: C}, d: {type: D}}\n"
        "      |          ^\n"
        "   help: a run has one director, and each of these has its own"
    )
    Path("m.yaml").write_text(f"model: m\ndirector: {{like: odd}}\n{parts.replace('even', 'odd')}", encoding="utf-8")
    director = Simulation(load_model("./m.yaml")).director
    assert type(director).__name__ == "OddDirector"


def test_own_name_means_the_own_type(site: Path) -> None:
    install(site, "acme_a", GOOD.replace("Lidar", "Clock"), actors="Clock = acme_a:Clock")
    types = installed().actors
    assert types["Clock"].__module__ == "epicycle.actors.sources"
    assert types["acme_a.Clock"].__module__ == "acme_a"
    assert len(types) == len(set(types)) == len(dict(types))


def test_unknown_name_is_no_type() -> None:
    types = installed().actors
    assert isinstance(types, Types)
    assert types.get("Clok") is None
    assert "acme_a.Clock" not in types
    with pytest.raises(KeyError):
        types["Clok"]


def test_errors_can_be_copied() -> None:
    error = CatalogueError("what", "help", "more")
    assert str(error) == "what\n   help: help\n   help: more"
    assert str(CatalogueError(*error.args)) == str(error)


# -- the package in third_party, installed --------------------------------------------------------------------------


def epicycle(site: Path, *arguments: str) -> str:
    """What the command line prints when the packages in a folder are installed."""
    path = os.pathsep.join([str(site), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-m", "epicycle.runner.interface.cli", *arguments],
        capture_output=True,
        text=True,
        cwd=site,
        env={**os.environ, "PYTHONPATH": path},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def check_installed(site: Path) -> None:
    """The package shows up in the reference, in the schema and in a run."""
    assert "acme_sensing  Weather: a thermometer, and ice on it; a dialect and a command" in epicycle(site, "actors")
    (icing,) = [each for each in json.loads(epicycle(site, "aspects", "--json")) if each["name"] == "Icing"]
    assert (icing["stands_at"], icing["events"], icing["parameters"][0]["default"]) == (["output"], ["frozen"], 273.15)
    schema = json.loads(epicycle(site, "schema"))
    assert schema["$defs"]["actor.Thermometer"]["properties"]["start"]["minimum"] == 0
    assert "Icing" in schema["$defs"]["aspect"]["properties"]["type"]["anyOf"][0]["enum"]
    assert "Extremes" in schema["$defs"]["figure"]["properties"]["type"]["enum"]
    (site / "weather.yaml").write_text(MODEL, encoding="utf-8")
    results = json.loads(epicycle(site, "run", "weather.yaml", "--json"))
    assert results["metrics"] == {"coldest": 273.15, "last": 275.0}
    assert results["aspects"] == {"icing": {"frozen": 4}}
    epicycle(site, "run", "weather.yaml", "--out", "once")
    assert (site / "once" / "span.png").read_bytes().startswith(b"\x89PNG")
    (site / "icy.yaml").write_text(STUDY, encoding="utf-8")
    epicycle(site, "study", "icy.yaml", "--out", "icy", "--jobs", "1")
    manifest = json.loads((site / "icy" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["sources"]["package acme-sensing"] == "1.0"  # another version, other runs
    epicycle(site, "report", "icy")
    assert "Coldest of all. </" in (site / "icy" / "report.html").read_text(encoding="utf-8").replace("<span", "</")
    assert (site / "icy" / "figures" / "runs.svg").is_file()
    assert "    coldest   say how cold it gets in a model\n" in epicycle(site, "--help")
    assert epicycle(site, "coldest", "weather.yaml") == "273.15 K\n"
    assert re.search("^  Const +Sends 7, unless it is told otherwise", epicycle(site, "actors", "--like", "acme"), re.M)
    model = "model: acme\ndirector: {like: NAME}\nactors: {one: {type: Const}, two: {type: Const, value: 2}}\n"
    for name, sent in (("epicycle", [["one", "1"], ["two", "2"]]), ("acme", [["two", "2"], ["one", "7"]])):
        (site / "acme.yaml").write_text(model.replace("NAME", name), encoding="utf-8")
        epicycle(site, "run", "acme.yaml", "--log", f"{name}.csv")
        with (site / f"{name}.csv").open(newline="", encoding="utf-8") as file:
            assert [[row["actor"], row["value"]] for row in csv.DictReader(file)] == sent


@pytest.mark.slow
def test_third_party_package_shows_up(tmp_path: Path) -> None:
    project = tomllib.loads((THIRD_PARTY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    groups = {
        group.removeprefix("epicycle."): "\n".join(f"{name} = {value}" for name, value in entries.items())
        for group, entries in project["entry-points"].items()
    }
    install(tmp_path, "acme_sensing", (THIRD_PARTY / "acme_sensing.py").read_text(encoding="utf-8"), **groups)
    check_installed(tmp_path)


@pytest.mark.slow
def test_third_party_package_installs_with_pip(tmp_path: Path) -> None:
    source, site = tmp_path / "source", tmp_path / "site"
    shutil.copytree(THIRD_PARTY, source, ignore=shutil.ignore_patterns("__pycache__"))
    options = ("--quiet", "--no-deps", "--no-build-isolation", "--disable-pip-version-check")
    subprocess.run([sys.executable, "-m", "pip", "install", *options, "--target", site, source], check=True)
    check_installed(site)


def test_every_type_of_epicycle_has_a_topic_and_every_topic_a_type() -> None:
    types = built_in()
    every = [*types.actors.items(), *types.aspects.items(), *own_figures().items()]
    groups = {describe(name, cls).group for name, cls in every if cls.__module__.startswith("epicycle.")}
    assert groups == {*TOPICS}


def test_a_docstring_that_is_no_text() -> None:
    assert doc_of(type("Thing", (), {"__doc__": 3})) == "3"


PART = """from epicycle.actors import Objective


class AcmeStay(Objective):
    def cost(self, trajectory, beliefs):
        return 0.0
"""


CONTROLLED = """model: m
actors:
  c: {type: Clock, period: 0.1 s}
  v: {type: Vehicle, start: [1, 2]}
  a: {type: RobustController, objective: {type: %s}, solver: {type: Casadi}}
connections:
  - c.output -> v.trigger, a.trigger
  - v.state -> a.state
  - {from: a.control, to: v.acceleration, delay: 0.1 s}
"""


def objective_of(name: str) -> Any:
    """The objective of a controller that names one."""
    Path("m.yaml").write_text(CONTROLLED % name, encoding="utf-8")
    actor: Any = load_model("./m.yaml").graph.actors["a"]
    return actor.objective


def test_a_part_is_imported_when_a_model_names_it(site: Path) -> None:
    install(site, "acme_stay", PART, parts="AcmeStay = acme_stay:AcmeStay")
    install(site, "acme_bomb", "raise SystemExit('boom')", parts="AcmeBomb = acme_bomb:AcmeBomb")
    list(installed().actors)
    assert "acme_stay" not in sys.modules
    assert type(objective_of("AcmeStay")).__name__ == "AcmeStay"
    assert "acme_bomb" not in sys.modules
    with pytest.raises(ModelError) as caught:
        objective_of("AcmeBomb")
    assert str(caught.value) == (
        "m.yaml:5:42: error: a.objective: part 'AcmeBomb' of the package 'acme-bomb' cannot be loaded: "
        "SystemExit: boom; its entry point in the group epicycle.parts is AcmeBomb = acme_bomb:AcmeBomb; fix or "
        "uninstall 'acme-bomb'\n"
        "    5 |   a: {type: RobustController, objective: {type: AcmeBomb}, solver: {type: Casadi}}\n"
        "      |                                          ^^^^^^^^^^^^^^^^"
    )
