"""Dotted paths."""

from __future__ import annotations

import pytest

from epicycle.actors import paths


@pytest.mark.parametrize(
    ("path", "parent", "name", "ancestors"),
    [
        ("robot[1].sensor.output", "robot[1].sensor", "output", ["robot[1].sensor", "robot[1]", ""]),
        ("clock", "", "clock", [""]),
        ("", "", "", []),
    ],
)
def test_parts(path: str, parent: str, name: str, ancestors: list[str]) -> None:
    assert (paths.parent(path), paths.name(path), paths.ancestors(path)) == (parent, name, ancestors)
    assert paths.join(parent, name) == path
    assert all(paths.is_within(path, outer) for outer in (path, *ancestors))
    assert [paths.join(outer, paths.relative(path, outer)) for outer in ancestors] == [path] * len(ancestors)


def test_a_name_that_begins_alike_is_not_within() -> None:
    assert not paths.is_within("robots.sensor", "robot")
    assert not paths.is_within("robot", "robot.sensor")
    assert paths.relative("robots.sensor", "robot") == "robots.sensor"
