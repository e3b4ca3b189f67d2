"""Dotted paths such as ``robot[1].sensor.output``: texts, and what is asked of them; empty is the whole model."""

from __future__ import annotations


def parent(path: str) -> str:
    """The path of what it is a part of: ``robot[1].sensor`` of ``robot[1].sensor.output``."""
    return path.rpartition(".")[0]


def name(path: str) -> str:
    """Its last name: ``output`` of ``robot[1].sensor.output``."""
    return path.rpartition(".")[2]


def join(outer: str, inner: str) -> str:
    """The path of something that is called ``inner`` within ``outer``."""
    return f"{outer}.{inner}" if outer and inner else outer or inner


def is_within(path: str, outer: str) -> bool:
    """Whether it is ``outer`` or any part of it."""
    return not outer or path == outer or path.startswith(f"{outer}.")


def relative(path: str, outer: str) -> str:
    """The path as it is written within ``outer``, in which it lies: ``sensor.output`` within ``robot[1]``."""
    return path.removeprefix(f"{outer}.") if outer else path


def ancestors(path: str) -> list[str]:
    """The paths that it lies within, the nearest first, the whole model last."""
    found = []
    while path:
        path = parent(path)
        found.append(path)
    return found
