"""`epicycle list` and `epicycle describe`: what they print, for people and for programs."""

from __future__ import annotations

import json
import subprocess
import sys
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from epicycle.actors import Actor, InputPort, OutputPort, Parameter, array_parameter
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue.reference import TypeReference, describe, parts_of
from epicycle.runner.model.catalogue.types import built_in, installed
from epicycle.runner.show.reference import detail


class Gate(Actor):
    """Lets tokens through.  All of them.

    Those of ``input``, that is; an array such as [1] is
    as good as any.
    """

    __module__ = "acme.gates"

    input = InputPort(float | str, multi=True, doc="what comes")
    control = InputPort(Any, required=False, doc="opens it")
    output = OutputPort(float, depends_on=("input",), doc="what goes")
    late = OutputPort(float, depends_on=(), doc="what goes later")
    mode = Parameter(str, "open", choices=("open", "shut"), doc="how it begins")
    delay = Parameter(float, unit="s", min=0.0, doc="how long it takes")
    corner = array_parameter((2,), (0.5, 1.0), unit="m", max=3.0, doc="where it is")


GATE = """\
Gate  actor, acme

Lets tokens through. All of them.

Those of `input`, that is; an array such as [1] is as good as any.

input port  type                                  what it is
input       float | str  any number of connections  what comes
control     any          optional                   opens it

output port  type                            what it is
output       float  depends at once on input  what goes
late         float  depends at once on no input     what goes later

parameter  type                    unit  default   what it is
mode       open or shut                  open      how it begins
delay      number >= 0             s     required  how long it takes
corner     list of 2 numbers <= 3  m     [0.5, 1]  where it is
"""


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """What a command prints."""
    assert main(arguments) == 0
    return capsys.readouterr().out


def references() -> list[TypeReference]:
    """All that Epicycle itself declares."""
    own = built_in()
    types = [*own.actors.items(), *own.aspects.items()]
    parts = [each for known in parts_of([cls for _, cls in types]).values() for each in known.items()]
    ours = [(name, cls) for name, cls in parts if cls.__module__.startswith("epicycle.")]  # not of other tests
    return [describe(name, cls) for name, cls in (*types, *ours)]


@pytest.mark.parametrize("reference", references(), ids=lambda reference: reference.name)
def test_everything_has_a_doc(reference: TypeReference) -> None:
    assert reference.doc
    assert [each.name for each in (*reference.ports, *reference.parameters) if not each.doc] == []


@pytest.mark.parametrize("kind", ["actors", "aspects"])
def test_list_has_a_line_for_each_type(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = printed(capsys, "list", kind)
    known = getattr(installed(), kind)
    listed = [line.split()[0] for line in text.splitlines() if line.startswith("  ") and not line.startswith("   ")]
    assert sorted(listed) == sorted(known)
    assert {each["name"] for each in json.loads(printed(capsys, "list", kind, "--json"))} == set(known)


def test_one_type_in_words() -> None:
    console = Console(file=StringIO(), width=120)
    console.print(detail(describe("Gate", Gate), {}))
    words = [line.split() for line in console.file.getvalue().splitlines()]  # type: ignore[attr-defined]
    assert words == [line.split() for line in GATE.splitlines()]


def test_one_aspect_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    found = json.loads(printed(capsys, "describe", "PacketLoss", "--json"))
    assert (found["name"], found["kind"], found["group"]) == ("PacketLoss", "aspect", "communication")
    assert (found["stands_at"], found["events"]) == (["input"], ["dropped"])
    assert found["parameters"][0] == {
        "name": "probability",
        "type": "number",
        "part": "",
        "unit": "",
        "required": True,
        "optional": False,
        "default": None,
        "min": 0,
        "above": None,
        "max": 1,
        "choices": [],
        "doc": "probability that a message is lost",
    }


def test_parts_are_described_with_the_actor() -> None:
    # In processes of their own: the parts of other tests are known here.
    command = [sys.executable, "-m", "epicycle.runner.interface.cli", "describe", "RobustController"]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert "Inform  objective\n" in text
    assert "Casadi  solver\n" in text
    command.append("--json")
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    parts = json.loads(done.stdout)["parts"]
    assert {base: [each["name"] for each in known] for base, known in parts.items()} == {
        "Dynamics": ["DoubleIntegrator"],
        "Objective": ["Inform", "ReachGoal", "StayNear"],
        "Solver": ["Barrier", "Casadi"],
    }


@pytest.mark.parametrize(("name", "kind"), [("TimeSeries", "figure"), ("Means", "figure of studies")])
def test_figures_are_described_too(name: str, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert printed(capsys, "describe", name).splitlines()[0] == f"{name}  {kind}, figures"
    found = json.loads(printed(capsys, "describe", name, "--json"))
    assert (found["name"], found["kind"], found["group"], found["ports"]) == (name, kind, "figures", [])
    assert main(["describe", name[:-1]]) == 2
    near = f"error: there is no type or packaged model {name[:-1]!r}, did you mean {name!r}?"
    assert capsys.readouterr().err.splitlines()[0] == near


def test_all_that_has_a_name_is_described(capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(capsys, "describe", "Histogram").splitlines()
    heads = ["Histogram  actor, sinks", "Histogram  figure, figures"]
    assert [line for line in lines if line.startswith("Histogram")] == heads
    assert lines[lines.index(heads[1]) - 1] == ""
    found = json.loads(printed(capsys, "describe", "Histogram", "--json"))
    assert (found["kind"], [each["kind"] for each in found["also"]]) == ("actor", ["figure"])
    assert [each["name"] for each in found["also"][0]["parameters"]] == ["signals", "bins", "label", "log_x", "log_y"]
    assert json.loads(printed(capsys, "describe", "PacketLoss", "--json"))["also"] == []


def test_aspects_of_a_model_in_order(capsys: pytest.CaptureFixture[str]) -> None:
    options = (
        "--set",
        "observers=0",
        "--set",
        "disturbance=0.25",
        "--aspect",
        "late=Latency,delay=0.1,at=main.peer_plan",
    )
    found = json.loads(printed(capsys, "describe", "collision_avoidance", "--aspects", *options, "--json"))
    assert {port: [each[:2] for each in aspects] for port, aspects in found.items()} == {
        "main.peer_measurement": [["packet_loss", "PacketLoss"]],
        "main.peer_plan": [["plans_due", "Count"], ["packet_loss", "PacketLoss"], ["late", "Latency"]],
        "main.controller.peer_plans": [["plans_heard", "Count"]],
        "main.sensor.measurement": [["measurement_failure", "MeasurementFailure"]],
    }
    rows = [
        line.split() for line in printed(capsys, "describe", "collision_avoidance", "--aspects", *options).splitlines()
    ]
    assert [row[:4] for row in rows[2:5]] == [
        ["main.peer_plan", "1", "plans_due", "Count"],
        ["2", "packet_loss", "PacketLoss", "probability:"],
        ["3", "late", "Latency", "delay:"],
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("describe", "Clok"),
            (
                "error: there is no type or packaged model 'Clok', did you mean 'Clock'?\n"
                "   help: 'epicycle list models', 'epicycle list actors' and 'epicycle list aspects' list them\n"
                "   help: for your own types, add '--types FILE.py'\n"
            ),
        ),
        (
            ("describe", "PacketLoss", "--set", "x=1"),
            "error: PacketLoss is no model, and --aspects and changes are for models\n",
        ),
        (
            ("describe", "mm1", "--like", "ptolemy"),
            "error: --like is for types: the directors in a model name their dialects themselves\n",
        ),
        (("list", "models", "-o", "x"), "error: --out is for 'epicycle list schema'\n"),
        (("describe", "nowhere/m.yaml"), "error: there is no file nowhere/m.yaml: there is no folder nowhere\n"),
        (("list", "schema", "-o", "nowhere/s.json"), "error: [Errno 2] No such file or directory: 'nowhere/s.json'\n"),
    ],
)
def test_what_cannot_be_found(arguments: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) != 0
    assert capsys.readouterr().err == message


def test_schema_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "s.json"
    assert printed(capsys, "list", "schema", "-o", str(file)) == f"wrote {file}\n"
    assert file.read_text(encoding="utf-8") == printed(capsys, "list", "schema")


def test_help_needs_nothing_heavy() -> None:
    heavy = {"numpy", "rich", "networkx", "yaml", "epicycle.ptolemy.importing"}
    script = f"import sys, epicycle.runner.interface.cli as c; c.parser(); print({heavy} & {{*sys.modules}})"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_many_parts_are_named_only(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["describe", "Pool"]) == 0
    told = capsys.readouterr().out
    assert len(told.splitlines()) < 80
    assert " ".join(told.split()).endswith(
        "Distribution: one of Bernoulli, Binomial, Cauchy, ChiSquare, Choice, Constant, Exponential, Gamma, LogNormal, "
        "NegativeBinomial, Normal, Poisson, RandomInteger, StudentT, Triangular, Uniform, VonMises; 'epicycle "
        "describe NAME' describes one"
    )
    assert main(["describe", "Exponential"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "Exponential  distribution, distributions"
    assert main(["describe", "Exponentail"]) == 2
    assert capsys.readouterr().err.splitlines()[0] == (
        "error: there is no type or packaged model 'Exponentail', did you mean 'Exponential'?"
    )


def test_replicas_are_shown_as_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["describe", "warehouse"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "orders rate of robot[*].delivered (20) 1/h" in told
    assert "stops at 6 h" in told


def test_a_default_that_no_file_can_say_is_shown_by_its_type(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    types = tmp_path / "odd_defaults.py"
    defaults = {"one": "1j", "two": "object()", "three": "[b'a', 1.5]"}
    lines = "".join(f"    {name} = Parameter(object, {default})\n" for name, default in defaults.items())
    types.write_text(
        f"from epicycle.actors import Actor, Parameter\nclass OddDefaults(Actor):\n    'A thing.'\n{lines}"
    )
    told = json.loads(printed(capsys, "describe", "OddDefaults", "--json", "--types", str(types)))
    assert [each["default"] for each in told["parameters"]] == ["<complex>", "<object>", ["<bytes>", 1.5]]
    assert '"default": "<complex>"' in printed(capsys, "list", "schema", "--types", str(types))
