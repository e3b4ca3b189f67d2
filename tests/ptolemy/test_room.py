"""The room as a whole: its README, its face, and what it lists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import epicycle.ptolemy
from epicycle.actors import Actor
from epicycle.aspects import Aspect
from epicycle.ptolemy.dialect import Ptolemy
from epicycle.runner import Simulation, load_model
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue.reference import describe
from epicycle.runner.model.catalogue.types import built_in

README = (Path(__file__).parents[2] / "ptolemy" / "README.md").read_text(encoding="utf-8")
TYPES = {each.__name__: each for each in Ptolemy.types()}
NEW = ("Dictionary", "Rician")  # Epicycle has none


def test_the_readme_has_every_type() -> None:
    table = README[README.index("| type | as in Ptolemy |") : README.index("What stays another way")]
    assert set(re.findall(r"`([A-Z]\w+)`", "".join(re.findall(r"^\| ([^|]*) \|", table, re.M)))) == set(TYPES)


def test_the_model_of_the_readme_does_what_it_says(tmp_path: Path) -> None:
    (block,) = re.findall(r"^```yaml\n(.*?)^```$", README, re.M | re.S)
    (tmp_path / "m.yaml").write_text(block, encoding="utf-8")
    results = Simulation(load_model(tmp_path / "m.yaml")).run()
    assert [(tag.seconds, tag.microstep) for tag in results.signals["delay.output"].tags] == [(1.0, 1), (1.0, 2)]


@pytest.mark.parametrize("name", TYPES)
def test_each_takes_the_place_of_one_of_epicycle_s(name: str) -> None:
    own, kind = built_in(), TYPES[name]
    there = own.actors.get(name) or own.aspects.get(name)
    if name in NEW:
        assert there is None
    else:
        assert there is not None
        assert issubclass(kind, there)
        assert kind is not there
    assert issubclass(kind, (Actor, Aspect))
    assert getattr(epicycle.ptolemy, name) is kind
    assert describe(name, kind).group == "ptolemy"


def test_the_face_has_no_other_names() -> None:
    assert epicycle.ptolemy.import_moml.__module__ == "epicycle.ptolemy.importing.imported"
    with pytest.raises(AttributeError, match=r"module 'epicycle\.ptolemy' has no attribute 'Quue'"):
        _ = epicycle.ptolemy.Quue


def test_commands_describe_the_types(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["describe", "--like", "ptolemy", "Queue"]) == 0
    assert "`size` is sent at the end of each firing, changed or not." in capsys.readouterr().out
    assert main(["list", "actors", "--like", "Ptolemy"]) == 2
    told = "error: --like 'Ptolemy' is not one of epicycle, ptolemy, did you mean 'ptolemy'?\n"
    assert capsys.readouterr() == ("", told)
    assert main(["list", "schema", "--like", "ptolemy"]) == 0
    assert '"generator"' in capsys.readouterr().out
    assert main(["describe", "--like", "ptolemy", "mm1"]) == 2
    told = "error: --like is for types: the directors in a model name their dialects themselves\n"
    assert capsys.readouterr() == ("", told)
