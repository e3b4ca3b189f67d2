"""Reading hostile and broken files."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.ptolemy.importing import MomlError, import_moml
from tests.ptolemy.importing.moml_parts import COMPOSITE, HEAD, entity, imported, model

REFUSED = """m.xml:{line}: the file declares entities or its own DTD, which is not allowed
   help: only a line like '<!DOCTYPE entity PUBLIC ...>' may precede the model"""


def refusal(tmp_path: Path, text: str | bytes) -> str:
    file = tmp_path / "m.xml"
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(MomlError) as caught:
        import_moml(file)
    return str(caught.value).replace(f"{tmp_path}/", "")


def test_the_line_that_names_the_dtd_is_allowed_and_nothing_is_fetched(tmp_path: Path) -> None:
    assert imported(tmp_path, model()).text.endswith("model: m\ndirector: {like: ptolemy}\nrun: {stop: 10 s}\n")
    system = HEAD.replace('PUBLIC "-//UC Berkeley//DTD MoML 1//EN"', "SYSTEM").replace("http:", "file:")
    assert imported(tmp_path, system + model().removeprefix(HEAD)).text.startswith("# Imported")


def test_entities_are_refused(tmp_path: Path) -> None:
    bomb = """<?xml version="1.0"?>
<!DOCTYPE entity [
  <!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;">
]>
<entity name="&c;" class="x"/>"""
    assert refusal(tmp_path, bomb) == REFUSED.format(line=2)


def test_files_of_others_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    text = f'<!DOCTYPE entity [<!ENTITY a SYSTEM "file://{tmp_path}/secret">]>\n<entity name="m" class="x">&a;</entity>'
    assert refusal(tmp_path, text) == REFUSED.format(line=1)
    text = '<!DOCTYPE entity PUBLIC "x" "y" [<!ENTITY % d SYSTEM "file:///etc/passwd"> %d;]>\n<entity name="m"/>'
    assert refusal(tmp_path, text) == REFUSED.format(line=1)
    assert refusal(tmp_path, HEAD + '<entity name="&a;"/>') == "m.xml:4: not well-formed XML: undefined entity"


def test_what_names_a_dtd_in_another_place_is_refused(tmp_path: Path) -> None:
    assert "not well-formed" in refusal(tmp_path, '<entity name="m">\n<!DOCTYPE entity SYSTEM "x">\n</entity>')


def test_other_files_are_named_and_not_read(tmp_path: Path) -> None:
    found = imported(tmp_path, model('<input source="other.xml"/>', entity("a", COMPOSITE)))
    assert found.notes[0] == "line 7: the file 'other.xml' is not read"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "m.xml:1: not well-formed XML: no element found"),
        ("<entity", "m.xml:1: not well-formed XML: unclosed token"),
        ('<entity name="a">' * 101 + "</entity>" * 101, "m.xml:1: elements are nested deeper than 100 levels"),
        ("<html/>", "m.xml:1: <html> is not a model: MoML starts with <entity>"),
        ('<entity class="x"/>', "m.xml:1: <entity> has no name"),
        ('<?xml version="1.0" encoding="klingon"?><a/>', "m.xml: not well-formed XML: unknown encoding: klingon"),
    ],
)
def test_what_is_no_model(tmp_path: Path, text: str, message: str) -> None:
    assert refusal(tmp_path, text) == message


@pytest.mark.slow
def test_what_is_too_large(tmp_path: Path) -> None:
    assert refusal(tmp_path, b" " * 20_000_001) == "m.xml is larger than the maximum of 20,000,000 bytes"
    many = '<entity name="m">' + "<a/>" * 300_000 + "</entity>"
    assert refusal(tmp_path, many) == "m.xml: more than the maximum of 300,000 elements"


def test_classes_in_classes_are_counted_before_they_are_made(tmp_path: Path) -> None:
    classes = ['<class name="c0" extends="ptolemy.actor.lib.Ramp"/>']
    for number in range(1, 30):
        inner = "".join(f'<entity name="e{each}" class="c{number - 1}"/>' for each in range(10))
        classes.append(f'<class name="c{number}" extends="{COMPOSITE}">{inner}</class>')
    text = model(*classes, '<entity name="all" class="c29"/>')
    assert refusal(tmp_path, text) == "m.xml:7: more than the maximum of 20,000 entities"


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(MomlError) as caught:
        import_moml(tmp_path / "none.xml")
    assert str(caught.value) == f"{tmp_path}/none.xml cannot be read: No such file or directory"
