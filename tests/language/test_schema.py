"""The JSON Schema takes every good model, refuses what breaks shape, and knows every key of the language."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from epicycle.actors import (
    EpicycleError,
    FaultError,
    Parameter,
    ParameterError,
    array_parameter,
    declared_parameters,
    texts_parameter,
)
from epicycle.actors.core.units import quantity
from epicycle.aspects import Aspect, MeasurementFailure, PacketLoss
from epicycle.runner.model.build.connect import indices_of as resolve
from epicycle.runner.model.catalogue.figure import own_figures
from epicycle.runner.model.catalogue.packaged import model_folders, packaged_models
from epicycle.runner.model.catalogue.types import Catalogue, built_in
from epicycle.runner.model.language import dimensions, models, parts, places, ports, questions, settings, study
from epicycle.runner.model.language.fields import QUANTITY, Record
from epicycle.runner.model.language.fields import schema_of as value_schema
from epicycle.runner.model.language.parts import BESIDE
from epicycle.runner.model.language.places import _END as ENDPOINT
from epicycle.runner.model.language.places import CONNECTION_TEXT, PATTERN
from epicycle.runner.model.language.schema import json_schema
from epicycle.runner.model.text.document import parse, plain
from epicycle.runner.model.text.patterns import PatternError, compile_pattern
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.model.text.reading import NodeReader
from epicycle.runner.show.report import own_study_figures
from tests.bad_models.test_bad_models import CASES
from tests.cases import Case
from tests.model.model_parts import TYPES

ROOT = Path(__file__).parents[2]
PACKAGED = sorted(path for folder in model_folders() for path in folder.rglob("*.yaml"))
LINE = re.compile(r"# yaml-language-server: \$schema=(\S+)\n")

CORPUS = sorted((ROOT / "tests" / "bad_models").glob("*.yaml"))
KNOWN = "|".join({each.__name__ for each in TYPES} | built_in().actors.keys() | built_in().aspects.keys())
# What messages say of a file whose shape is broken, whatever else the model and its parts are.
SHAPE = re.compile(
    "is not a mapping|has no key|has no type\\b|is not a name|is not a connection|has no port on its|has no '(from|to)'"
    "|is not a list|is not a text|is not a port name|metric '.*' has no port|cannot take|cannot be called"
    f"|is out of bounds|({KNOWN}) has no parameter|is not (a|an|one of|true or false)\\b"
)
# Messages that look like it, but are about other files, computed values, or units.
NOT_SHAPE = re.compile(
    r"\$\{|is not an expression|has the unknown unit|is not a number with a unit"
    r"|is not an? (array|composite|condition|input|output|parameter path|pattern|pointcut|source|type)\b"
    r"|not a function that|of rising, falling"
)


@cache
def validator() -> Draft202012Validator:
    """For Epicycle's own types."""
    return Draft202012Validator(json_schema(built_in(), own_figures(), own_study_figures()))


def document(text: str) -> Any:
    """What our own reader makes of YAML."""
    node = parse(text, "m.yaml", problems := Problems())
    assert node is not None
    assert len(problems) == 0
    return plain(node)


def errors(text: str, schema: Draft202012Validator | None = None) -> list[str]:
    """Where the schema refuses a model."""
    return sorted(error.json_path for error in (schema or validator()).iter_errors(document(text)))


def test_schema_is_one() -> None:
    Draft202012Validator.check_schema(validator().schema)


@pytest.mark.parametrize("path", PACKAGED, ids=lambda path: path.stem)
def test_packaged_model_validates_and_names_the_schema(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert errors(text) == []
    line = LINE.match(text)
    assert line, f"{path.name} should begin with '# yaml-language-server: $schema=' and the way to schema.json"
    assert (path.parent / line[1]).resolve() == packaged_models()[
        "collision_avoidance"
    ].parent.resolve() / "schema.json"


@pytest.mark.parametrize(
    "path", [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))], ids=lambda path: path.name
)
def test_models_of_the_documents_validate(path: Path) -> None:
    for text in re.findall(r"^```yaml\n(.*?)^```", path.read_text(encoding="utf-8"), re.M | re.S):
        if not text.startswith("# overrides.yaml\n"):
            assert errors(text) == []


# -- bad models -----------------------------------------------------------------------------------------------------


@cache
def validator_of_bad_models() -> Draft202012Validator:
    """For the types that the bad models name."""
    catalogue = Catalogue({}, {"PacketLoss": PacketLoss, "MeasurementFailure": MeasurementFailure})
    return Draft202012Validator(json_schema(catalogue.with_types(TYPES), own_figures(), own_study_figures()))


@pytest.mark.parametrize("case", CASES)
def test_bad_model_fails_if_its_shape_is_broken(case: Case) -> None:
    node = parse(case.files("m.yaml")["m.yaml"], "m.yaml", problems := Problems())
    if node is None or len(problems):
        return  # broken YAML is no document at all
    found = [error.message for error in validator_of_bad_models().iter_errors(plain(node))]
    if case.message.startswith("nothing"):
        assert found == []
    elif "model" not in dict(case.options) and (broken := shape_problems(case.message, "m.yaml")):
        assert found != [], broken


@pytest.mark.parametrize("path", CORPUS, ids=lambda path: path.stem)
def test_file_of_the_corpus_fails_if_its_shape_is_broken(path: Path) -> None:
    node = parse(path.read_text(encoding="utf-8", errors="replace"), path.name, problems := Problems())
    if node is None or len(problems):
        return
    if broken := shape_problems(path.with_suffix(".txt").read_text(encoding="utf-8"), path.name):
        assert not validator().is_valid(plain(node)), broken


def test_the_corpus_breaks_shape_in_many_ways() -> None:
    """Or else the test above would hold for want of cases."""
    broken = [shape_problems(path.with_suffix(".txt").read_text(encoding="utf-8"), path.name) for path in CORPUS]
    assert sum(map(bool, broken)) > 20
    assert sum(map(len, broken)) > 80


def shape_problems(message: str, file: str) -> list[str]:
    """Those of the problems in a message that are of the file's shape."""
    return [each for each in message.strip().split("\n\n") if each and breaks_shape(each, file)]


def breaks_shape(problem: str, file: str) -> bool:
    """Whether a problem, as shown, is one of shape: by its words, and unless it is about a computed value."""
    head, *shown = problem.splitlines()
    at = re.match(rf"{re.escape(file)}:\d+:(\d+): ", head)
    if at is None or not SHAPE.search(head) or NOT_SHAPE.search(head) or "help: declared by" in problem:
        return False  # the last are values of parameters that composites declare
    source = shown[0].partition("| ")[2]
    if "is out of bounds" in head and re.search("[a-z%]", source[int(at[1]) - 1 :][: shown[1].count("^")]):
        return False  # the bounds of a text with a unit are beyond a schema
    return "${" not in source[: int(at[1]) - 1 + shown[1].count("^")]


# -- the language ---------------------------------------------------------------------------------------------------


def test_every_key_of_the_language_says_what_it_is() -> None:
    modules = (dimensions, models, parts, places, ports, questions, settings, study)
    constructs = {id(each): each for module in modules for each in vars(module).values() if isinstance(each, Record)}
    assert len(constructs) > 15
    for construct in constructs.values():
        for key, declared in construct.schema["properties"].items():
            assert declared["description"].endswith((".", ")", "'.")), key
    reserved = {*Aspect.reserved, *built_in().actors["Clock"].reserved} - {"type"}
    assert reserved - BESIDE.keys.keys() == set()


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("actors: {a: {type: Clock, period: 1}}", ["$"]),  # a file without a name that is no file of composites
        ("model: m\nactors: {a: {type: Clock, perod: 1}}", ["$.actors.a", "$.actors.a"]),
        ("model: m\nactors: {a: {type: Clock, period: -1 s}}", []),  # the sign of a text is beyond a schema
        ("model: m\nactors: {a: {type: Clock, period: -1}}", ["$.actors.a.period"]),
        ("model: m\nactors: {a: {type: Clock, period: soon}}", ["$.actors.a.period"]),
        ('model: m\nactors: {a: {type: Clock, period: "${x} s", count: "${n}"}}', []),
        ("model: m\nactors: {a: {type: Clock, period: 1, count: -1}}", ["$.actors.a.count"]),
        ("model: m\nactors: {a: {type: Robot, anything: [1]}}", []),  # a composite, from this file or another
        ("model: m\nactors: {a: {type: other_package.Lidar}}", []),
        ("model: m\nactors: {a: {type: 3}}", ["$.actors.a.type"]),
        ("model: m\nactors: {a: {type: Clock, period: []}}", ["$.actors.a.period"]),
        ("model: m\nactors: {a: {type: Vehicle, start: [1, 2 m]}}", []),
        (
            "model: m\nactors: {a: {type: RobustController, objective: {type: Inform, rnge: 3}}}",
            ["$.actors.a.objective"],
        ),
        ("model: m\nactors: {a: {type: RobustController, objective: ReachGoal}}", ["$.actors.a.objective"]),
        ("model: m\nactors: {a: {type: RobustController, objective: {type: Infrm}}}", ["$.actors.a.objective.type"]),
        ('model: m\nactors: {a: {type: RobustController, objective: "${o}"}}', []),
        ("model: m\nactors: {a: {type: RobustController, tube_time: step}}", ["$.actors.a.tube_time"]),
        ("model: m\naspects: {a: {type: [PacketLoss], at: a.b}}", ["$.aspects.a.type"]),
        ("model: m\naspects: {a: {type: MyMedium, at: [{at: a.b, request: in2}]}}", []),
        ("model: m\naspects: {a: {type: PacketLoss, at: a.b, probability: 2}}", ["$.aspects.a.probability"]),
        ("model: m\naspects: {a: {type: PacketLoss, at: a.b, probability: 1, enabled: 1}}", ["$.aspects.a.enabled"]),
        ("model: m\nconnections: [a.b > c.d]", ["$.connections[0]"]),
        ("model: m\nconnections: [{from: a.b, to: c.d, dealy: 1}]", ["$.connections[0]"]),
        ("model: m\nrun: {stop: -1}", ["$.run.stop"]),
        ("model: m\nmetrics: {a: {of: b.c, take: median}}", ["$.metrics.a.take"]),
        ("model: m\nfigures: {a: {type: Trajectories, robots: b.c, colour: red}}", ["$.figures.a"]),
        ("model: m\nparameters: {sin: 3}", ["$.parameters"]),
        ("composites: {C: {inputs: [a-b]}}", ["$.composites.C.inputs"]),
        ("composites: {C: {actors: {a: {type: Clock, period: 1, x: 1}}}}", ["$.composites.C.actors.a"]),
    ],
)
def test_where_a_model_is_refused(text: str, where: list[str]) -> None:
    assert errors(text) == where


# -- the schema against the code that it stands for -----------------------------------------------------------------


INDICES = (
    "0",
    "*",
    "-1",
    "1..",
    "..",
    "..-2",
    "0 .. 1",
    "1, 0",
    "${n}",
    "0..${n}",
    "${[i, 0]}",
    "x",
    "",
    "0..1..2",
    "1.5",
)
ENDS = st.one_of(
    st.sampled_from(INDICES).map(lambda index: f"a[{index}].b"),
    st.sampled_from(["a", "b.c", "a.b.c", "1a", "", " ", ",", "[", "]", "-", ">", "*", "**"]),
)
ARROWS = st.sampled_from([" -> ", "=>", ", "])


@given(st.lists(st.one_of(ENDS, ENDS, ARROWS), max_size=7).map("".join))
def test_connections_are_those_that_can_be_read(text: str) -> None:
    node = parse(f"connection: {text!r}", "m.yaml", Problems())
    reader = NodeReader(problems := Problems())
    connection = places.connection(reader, node.entries["connection"].value)  # type: ignore[union-attr]
    ports = [*connection.sources, *connection.destinations] if connection else []
    is_good = bool(connection) and not len(problems) and all(is_endpoint(port.text) for port in ports)
    assert bool(re.search(CONNECTION_TEXT, text)) == is_good, text


def is_endpoint(text: str) -> bool:
    """Whether a text names a port, in an array that is large enough."""
    found = ENDPOINT.match(text)
    if found is None or found[2] is None:
        return found is not None
    try:
        # Two expressions with something between them come to a text, which is no index.
        resolve(found[2], "a", 9, lambda expression: 2 if expression.count("${") == 1 else "2].b[2")
    except FaultError:
        return False
    return True


@given(st.lists(st.sampled_from(["a", "*", "**", "[*]", "[0]", "[", "]", ".", "1", "-"]), max_size=7).map("".join))
def test_patterns_are_those_that_can_be_compiled(text: str) -> None:
    try:
        compile_pattern(text)
        is_good = True
    except PatternError:
        is_good = False
    assert bool(re.search(PATTERN, text)) == is_good


@given(st.text("0123456789.eE+- msµ/%^°", max_size=8))
def test_quantities_are_numbers_with_or_without_a_unit(text: str) -> None:
    found = quantity(text)
    if re.search(QUANTITY, text):
        assert found is not None or re.search(r"[eE][-+]?\d{3}", text)  # which may be beyond all floats
    elif found is not None:
        assert not re.match(r"[A-Za-z%°µ1]|\Z", found[1])


PARAMETERS = (
    Parameter(float, unit="s", min=-1.0, max=2.0),
    Parameter(float, min=0.0, optional=True),
    Parameter(int, min=-1, max=2),
    Parameter(int | float),
    Parameter(bool),
    Parameter(str),
    Parameter(str, choices=("a", "b")),
    Parameter(Path),
    Parameter(object),
    texts_parameter(),
    array_parameter((2,), unit="s", min=-1.0),
    array_parameter((None, 2)),
)
SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 3), st.floats(-3, 3), st.sampled_from(["a", "b", "1 s", "200 ms", "-5 s"])
)
LISTS = st.lists(SCALARS, max_size=3)
VALUES = st.one_of(SCALARS, LISTS, st.lists(LISTS, max_size=3), st.just({"a": 1}))


@pytest.mark.slow
@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter._expected())
@given(value=VALUES)
def test_values_are_those_that_the_parameter_takes(parameter: Parameter[Any], value: Any) -> None:
    schema = Draft202012Validator({**value_schema(parameter), "$defs": validator().schema["$defs"]})
    try:
        parameter.convert(value)
        is_taken = True
    except ParameterError:
        is_taken = False
    is_valid = schema.is_valid(value)
    if is_taken:
        assert is_valid
    elif is_valid:
        assert "-5 s" in repr(value)  # the bounds of a text with a unit are beyond a schema


EXAMPLES = (
    None, True, -3, 0, 1, 2, 7, 0.5, 1e9, "", "a", "a + b", "1 s", "2 m", "3 %", "out.csv", "last", [], [1], [1, 2],
    [0.1, 0.9], ["a"], [[1, 2]], [[1, 2], [3, 4]], {}, {"type": "Normal"}, {"a": 1},
)  # fmt: skip
DECLARED = [
    pytest.param(f"{kind}.{name}", key, parameter, id=f"{name}.{key}")
    for kind, types in (("actor", built_in().actors), ("aspect", built_in().aspects))
    for name, cls in types.items()
    for key, parameter in declared_parameters(cls).items()
]


@pytest.mark.parametrize(("definition", "key", "parameter"), DECLARED)
def test_schema_takes_what_a_declared_parameter_takes(definition: str, key: str, parameter: Parameter[Any]) -> None:
    schema = validator().evolve(schema=validator().schema["$defs"][definition]["properties"][key])
    default = schema.schema.get("default")
    for value in (*EXAMPLES, *parameter.choices, *([default] if default is not None else [])):
        try:
            parameter.convert(value)
        except EpicycleError:
            continue
        assert schema.is_valid(value), value


def test_every_packaged_type_can_be_described() -> None:
    properties = validator().schema["$defs"]
    for name, cls in built_in().actors.items():
        assert {*declared_parameters(cls), *cls.reserved} == set(properties[f"actor.{name}"]["properties"])
