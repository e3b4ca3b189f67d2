"""A text that is read again after a change is what it would be if it were read as a whole."""

from __future__ import annotations

import random  # noqa: TID251  no run depends on it

import pytest

from epicycle.runner.desk import again
from epicycle.runner.desk.again import read_again
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.text.document import Node, parse
from epicycle.runner.model.text.problems import Problems

MODEL = """model: line
doc: |
  In two
  lines.
actors:
  # what ticks
  clock:
    type: Clock
    period: 1 s
  gain: {type: Scale, factor: 2}

  heard: {type: Recorder}
connections:
- clock.output -> gain.input
- from: gain.output
  to: heard.input
run: {stop: 10 s}
"""

LINES = [
    "  more: {type: Merge}",
    "  # a comment",
    "# another",
    "",
    "- a.out -> b.in",
    "  - a.out -> b.in",
    "top: 1",
    "    deeper: 2",
    "  words",
    "  text: |",
    "  text: >-",
    "...",
    "---",
    "  open: [",
    "  open: {a: 1,",
    '  open: "',
    "  ]",
    "  anchor: &a 1",
    "  alias: *a",
    "  ? odd",
    "  : key",
    "  clock: 3",
    "  {clock: 3}",
    "[clock]",
    "-",
    "- - nested",
    "\tx: 1",
]


def whole(text: str) -> Node | None:
    """What a text holds, if nothing is wrong with it."""
    problems = Problems()
    node = parse(text, "file", problems)
    return None if problems.found else node


def other(text: str, draw: random.Random) -> str:
    """A text with another line, without one, or with other characters."""
    lines = text.split("\n")
    at = draw.randrange(len(lines))
    match draw.randrange(6):
        case 0:
            lines.insert(at, draw.choice(LINES))
        case 1:
            del lines[at]
        case 2:
            lines[at] = draw.choice(LINES)
        case 3:
            lines.insert(at, lines[draw.randrange(len(lines))])
        case _:
            place = draw.randrange(len(lines[at]) + 1)
            written = draw.choice([*" :#-[]{}'\"|&*\t", "a", "2", ": ", " # ", "\u00e9", "\r"])
            lines[at] = lines[at][:place] + written + lines[at][place + draw.randrange(2) :]
    return "\n".join(lines)


def _after_changes(text: str, number: int, draw: random.Random) -> int:
    """How many of so many texts were read again; each must hold what it holds as a whole."""
    before, root, found = text, whole(text), 0
    assert root is not None
    for _ in range(number):
        after = other(before, draw)
        made, expected = read_again(after, "file", before, root), whole(after)
        if made is not None:
            assert made == expected, after
            found += 1
        if expected is None or draw.random() < 0.02:
            before, root = text, whole(text)  # type: ignore[assignment]
        else:
            before, root = after, expected
    return found


def test_a_text_is_read_again() -> None:
    assert _after_changes(MODEL, 1_000, random.Random(1)) > 300


@pytest.mark.slow
def test_packaged_models_are_read_again() -> None:
    draw = random.Random(2)
    for path in packaged_models().values():
        if (text := path.read_text(encoding="utf-8")).find("&") < 0:
            assert _after_changes(text, 60, draw) > 5, path


@pytest.mark.parametrize(
    ("before", "after"),
    [
        # A comment in front of an entry may be a line of the text before it.
        ("a: |\n  one\nb: 1\n", "a: |\n  one\n  # two\nb: 1\n"),
        ("a: |+\n  one\nb: 1\n", "a: |+\n  one\n\nb: 1\n"),
        ("a: one\nb: 1\n", "a: one\n  two\nb: 1\n"),
        ("a: 1\nb: 2\n", "a: 1\nb: 2\n...\n"),
        ("a: 1\nb: 2\n", "a: 1\na: 2\n"),
        ("a:\n- 1\n- 2\n", "a:\n- 1\n-\n- 2\n"),
        ("a:\n  b: 1\n  c: 2\n", "a:\n  {b: 1}\n  c: 2\n"),
        ("a:\n  b: 1\n  c: 2\n", "a:\n  {b: 1}\n"),
        ("\ufeffa: 1\nb: 2\n", "\ufeffa: 1\nb: 3\n"),
        ("\ufeffa: 1\nb: 2\n", "\ufeffa: 3\nb: 2\n"),
    ],
)
def test_what_belongs_to_an_entry_is_found(before: str, after: str) -> None:
    root = whole(before)
    assert root is not None
    assert read_again(after, "file", before, root) in (None, whole(after))


def test_only_the_entry_that_has_changed_is_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    parsed = []

    def noted(text: str, *given: object, **named: object) -> Node | None:
        parsed.append(text.lstrip("\n"))
        return parse(text, *given, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(again, "parse", noted)
    root = whole(MODEL)
    assert root is not None
    after = MODEL.replace("factor: 2", "factor: 3").replace("  heard", "  more: {type: Merge}\n  heard")
    assert read_again(after, "file", MODEL, root) == whole(after)
    assert parsed == [
        "  clock:\n    type: Clock\n    period: 1 s\n  gain: {type: Scale, factor: 3}\n\n  more: {type: Merge}\n"
    ]
