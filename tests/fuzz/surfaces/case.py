"""What a surface is: a place where input of others comes in, and commands that read it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.mutants import HOSTILE, SPICE

MODEL = """
model: small
parameters: {size: 2.0, wait: 1 s}
actors:
  clock: {type: Clock, period: "${wait}"}
  ramp: {type: Ramp, step: "${size}"}
  scale: {type: Scale, factor: 2}
connections: [clock.output -> ramp.trigger, ramp.output -> scale.input]
aspects: {loss: {type: PacketLoss, probability: 0.3, at: scale.input}}
run: {stop: 8 s, record: [scale.output]}
metrics: {last: {of: scale.output, take: last}}
monitors: {low: always scale.output <= 20}
"""


@dataclass(frozen=True)
class Answer:
    """What a command said, and its exit code."""

    code: int
    out: str
    err: str


@dataclass(frozen=True)
class Case:
    """A command of Epicycle and, for what must not change in silence, a judge: what is wrong with an answer."""

    arguments: tuple[object, ...]
    judge: Callable[[Answer], str] = lambda answer: ""
    path: Path | None = None  # a folder of installed packages, for this command
    code: Path | None = None  # where code may be run, as the user has named it


@dataclass(frozen=True)
class Surface:
    """``prepare`` makes good files in a folder, once; ``make`` puts a hostile input into another."""

    name: str
    prepare: Callable[[Path], None]
    make: Callable[[np.random.Generator, Path, Path], Case]


def chosen(random: np.random.Generator, items: Any) -> Any:
    """One of the items."""
    return items[int(random.integers(len(items)))]


def spoiled(data: bytes, random: np.random.Generator) -> bytes:
    """The bytes after a few accidents: cut short, changed, doubled, or with something strange in between."""
    for _ in range(int(random.integers(1, 4))):
        at = int(random.integers(len(data) + 1))
        end = at + int(random.integers(1, 40))
        match int(random.integers(6)):
            case 0:
                data = data[:at]
            case 1:
                data = data[:at] + bytes([int(random.integers(256))]) + data[at + 1 :]
            case 2:
                data = data[:at] + data[end:]
            case 3:
                data = data[:end] + data[at:]
            case 4:
                data = data[:at] + chosen(random, SPICE).encode("utf-8", "surrogatepass") + data[at:]
            case _:
                data = data[:at] + str(chosen(random, "0123456789")).encode() + data[at + 1 :]
    return data


def twisted(tree: Any, random: np.random.Generator) -> Any:
    """A tree of JSON with a few of its values replaced, removed, or put elsewhere."""
    tree = json.loads(json.dumps(tree))
    for _ in range(int(random.integers(1, 4))):
        places = list(_places(tree))
        if not places:
            return chosen(random, HOSTILE)
        holder, key = chosen(random, places)
        match int(random.integers(4)):
            case 0:
                del holder[key]
            case 1:
                other, at = chosen(random, places)
                holder[key] = json.loads(json.dumps(other[at])) if at in _keys(other) else None
            case _:
                holder[key] = chosen(random, HOSTILE)
    return tree


def _keys(holder: Any) -> Any:
    return holder if isinstance(holder, dict) else range(len(holder))


def _places(tree: Any) -> Any:
    if isinstance(tree, (dict, list)):
        for key in _keys(tree):
            yield tree, key
            yield from _places(tree[key])


def write(folder: Path, name: str, text: str) -> Path:
    """A file with a text."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", errors="backslashreplace")
    return path
