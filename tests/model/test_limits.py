"""What a model may cost: what is too much is refused with a message, and soon."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.text.limits import RAISE_IT
from epicycle.runner.model.text.patterns import PathIndex, matches
from epicycle.runner.model.text.problems import ModelError

END = "  c: {type: Clock, period: 1}\n  r: {type: Recorder}\nconnections: [c.output -> r.input]\nrun: {stop: 1}\n"
HELP = f"   help: {RAISE_IT}"
SOON = 10.0  # s of processor time; each of these takes a second or two, and took a minute or all memory


def refused(folder: Path, text: str, **options: object) -> str:
    """What load_model says of a model, without the lines that show the file."""
    file = folder / "m.yaml"
    file.write_text(text, encoding="utf-8")
    started = time.process_time()
    try:
        model = load_model(file, **options)  # type: ignore[arg-type]
        found = "\n".join(map(str, model.warnings)) or "nothing"
    except ModelError as error:
        found = str(error)
    assert time.process_time() - started < SOON
    lines = found.replace(f"{folder}/", "").split("\n")
    return "\n".join(line for line in lines if " | " not in line)


def array(actors: int) -> str:
    """A model with so many actors in a composite, to which more can be added."""
    return (
        "model: m\ncomposites:\n  G:\n    inputs: [in]\n"
        f"    actors: {{s: {{type: Scale, factor: 2, count: {actors}}}}}\n"
        "    connections: ['in -> s[*].input']\nactors:\n  g: {type: G}\n  c: {type: Clock, period: 1}\n"
        "connections: [c.output -> g.in]\n"
    )


def test_values_nest_at_most_a_hundred_levels(tmp_path: Path) -> None:
    def nested(levels: int) -> str:
        lines = [f"  a{n}: '${{[{f'a{n - 1}' if n else '1'}]}}'\n" for n in range(levels)]
        last = f"  v: {{type: Const, value: '${{sorted([a{levels - 1}])[0]}}'}}\n"
        return f"model: m\nparameters:\n{''.join(lines)}actors:\n{last}{END}".replace(
            "[c.output ->", "['c.output, v.output ->"
        ).replace("r.input]", "r.input']")

    assert refused(tmp_path, nested(99)) == "nothing"
    assert refused(tmp_path, nested(101)) == "m.yaml:103:12: error: a100: [a99]: nested deeper than 100 levels"
    around = "model: m\nparameters:\n  a: " + "[" * 60 + "1" + "]" * 60 + "\n  b: " + "[" * 60 + '"${a}"' + "]" * 60
    assert refused(tmp_path, f"{around}\nactors:\n  v: {{type: Const, value: '${{b}}'}}\n{END}").startswith(
        "m.yaml:4:6: error: b: nested deeper than 100 levels"
    )
    deep: object = 1
    for _ in range(500):
        deep = [deep]
    assert "error: nested deeper than 100 levels" in refused(tmp_path, nested(2), set={"a0": deep})
    ring: list[object] = []
    ring += [ring, ring]
    assert "error: nested deeper than 100 levels" in refused(tmp_path, nested(2), set={"a0": ring})


def test_a_quantity_too_large_for_a_float(tmp_path: Path) -> None:
    text = "model: m\nparameters: {far: {value: 1e308, unit: km}}\nactors:\n  v: {type: Const, value: '${far}'}\n" + END
    assert refused(tmp_path, text) == "m.yaml:2:27: error: far: 1e+308 km is too large for a number in SI units"


@pytest.mark.slow
def test_classes_that_nothing_uses(tmp_path: Path) -> None:
    base = "  B: {actors: {s: {type: Clock, period: 1, count: 1000}}}\n"
    many = "".join(f"  C{n}: {{actors: {{s: {{type: B, count: 9}}}}}}\n" for n in range(300))
    assert refused(tmp_path, f"model: m\ncomposites:\n{base}{many}actors:\n{END}") == (
        "m.yaml:5:3: warning: C1 and 298 others are not fully checked: the model has no instance of such a class, "
        f"and checking all such classes takes more than 10,000 actors and composites\n{HELP}"
    )


def test_what_classes_take_over(tmp_path: Path) -> None:
    base = "  B:\n    actors:\n" + "".join(f"      a{n}: {{type: Clock, period: 1}}\n" for n in range(1_000))
    many = "".join(f"  C{n}: {{extends: B}}\n" for n in range(101))
    most = "100,000 actors, aspects, connections, ports and parameters"
    assert refused(tmp_path, f"model: m\ncomposites:\n{base}{many}actors:\n{END}") == (
        f"m.yaml:1105:19: error: C100: the classes inherit more than {most}\n{HELP}"
    )


def test_expressions_of_unused_classes_count_together(tmp_path: Path) -> None:
    made = "actors: {s: {type: Const, value: '${p}'}, d: {type: Recorder}}, connections: [s.output -> d.input]"
    many = "".join(f"  C{n}: {{parameters: {{p: '${{range(30000)}}'}}, {made}}}\n" for n in range(100))
    assert refused(tmp_path, f"model: m\ncomposites:\n{many}actors:\n{END}") == (
        "m.yaml:18:25: error: C15.p: the values of the model take more than 500,000 steps"
    )


@pytest.mark.slow
@pytest.mark.parametrize("what", ["record", "at", "overrides"])
def test_many_patterns_over_many_paths(tmp_path: Path, what: str) -> None:
    names = {"record": "output", "at": "input", "overrides": "factor"}
    patterns = [f"**.s[{n}].{names[what]}" for n in range(5_000)]
    listed = ", ".join(f'"{each}"' for each in patterns)
    overrides = tmp_path / "overrides.yaml"
    overrides.write_text("".join(f'"{each}": 3\n' for each in patterns), encoding="utf-8")
    more = {
        "record": f"run: {{stop: 1, record: [{listed}]}}\n",
        "at": f"aspects: {{l: {{type: PacketLoss, probability: 0.1, at: [{listed}]}}}}\nrun: {{stop: 1}}\n",
        "overrides": "run: {stop: 1}\n",
    }
    assert (
        refused(tmp_path, array(5_000) + more[what], overrides=[overrides] if what == "overrides" else ()) == "nothing"
    )


def test_one_pattern_again_and_again(tmp_path: Path) -> None:
    again = ", ".join(['"**"'] * 10_000)
    assert refused(tmp_path, f"{array(5_000)}run: {{stop: 1, record: [{again}]}}\n") == "nothing"


@pytest.mark.slow
def test_patterns_that_select_everything(tmp_path: Path) -> None:
    metrics = "".join(f'  m{n}: {{of: "**.output", take: count}}\n' for n in range(100))
    assert refused(tmp_path, f"{array(5_000)}run: {{stop: 1}}\nmetrics:\n{metrics}") == (
        f"m.yaml:52:3: error: metric m39: metrics are taken from more than 200,000 ports\n{HELP}"
    )
    again = ", ".join(['"**.s[*].input"'] * 400)
    aspects = f"aspects: {{l: {{type: PacketLoss, probability: 0, at: [{again}]}}}}\n"
    assert refused(tmp_path, f"{array(1_500)}run: {{stop: 1}}\n{aspects}", max_actors=2_000) == (
        f"m.yaml:12:11: error: aspect l: patterns are compared with more than 500,000 paths\n{HELP}"
    )


def test_an_index_chooses_the_same_paths_when_it_has_sorted_them() -> None:
    paths = [f"{group}.s[{n}].{port}" for group in ("g", "h[0]", "h[1]") for n in range(40) for port in ("in", "out")]
    index = PathIndex(paths)
    patterns = [
        "**",
        "**.s[3].out",
        "*.s[*].in",
        "h[*].**",
        "**.h[1].**",
        "g.s[7].*",
        "**.none",
        "*.*.out",
        "h[0].s[2].in",
    ]
    for pattern in patterns * 20:
        assert index.select(pattern) == [path for path in paths if matches(pattern, path)]


def test_a_clock_is_not_set_to_the_end_of_all_time(tmp_path: Path) -> None:
    text = f"model: m\nactors:\n{END}aspects:\n  o: {{type: ClockOffset, offset: 1e18, at: c}}\n"
    wanted = "a number in s from -1000000000 to 1000000000"
    assert refused(tmp_path, text) == f"m.yaml:8:34: error: aspect o.offset: 1e+18 is out of bounds, expected {wanted}"


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (
            "{from: 1, to: 1.0000000000000000001, step: 1e-19}",
            (
                "m.yaml:4:49: error: the range of 'n' has values that cannot be told apart as floats: "
                "from 1 to 1.0000000000000000001 in steps of 1E-19"
            ),
        ),
        (
            "{from: 0 Mm, to: 1e308 Mm, step: 1e307 Mm}",
            "m.yaml:4:39: error: the range of 'n': 1e+307 Mm is too large for a number in SI units",
        ),
    ],
)
def test_ranges_of_studies(tmp_path: Path, values: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "simple.yaml").write_text(f"model: m\nparameters: {{n: 1.0}}\nactors:\n{END}", encoding="utf-8")
    file = tmp_path / "m.yaml"
    file.write_text(f"study: s\nmodel: simple.yaml\nvary:\n  n: {values}\nreplications: 1\n", encoding="utf-8")
    assert main(["study", str(file), "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.replace(f"{tmp_path}/", "").split("\n")[0] == told
