"""The linter of prose finds what it should, and nothing in what we have written."""

from __future__ import annotations

import re

import pytest

from tests.prose import findings, phrases, sources

SOURCE = '''"""What speaks least for it."""

class Part:
    """Fine.

    The rest hangs
    on the weather.
    """

    port = Input(doc="begins anew", name="anew")

    def fire(self):  # by and by
        raise ValueError(f"{self} is told "
                         "with it")
'''
DOCUMENT = """# Anew
`anew`, and
```text
anew
```
it is gone on with <!-- anew -->
"""


def found(text: str, path: str) -> list[str]:
    return [str(each) for each in sorted(findings(text, path, phrases()))]


def test_texts_and_comments_are_looked_at_and_names_are_not() -> None:
    assert found(SOURCE, "part.py") == [
        "part.py:1: 'What speaks least': give the reason",
        "part.py:6: 'hangs on': depends on",
        "part.py:10: 'anew': again",
        "part.py:12: 'by and by': gradually",
        "part.py:13: 'is told': is reported, is shown",
    ]


def test_documents_are_looked_at_without_their_code() -> None:
    assert found(DOCUMENT, "part.md") == ["part.md:1: 'Anew': again", "part.md:6: 'gone on with': resumed, continued"]


@pytest.mark.parametrize(
    "sentence",
    [
        "what speaks least for it",
        "it is gone on with",
        "who looks six times finds something once",
        "of bearable size",
        "known by a hash of all that it hangs on",
        "the actor is told with its line",
        "the run is no more.",
    ],
)
def test_phrases_that_readers_stumbled_over_are_on_the_list(sentence: str) -> None:
    assert found(sentence, "part.md")


@pytest.mark.parametrize("sentence", ["no more than 3", "he is told to wait", "two files can be told apart"])
def test_plain_english_passes(sentence: str) -> None:
    assert found(sentence, "part.md") == []


@pytest.mark.slow  # `make lint` looks at the same
def test_nothing_of_ours_is_on_the_list() -> None:
    listed = phrases()
    paths = [path for path in sources() if re.search(r"\S", path.read_text(encoding="utf-8"))]
    assert len(paths) > 200
    assert [str(each) for path in paths for each in findings(path.read_text(encoding="utf-8"), path.name, listed)] == []
