"""Patterns against the plainest way to say what they mean."""

from __future__ import annotations

import time

from hypothesis import given
from hypothesis import strategies as st

from epicycle.runner.model.text.patterns import matches, select


def fits(pattern: list[str], path: list[str]) -> bool:
    """Whether the segments of a pattern select those of a path."""
    if not pattern:
        return not path
    if pattern[0] == "**":
        return any(fits(pattern[1:], path[taken:]) for taken in range(1, len(path) + 1))
    if not path:
        return False
    fits_here = pattern[0][0] == "*" or pattern[0] == path[0] or pattern[0] == f"{path[0][:-3]}[*]"
    return fits_here and fits(pattern[1:], path[1:])


@given(
    st.lists(st.sampled_from(["a", "b", "*", "**", "**", "a[*]", "a[1]", "*[*]"]), min_size=1, max_size=7),
    st.lists(st.sampled_from(["a", "b", "a[0]", "a[1]", "b[1]"]), min_size=1, max_size=8),
)
def test_a_pattern_selects_what_its_segments_say(pattern: list[str], path: list[str]) -> None:
    assert matches(".".join(pattern), ".".join(path)) == fits(pattern, path)


def test_no_pattern_takes_for_ever() -> None:
    started = time.process_time()
    deep = ".".join("a" * 50)
    assert not matches(".".join(["**"] * 25 + ["x"]), deep)
    assert not matches(".".join(["**", "a"] * 12 + ["x"]), deep)
    assert time.process_time() - started < 1


def test_the_path_of_the_model_itself_is_empty() -> None:
    assert select("a.*.c", ["", "a.b[0].c", "a.b[0]", "d"]) == ["a.b[0].c"]
    assert select("*", ["", "a.b"]) == select("**", ["", "a.b"])[:1] == [""]
