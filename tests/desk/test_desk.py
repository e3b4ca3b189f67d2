"""What the desk says about a text while somebody writes it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from lsprotocol import types as lsp

from epicycle.runner.desk import Knowledge, read
from epicycle.runner.desk.answers import Answers
from epicycle.runner.desk.changes import RenameError, apply, edits_between, fix_all, rename, texts_after
from epicycle.runner.desk.completion import complete
from epicycle.runner.desk.meaning import definition, hover, links, references
from epicycle.runner.interface.cli import main
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.text.kinds import KINDS, Kind
from epicycle.runner.model.text.problems import ModelError
from tests.bad_models.test_bad_models import FOLDER
from tests.desk.desk_parts import MODELS, NAME, folder_with_model, offset
from tests.desk.kinds_page import example

SMALL = """model: two_bodies
parameters:
  loss: {value: 0.2, min: 0, max: 1, doc: probability that a tick is lost}
actors:
  clock: {type: Clock, period: 500 ms}
  left: {type: CircularMotion, start: [0, 1]}  # the first
  right: {type: CircularMotion, start: [0, -1]}
connections:
  - clock.output -> left.trigger
  - {from: clock.output, to: right.trigger, delay: 100 ms}
aspects:
  lossy: {type: PacketLoss, probability: "${loss}", at: "*.trigger"}
run: {stop: 10 s, seed: 1, record: [left.state, right.state]}
metrics:
  heard: {of: left.state, take: count, doc: ticks that came through}
"""

# -- problems ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [each for each in KINDS.values() if each.example], ids=lambda kind: kind.code)
def test_the_example_of_a_kind_has_it(kind: Kind) -> None:
    found = example(kind)
    assert kind in [each.kind for each in found.problems]
    assert {each.severity == "error" for each in found.problems} == {kind.code.startswith("E")}


def test_only_what_no_model_can_show_has_no_example() -> None:
    assert [each.code for each in KINDS.values() if not each.example] == ["E0001", "E0901"]


# One is a file of composite classes, which is right.
BAD = sorted(each for each in FOLDER.glob("*.yaml") if each.stem != "no_model_but_parts")


@pytest.mark.parametrize(
    "path",
    [pytest.param(each, id=each.stem, marks=[pytest.mark.slow] * (place % 8 > 0)) for place, each in enumerate(BAD)],
)
def test_problems_are_those_of_validate(path: Path) -> None:
    try:
        expected = (*(), *load_model(path).warnings)
    except ModelError as error:
        expected = error.problems
    found = read(path)
    errors = tuple(each for each in found.problems if each.severity == "error")
    assert (errors or found.problems) == expected
    assert "E0001" not in [each.kind.code for each in found.problems]


def test_validate_prints_codes_and_fixes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.yaml").write_text(SMALL.replace("start: [0, 1]}", "strat: [0, 1]}"))
    assert main(["validate", "--json", "m.yaml"]) == 2
    assert json.loads(capsys.readouterr().out) == {
        "valid": False,
        "problems": [
            {
                "code": "E0302",
                "kind": "an unknown parameter",
                "severity": "error",
                "message": "left: CircularMotion has no parameter 'strat', did you mean 'start'?",
                "file": "m.yaml",
                "line": 6,
                "column": 32,
                "length": 5,
                "help": ["valid parameters: start, speed, turn_rate, heading"],
                "fix": {"file": "m.yaml", "line": 6, "column": 32, "length": 5, "text": "start"},
            }
        ],
        "more": False,
    }
    assert main(["validate", "--json", "mm1"]) == 0
    assert json.loads(capsys.readouterr().out) == {"valid": True, "problems": [], "more": False}
    Path("m.yaml").write_text("study: s\nmodel: mm1\nreplications: 2\nvary: {laod: [0.5]}\n")
    assert main(["validate", "--json", "m.yaml"]) == 2
    assert [each["code"] for each in json.loads(capsys.readouterr().out)["problems"]] == ["E0802"]


def mended(path: Path, text: str) -> str:
    """A text with all fixes made."""
    knowledge = Knowledge(read(path, {path.resolve(): text}))
    return texts_after(knowledge.reading, fix_all(knowledge)).get(path, text)


WRONG = (
    ("period: 500 ms", "perod: 500 ms"),
    ("period: 500 ms", "period: 500 m"),
    ("type: CircularMotion, start: [0, 1]", "type: CirclarMotion, start: [0, 1]"),
    ("-> left.trigger", "-> left.triger"),
    ("-> left.trigger", "-> lefft.trigger"),
    ('"${loss}"', '"${los}"'),
    ('at: "*.trigger"', 'at: "*.triger"'),
    ("record: [left.state", "record: [left.stat"),
    ("take: count", "tke: count"),
    ("stop: 10 s", "stp: 10 s"),
    ("of: left.state", "of: left.stte"),
    ("{type: PacketLoss,", "{type: PacketLos,"),
    ("doc: ticks that came through", "doc: ticks, or some of them, that came through"),
    ("doc: ticks that came through", "doc: seen (once, twice, 3)"),
)


@pytest.mark.parametrize(("right", "wrong"), WRONG, ids=[wrong for _, wrong in WRONG])
def test_a_fix_removes_its_problem(right: str, wrong: str, tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    text = SMALL.replace(right, wrong, 1)
    assert not read(path, {path.resolve(): text}).is_valid
    after = mended(path, text)
    assert read(path, {path.resolve(): after}).problems == ()
    assert "# the first" in after


@pytest.mark.parametrize(
    ("before", "behind"),
    [
        ("clock: {type: Clock}", "clock: {type: Clock, period: 1 s}"),
        ("clock:\n    type: Clock\n    count: 1", "clock:\n    type: Clock\n    period: 1 s\n    count: 1"),
    ],
)
def test_a_missing_parameter_gets_a_value(before: str, behind: str, tmp_path: Path) -> None:
    text = f"model: m\nactors:\n  {before}\n"
    assert mended(tmp_path / "m.yaml", text) == f"model: m\nactors:\n  {behind}\n"


# -- completion -------------------------------------------------------------------------------------------------------

COMPLETIONS = (
    ("type: Clock, period: 500 ms}", "type: Clo|", {"Clock": 3, "PoissonClock": 3}),
    ("type: Clock, period: 500 ms}", "type: Clock, pe|", {"period: ": 2, "offset: ": 2}),
    ("period: 500 ms}", "period: 500 |}", {"ms": 0, "s": 0}),
    ("period: 500 ms}", "period: 500|", {" ms": 0}),
    ("-> left.trigger", "-> left.|", {"trigger": 0}),
    ("- clock.output -> left.trigger", "- cl|", {"clock": 2}),
    ("- clock.output -> left.trigger", "- clock.output -> |", {"left": 0, "right": 0}),
    ('"*.trigger"', '"*.|"', {"trigger": 0}),
    ('"*.trigger"', '"|"', {"*": 0, "left": 0}),
    ("take: count", "take: |", {"count": 0, "mean": 0}),
    ("of: left.state", "of: left.|", {"state": 0}),
    ('"${loss}"', '"${lo|', {"loss": 2, "sqrt": 2}),
    ("run: {stop: 10 s, seed: 1, record: [left.state, right.state]}", "run:\n  st|", {"stop: ": 2, "stop_when: ": 2}),
    ("  left: {type: CircularMotion, start: [0, 1]}", "  left:\n    type: CircularMotion\n    |", {"speed: ": 0}),
    ("metrics:", "met|", {"monitors: ": 3}),
    ("delay: 100 ms", "delay: 100 |", {"ms": 0}),
    ("{type: PacketLoss", "{type: |", {"PacketLoss": 0, "GilbertElliott": 0}),
)


@pytest.mark.parametrize(("old", "new", "expected"), COMPLETIONS, ids=[new for _, new, _ in COMPLETIONS])
def test_completion(old: str, new: str, expected: dict[str, int], tmp_path: Path) -> None:
    path, text = tmp_path / "m.yaml", SMALL.replace(old, new, 1)
    here = offset(text, text[: text.index("|")], "|")
    found = complete(path, here, {path.resolve(): text.replace("|", "", 1)})
    assert expected.items() <= {each.text: each.replaces for each in found}.items()


def test_completion_says_what_a_path_matches(tmp_path: Path) -> None:
    path, text = tmp_path / "m.yaml", SMALL.replace('"*.trigger"', '"*."')
    here = offset(text, '"*.', '"')
    found = {each.text: each.what for each in complete(path, here, {path.resolve(): text})}
    assert (found["trigger"], "left" in found) == ("matches 3 ports", False)  # nothing is *.left


def test_completion_knows_composites_and_what_they_declare(tmp_path: Path) -> None:
    path = folder_with_model(tmp_path)
    text = path.read_text(encoding="utf-8")

    def found(before: str, written: str) -> set[str]:
        changed = text.replace(before, before + written, 1)
        return {each.text for each in complete(path, offset(changed, before + written), {path.resolve(): changed})}

    assert {"patience: ", "vague: "} <= found("    type: Observer\n", "    pa")
    assert {"RadioRobot", "MobileRobot"} <= found("  base:\n    type: ", "")
    assert {"controller", "estimator", "sensor"} <= found("      - roles.mode -> role, controller.role\n", "      - ")
    assert {"sent_plans", "role"} <= found("  - base.sent_plans -> news.input\n", "  - observer[0].")


def test_a_place_in_a_broken_text_is_none_or_completed(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    assert "model: " in {each.text for each in complete(path, 2, {path.resolve(): "mo"})}
    assert "model: " in {each.text for each in complete(path, 0, {path.resolve(): ""})}
    assert complete(path, 3, {path.resolve(): "\x00{{{"}) == []


# -- what stands there ------------------------------------------------------------------------------------------------


def known(path: Path, text: str | None = None) -> Knowledge:
    return Knowledge(read(path, {} if text is None else {path.resolve(): text}))


def test_hover(tmp_path: Path) -> None:
    knowledge = known(tmp_path / "m.yaml", SMALL)

    def said(before: str, behind: str) -> str:
        return hover(knowledge, offset(SMALL, before, behind))

    assert said("-> le", "ft.trigger") == (
        "**left**: actor, `CircularMotion`\n\n"
        "A body on a circle of radius `speed / turn_rate` (Table III), computed from the time alone"
    )
    assert said('"${lo', 'ss}"') == (
        "**loss**: parameter = `0.2` (line 3)\n\n>= 0 and <= 1\n\nprobability that a tick is lost\n\n"
        "Probability that a message is lost (number)"
    )
    assert "value of `clock`: `0.5` s" in said("per", "iod: 500 ms")
    assert said("he", "ard:").startswith("**heard**: metric: count of left.state")
    assert said("los", "sy:").endswith("\n\nat `clock.trigger`, `left.trigger`, `right.trigger`")
    assert "Time at which a run ends" in said("run: {st", "op")
    assert said("-> left.trig", "ger").startswith("**trigger**: input of left, any: sends the state now")
    assert said("clock.out", "put -> left").startswith("**output**: output of clock, any: the values in turn")
    assert said("take: co", "unt").endswith("`count`: how many there are (tokens)")
    assert hover(knowledge, len(SMALL)) == ""


def test_definition_and_references(tmp_path: Path) -> None:
    path = folder_with_model(tmp_path)
    text = path.read_text(encoding="utf-8")
    knowledge = known(path)
    (found,) = definition(knowledge, offset(text, 'at: "*.sen', 'sor.measurement"\n\nmonitors'))
    assert (Path(found.file).name, found.source.strip()[:7]) == ("mobile_robot.yaml", "sensor:")
    (found,) = definition(knowledge, offset(text, "  observer:\n    type: Obs", "erver\n"))
    assert (Path(found.file).name, found.source) == (NAME, "  Observer:")
    (found,) = definition(knowledge, offset(text, "include: robots/mob", "ile"))
    assert Path(found.file).name == "mobile_robot.yaml"
    assert [(at.source, at.column, at.length, path.name) for at, path in links(knowledge)] == [
        ("include: robots/mobile_robot.yaml", 10, 24, "mobile_robot.yaml")
    ]
    lines = [each.line for each in references(knowledge, offset(text, "  con", "tact:\n    type"))]
    written = [number for number, line in enumerate(text.splitlines(), 1) if "contact." in line]
    assert sorted(set(lines)) == sorted({*written, text.splitlines().index("  contact:") + 1})
    assert definition(knowledge, 0) == references(knowledge, 0) == []


def test_links_lead_to_the_files_that_are_named(tmp_path: Path) -> None:
    def found(name: str, text: str) -> list[tuple[str, int, int, str]]:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return [(at.source, at.column, at.length, to.name) for at, to in links(known(path))]

    named = [("extends: mm1", 10, 3, "mm1.yaml")]
    assert found("one.yaml", "model: one\nextends: mm1\n") == named
    assert found("mm1.yaml", "model: mm1\ninclude: [one.yaml, none.yaml]\n") == [
        ("include: [one.yaml, none.yaml]", 11, 8, "one.yaml")
    ]
    assert found("two.yaml", "study: two\nmodel: mm1\nvary: {load: [0.5]}\n") == [("model: mm1", 8, 3, "mm1.yaml")]
    assert found("broken.yaml", "model: [\nextends: mm1\n") == []
    (tmp_path.parent / "outside.yaml").write_text("model: outside\n")
    assert found("far.yaml", "model: far\nextends: ../outside.yaml\ninclude: ../outside.yaml\n") == []
    assert found("odd.yaml", 'model: odd\ninclude: ["\\0", "", "."]\n') == []


def test_symbols() -> None:
    answers, path = Answers(), MODELS / NAME
    answers.change(path, path.read_text(encoding="utf-8"))
    document = lsp.TextDocumentIdentifier(path.resolve().as_uri())
    found = answers.ask(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL, lsp.DocumentSymbolParams(document))
    assert [each.name for each in found] == [
        "model", "doc", "include", "parameters", "composites", "actors", "connections", "run", "aspects", "monitors",
        "metrics", "figures",
    ]  # fmt: skip
    composites = next(each for each in found if each.name == "composites")
    assert [each.name for each in composites.children] == ["RadioRobot", "Main", "Observer"]
    inside = next(each for each in composites.children[1].children if each.name == "actors")
    assert [(each.name, each.detail) for each in inside.children] == [("legs", "actor"), ("controller", "actor")]


# -- names ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("before", "behind", "new", "count"),
    [
        ('at: "*.sen', 'sor.measurement"\n\nmonitors', "eye", {"mobile_robot.yaml": 10, NAME: 3}),
        ("  obser", "ver:\n    type: Observer", "scout", {}),
        ("  con", "tact:\n    type", "link_to_base", {}),
        ("  re", "ach: {value", "radio_reach", {}),
        ("  Radio", "Robot:\n", "Repeater", {}),
        ("    outputs: [sent", "_plans, sent", "plans_sent", {}),
    ],
)
def test_rename(before: str, behind: str, new: str, count: dict[str, int], tmp_path: Path) -> None:
    path = folder_with_model(tmp_path)
    text = path.read_text(encoding="utf-8")
    knowledge = known(path)
    edits = rename(knowledge, offset(text, before, behind), new)
    for file, changed in texts_after(knowledge.reading, edits).items():
        file.write_text(changed, encoding="utf-8")
    after = load_model(path)
    assert after.extent == load_model(MODELS / NAME).extent
    assert len(edits) > 1
    for name, number in count.items():
        assert sum(each.path.name == name for each in edits) >= number - 9
    lines = [len(each.read_text(encoding="utf-8").splitlines()) for each in (path, MODELS / NAME)]
    assert lines[0] == lines[1]


@pytest.mark.parametrize(
    ("before", "behind", "new", "message"),
    [
        ("-> le", "ft.trigger", "right", "there is already a 'right' there"),
        ("-> le", "ft.trigger", "1st", "'1st' is not a name: use letters, digits and _, and no digit first"),
        ("-> left.trig", "ger", "go", "there is no name here that can be changed"),
        ("stop: 1", "0 s", "go", "there is no name here that can be changed"),
    ],
)
def test_a_name_that_cannot_be_changed(before: str, behind: str, new: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(RenameError, match=f"^{message}$"):
        rename(known(tmp_path / "m.yaml", SMALL), offset(SMALL, before, behind), new)


def test_a_name_that_a_pattern_shares_is_not_changed(tmp_path: Path) -> None:
    text = """model: m
composites:
  A: {inputs: [go], actors: {sink: {type: Recorder}}, connections: [go -> sink.input]}
  B: {inputs: [go], actors: {sink: {type: Recorder}}, connections: [go -> sink.input]}
actors: {clock: {type: Clock, period: 1 s}, a: {type: A}, b: {type: B}}
connections: [clock.output -> a.go, clock.output -> b.go]
aspects: {loss: {type: PacketLoss, probability: 0.5, at: "*.sink.input"}}
run: {stop: 2 s}
"""
    path = tmp_path / "m.yaml"
    knowledge = known(path, text)
    assert knowledge.reading.problems == ()
    here = offset(text, "A: {inputs: [go], actors: {si", "nk")
    with pytest.raises(RenameError) as found:
        rename(knowledge, here, "end", {path.resolve(): text})
    assert str(found.value) == (
        f"{path}:7:61: the name stands for several things: actor 'sink' of A and actor 'sink' of B; change it by hand"
    )


def test_edits_keep_ends_of_lines(tmp_path: Path) -> None:
    text = "model: m\r\nactors:\n  clock: {typ: Clock, period: 1 s}\r\n"
    assert mended(tmp_path / "m.yaml", text) == text.replace("typ:", "type:")


@pytest.mark.parametrize(
    ("before", "after", "count"),
    [
        ("", "a\n", 1),
        ("a\nb\nc\n", "a\nx\nc\n", 1),
        ("a\nb\nc\n", "c\n", 1),
        ("aba", "ababa", 1),
        ("x: 1\ny: 1\n", "x: 2\ny: 2\n", 1),
    ],
)
def test_edits_make_one_text_of_another(before: str, after: str, count: int) -> None:
    found = edits_between(Path("m.yaml"), before, after)
    assert apply(before, found) == after
    assert len(found) == count
    assert edits_between(Path("m.yaml"), after, after) == []


def test_a_run_imports_no_desk(tmp_path: Path) -> None:
    script = (
        "import sys; from epicycle.runner.interface.cli import main\n"
        "words = ('desk', 'pygls', 'studio', 'starlette', 'uvicorn', 'websockets')\n"
        f"code = main(['run', 'mm1', '--until', '10', '--out', {str(tmp_path)!r}])\n"
        "try: main(['--help'])\n"
        "except SystemExit: print(code, [each for each in sys.modules if any(w in each for w in words)])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 []"
