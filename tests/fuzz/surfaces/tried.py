"""``tried-*.jsonl``: what a search noted, of which lines were changed; its answer must not change with them."""

from __future__ import annotations

import json
import shutil
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np

from epicycle.runner.interface.cli import main
from tests.fuzz.surfaces.case import MODEL, Answer, Case, Surface, chosen, spoiled, twisted, write

_RARE = ("--monitor", "low", "--runs", "10", "--repetitions", "2")
_EXPLAIN = ("--no-page", "--runs", "10")


def _said(*arguments: object) -> str:
    with redirect_stdout(StringIO()) as out:
        main([str(each) for each in arguments])
    return out.getvalue()


def _prepare(home: Path) -> None:
    write(home, "m.yaml", MODEL)
    for command, options in (("rare", _RARE), ("explain", _EXPLAIN)):
        said = _said(command, home / "m.yaml", *options, "--out", home / command)
        write(home, f"{command}.txt", said.replace(str(home), ""))


def _make(random: np.random.Generator, home: Path, folder: Path) -> Case:
    command, options = chosen(random, (("rare", _RARE), ("explain", _EXPLAIN)))
    shutil.copytree(home / command, folder / command)
    (file,) = (folder / command).glob("tried-*.jsonl")
    if random.random() < 0.4:
        file.write_bytes(spoiled(file.read_bytes(), random))
    else:
        lines = file.read_text(encoding="utf-8").splitlines()
        at = int(random.integers(len(lines)))
        lines[at] = json.dumps(twisted(json.loads(lines[at]), random))
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    expected = (home / f"{command}.txt").read_text(encoding="utf-8")

    def judge(answer: Answer) -> str:
        same = answer.out.replace(str(folder), "") == expected
        return "" if same or answer.code not in (0, 3) else f"another answer than {expected!r}"

    return Case((command, home / "m.yaml", *options, "--out", folder / command), judge)


SURFACE = Surface("tried", _prepare, _make)
