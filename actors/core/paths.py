"""Dotted paths such as ``robot[1].sensor.output``, as texts; the empty path is the whole model."""

from __future__ import annotations


def parent(path: str) -> str:
    """The path of the parent: ``robot[1].sensor`` of ``robot[1].sensor.output``."""
    return path.rpartition(".")[0]


def name(path: str) -> str:
    """Its last name: ``output`` of ``robot[1].sensor.output``."""
    return path.rpartition(".")[2]


def join(outer: str, inner: str) -> str:
    """The path of ``inner`` within ``outer``."""
    return f"{outer}.{inner}" if outer and inner else outer or inner


def is_within(path: str, outer: str) -> bool:
    """Whether the path is ``outer`` or a part of it."""
    return not outer or path == outer or path.startswith(f"{outer}.")


def relative(path: str, outer: str) -> str:
    """The path relative to ``outer``, which contains it: ``sensor.output`` within ``robot[1]``."""
    return path.removeprefix(f"{outer}.") if outer else path


def ancestors(path: str) -> list[str]:
    """The paths that contain it, the nearest first, the whole model last."""
    found = []
    while path:
        path = parent(path)
        found.append(path)
    return found
