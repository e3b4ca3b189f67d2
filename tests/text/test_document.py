"""YAML text becomes nodes with positions; what is wrong is said in full."""

import math
import os
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.runner.model.text import document
from epicycle.runner.model.text.document import Mapping, Node, Scalar, parse, plain, read
from epicycle.runner.model.text.problems import ModelError, Position, Problems


def load(text: str) -> Node:
    problems = Problems()
    node = parse(text, "m.yaml", problems)
    problems.raise_if_any()
    assert node is not None
    return node


def faults(text: str) -> str:
    """All problems of a text, without the lines that show the source."""
    problems = Problems()
    parse(text, "m.yaml", problems)
    lines = str(ModelError(problems.found)).splitlines()
    return "\n".join(line for line in lines if line.startswith(("m.yaml", "error", "   help")))


def spot(node: Node) -> tuple[int, int, int]:
    return node.position.line, node.position.column, node.position.length


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("null", None), ("~", None), ("Null", None), ("true", True), ("True", True), ("TRUE", True),
        ("false", False), ("FALSE", False), ("tRUE", "tRUE"), ("yes", "yes"), ("no", "no"),
        ("on", "on"),
        ("off", "off"), ("y", "y"), ("12", 12), ("-3", -3), ("+4", 4), ("012", 12), ("0x1F", 31),
        ("0o17", 15),
        ("0b1", "0b1"), ("1_000", "1_000"), ("1.5", 1.5), (".5", 0.5), ("5.", 5.0), ("1e3", 1000.0),
        ("-1.5E-3", -0.0015), (".inf", math.inf), ("-.INF", -math.inf), ("2001-01-01", "2001-01-01"),
        ("1:30", "1:30"), (".", "."), ("-", None), ("'1'", "1"), ('"true"', "true"), ("8 m/s", "8 m/s"),
        ("=", "="), ("é漢", "é漢"), ("٣", "٣"),
    ],
)  # fmt: skip
def test_core_schema(text: str, value: object) -> None:
    result = plain(load(f"[{text}]" if text != "-" else "- "))
    assert result == [value]
    assert type(result[0]) is type(value)  # type: ignore[index]


def test_float_types_and_nan() -> None:
    value = plain(load("[.nan, .NaN]"))
    assert isinstance(value, list)
    assert all(math.isnan(number) for number in value)


def test_scalars_know_how_they_were_written() -> None:
    node = load("a: 0x10\nb: '0x10'\nc:\nd: |\n  x\n  y\n")
    assert isinstance(node, Mapping)
    a, b, c, d = (node.entries[key].value for key in "abcd")
    assert a == Scalar(16, "0x10", True, Position("m.yaml", 1, 4, 4, "a: 0x10"))
    assert b == Scalar("0x10", "0x10", False, Position("m.yaml", 2, 4, 6, "b: '0x10'"))
    assert c == Scalar(None, "", True, Position("m.yaml", 3, 3, 1, "c:"))
    assert d == Scalar("x\ny\n", "x\ny\n", False, Position("m.yaml", 4, 4, 1, "d: |"))


def test_positions_of_lists_and_mappings() -> None:
    node = load("first: {a: 1, b: [1,\n  2]}\nlist:\n  - x\nmap: &m\n  key: &k v\nagain: *m\n")
    assert isinstance(node, Mapping)
    entries = node.entries
    assert spot(node) == (1, 1, 5)
    assert spot(entries["first"].value) == (1, 8, 13)
    inner = entries["first"].value
    assert isinstance(inner, Mapping)
    assert spot(inner.entries["b"].value) == (1, 18, 3)
    assert spot(inner.entries["b"].key) == (1, 15, 1)
    assert spot(entries["list"].value) == (4, 3, 1)
    assert spot(entries["map"].value) == (6, 3, 3)
    mapping, again = entries["map"].value, entries["again"].value
    assert isinstance(mapping, Mapping)
    assert isinstance(again, Mapping)
    assert spot(mapping.entries["key"].value) == (6, 11, 1)
    assert spot(again) == (7, 8, 2)
    assert again.entries == mapping.entries
    assert plain(again) == {"key": "v"}


def test_columns_count_characters() -> None:
    node = load("漢: {é: 𝄞, x: 1}\n")
    assert isinstance(node, Mapping)
    inner = node.entries["漢"].value
    assert isinstance(inner, Mapping)
    assert spot(inner.entries["x"].value) == (1, 14, 1)


def test_tags_of_the_core_schema() -> None:
    text = "[!!str 12, !!int '3', !!float 1, !!bool 'true', !!null '', !!seq [], !!map {}, !!str yes]"
    assert plain(load(text)) == ["12", 3, 1.0, True, None, [], {}, "yes"]


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_byte_order_mark_and_line_ends(newline: str) -> None:
    node = load("\ufeff" + newline.join(["a: 1", "", "b: 2", ""]))
    assert plain(node) == {"a": 1, "b": 2}
    assert isinstance(node, Mapping)
    assert node.entries["b"].value.position == Position("m.yaml", 3, 4, 1, "b: 2")


def test_duplicate_keys() -> None:
    problems = Problems()
    node = parse("a: 1\nb:\n  c: 1\n  c: 2\n'a': 3\n", "m.yaml", problems)
    assert (
        str(ModelError(problems.found))
        == """\
m.yaml:4:3: error: duplicate key 'c': first on line 3, again on line 4
    4 |   c: 2
      |   ^

m.yaml:5:1: error: duplicate key 'a': first on line 1, again on line 5
    5 | 'a': 3
      | ^^^
2 errors in m.yaml"""
    )
    assert node is not None
    assert plain(node) == {"a": 1, "b": {"c": 1}}


ESCAPE_HELP = '\n   help: write it as an escape in "..."'
TAG_HELP = "\n   help: leave it out, or quote a text that starts with '!'"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "error: m.yaml is empty"),
        ("# only\n", "error: m.yaml is empty"),
        ("---\n...\n", "error: m.yaml is empty"),
        (
            "1: a\n'2': b",
            "m.yaml:1:1: error: a key must be text, but this one is 1\n   help: quote it: '1'",
        ),
        (
            "true: a",
            ("m.yaml:1:1: error: a key must be text, but this one is true\n   help: quote it: 'true'"),
        ),
        ("? \n: a", "m.yaml:1:2: error: a key must be text, but this one is empty\n   help: quote it: ''"),
        (
            "[1]: a",
            (
                "m.yaml:1:1: error: a key must be text, but this one is a list\n"
                "   help: quote a text that starts with '{' or '['"
            ),
        ),
        (
            "a: {{b}: c}",
            (
                "m.yaml:1:5: error: a key must be text, but this one is a mapping\n"
                "   help: quote a text that starts with '{' or '['"
            ),
        ),
        (
            "x: &x {a: 1}\ny:\n  <<: *x\n",
            (
                "m.yaml:3:3: error: YAML 1.2 has no merge keys (<<)\n"
                "   help: write the entries out, or use a composite class"
            ),
        ),
        (
            "a: !!python/object/apply:os.system ['x']",
            "m.yaml:1:4: error: the tag !!python/object/apply:os.system is not allowed" + TAG_HELP,
        ),
        ("a: !foo b", "m.yaml:1:4: error: the tag !foo is not allowed" + TAG_HELP),
        ("a: ! b", "m.yaml:1:4: error: the tag ! is not allowed" + TAG_HELP),
        ("a: !!map [1]", "m.yaml:1:4: error: the tag !!map does not fit a list" + TAG_HELP),
        ("a: !!seq x", "m.yaml:1:4: error: the tag !!seq does not fit a single value" + TAG_HELP),
        ("a: !!int x", "m.yaml:1:10: error: !!int does not fit 'x'"),
        (
            "a: 1\n---\nb: 2",
            "m.yaml:2:1: error: a second YAML document starts here: one file holds one model",
        ),
        ("a: 1e999", "m.yaml:1:4: error: the number 1e999 is too large for a float"),
        ("a: " + "1" * 1_001, "m.yaml:1:4: error: a number of 1001 characters is too long"),
        ("a: *b", "m.yaml:1:4: error: there is no anchor &b before this alias"),
        (
            "a: &robot 1\nb: *robt",
            "m.yaml:2:4: error: there is no anchor &robt before this alias, did you mean 'robot'?",
        ),
        ("a: &b [*b]", "m.yaml:1:8: error: the alias *b is inside &b itself"),
        (
            "a: b: c",
            (
                "m.yaml:1:5: error: broken YAML: mapping values are not allowed in this context\n"
                "   help: check the indentation, and quote a text that contains ': '"
            ),
        ),
        (
            "a:\n\tb: 1",
            (
                "m.yaml:2:1: error: broken YAML: found character that cannot start any token\n"
                "   help: indent with spaces, not tabs"
            ),
        ),
        (
            "a: @b",
            (
                "m.yaml:1:4: error: broken YAML: found character that cannot start any token\n"
                "   help: quote a text that starts with '@'"
            ),
        ),
        (
            "a:\n  b: 1\n c: 2",
            (
                "m.yaml:3:2: error: broken YAML: did not find expected key\n"
                "   help: while parsing a block mapping that starts on line 1\n"
                "   help: check the indentation, and that brackets and quotes are closed"
            ),
        ),
        (
            "a: 1\nb: 'x\nc: 2\n",
            "m.yaml:2:4: error: broken YAML: found unexpected end of stream\n   help: a quote is not closed",
        ),
        (
            "a: {b: 1\n",
            (
                "m.yaml:1:4: error: broken YAML: did not find expected ',' or '}'\n"
                "   help: a bracket is not closed, or a comma is missing"
            ),
        ),
        (
            "a: {b: ${c}, d: 1}",
            (
                "m.yaml:1:9: error: broken YAML: did not find expected ',' or '}'\n"
                '   help: within { } and [ ], quote an expression: "${...}"'
            ),
        ),
        (
            "a: 1\nb: x\x00y",
            "m.yaml:2:5: error: YAML does not allow the character U+0000" + ESCAPE_HELP,
        ),
        (
            "a: \ud800",
            "m.yaml:1:4: error: YAML does not allow the character U+D800" + ESCAPE_HELP,
        ),
        ("[" * 10_000, "m.yaml:1:101: error: nested deeper than 100 levels"),
        ("- " * 10_000, "m.yaml:1:201: error: nested deeper than 100 levels"),
        ("{a: " * 10_000, "m.yaml:1:401: error: nested deeper than 100 levels"),
    ],
)
def test_faults(text: str, expected: str) -> None:
    assert faults(text) == expected


def test_expressions_need_no_quotes_in_a_block() -> None:
    assert plain(load("a: ${b}\nc: ${d['e']} f\n")) == {"a": "${b}", "c": "${d['e']} f"}


def test_problems_before_a_syntax_error_are_kept() -> None:
    assert faults("1: a\n2: b\nc: [").count("error") == 3


def test_alias_bomb() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 10)]
    assert faults("\n".join(lines)) == ("m.yaml:6:10: error: more than 200,000 values, aliases counted at each use")


def test_depth_by_aliases() -> None:
    lines = ["a0: &a0 [x]"] + [f"a{i}: &a{i} [*a{i - 1}]" for i in range(1, 150)]
    assert faults("\n".join(lines)) == ("m.yaml:100:12: error: nested deeper than 100 levels by the alias *a98")


def test_deepest_allowed_nesting() -> None:
    value = plain(load("[" * 100 + "]" * 100))
    for _ in range(99):
        assert isinstance(value, list)
        value = value[0]
    assert value == []


def test_size_limit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(document, "MAX_BYTES", 1_000_000)
    path = tmp_path / "big.yaml"
    path.write_text("# " + "x" * 1_000_000)
    problems = Problems()
    assert read(path, problems, "big.yaml") is None
    assert parse(" " * 1_000_001, "text", problems) is None
    assert [p.message for p in problems.found] == ["big.yaml is larger than 1 MB", "text is larger than 1 MB"]


def test_without_the_c_parser(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "a: &a [1, {b: 'c'}]\nd: *a\ne:\n  - !!str 1\n  - é f  # c\n"
    expected = load(text)
    monkeypatch.setattr(document, "LOADER", yaml.SafeLoader)
    assert load(text) == expected
    assert faults("a: b: c").startswith("m.yaml:1:5: error: broken YAML: mapping values are not allowed here")


def read_faults(path: Path, shown_as: str = "m.yaml") -> str:
    problems = Problems()
    assert read(path, problems, shown_as) is None
    return str(ModelError(problems.found))


def test_read(tmp_path: Path) -> None:
    path = tmp_path / "model.yaml"
    path.write_bytes("\ufeffa: é\r\n".encode())
    problems = Problems()
    node = read(path, problems)
    assert node is not None
    assert plain(node) == {"a": "é"}
    assert node.position.file == str(path)
    assert not len(problems)


def test_read_what_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "model.yaml").write_text("a: 1")
    assert read_faults(tmp_path / "modle.yaml", "modle.yaml") == (
        "error: there is no file modle.yaml, did you mean 'model.yaml'?"
    )
    assert read_faults(tmp_path / "no" / "m.yaml") == (
        f"error: there is no file m.yaml: there is no folder {tmp_path / 'no'}"
    )
    assert read_faults(tmp_path) == "error: m.yaml is a folder, not a file"
    assert read_faults(Path("a\x00b")).startswith("error: there is no file m.yaml")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_read_a_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert read_faults(tmp_path / "pipe") == "error: m.yaml is a named pipe, not a regular file"
    assert read_faults(Path("/dev/zero")) == "error: m.yaml is a device, not a regular file"


def test_read_an_unreadable_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    path = tmp_path / "m.yaml"
    path.write_text("a: 1")
    monkeypatch.setattr("builtins.open", refuse)
    assert read_faults(path) == "error: cannot read m.yaml: Permission denied"


def test_read_what_is_not_utf8(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_bytes("a: 1\nb: é ".encode() + b"\xe9t\xe9\r\nc: 2")
    assert read_faults(path) == (
        "m.yaml:2:6: error: this is not UTF-8 text: it has the byte 0xe9\n"
        "    2 | b: é \\xe9t\\xe9\n"
        "      |      ^^^^\n"
        "   help: save the file as UTF-8"
    )
    path.write_bytes("a: 1".encode("utf-16"))
    assert read_faults(path) == "error: m.yaml is UTF-16, not UTF-8 text: save it as UTF-8"


values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=10,
)


@settings(max_examples=30, deadline=None)
@given(values)
def test_what_is_written_is_read(value: object) -> None:
    text = yaml.safe_dump({"value": value}, default_style='"', allow_unicode=False)
    assert plain(load(text)) == {"value": value}


@given(st.text(alphabet="ab:-[]{}&*!|>'\"#%@,? \n\t\x00é\u2028", max_size=40))
def test_no_text_makes_it_crash(text: str) -> None:
    problems = Problems()
    node = parse(text, "m.yaml", problems)
    assert (node is None) <= (len(problems) > 0)
    if len(problems):
        assert str(ModelError(problems.found))


def test_a_large_file() -> None:
    text = "actors:\n" + "".join(f"  a{i}:\n    type: Vehicle\n    speed: {i} m/s\n" for i in range(3_000))
    node = load(text)
    assert isinstance(node, Mapping)
    actors = node.entries["actors"].value
    assert isinstance(actors, Mapping)
    assert len(actors.entries) == 3_000
    assert spot(actors.entries["a2999"].key) == (8999, 3, 5)
