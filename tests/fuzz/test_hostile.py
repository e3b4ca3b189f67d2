"""Some hostile inputs in every run of the tests; `make fuzz` tries 5,000, and others each time."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.surfaces import SURFACES

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(("seed", "inputs"), [(1, 90), pytest.param(2, 900, marks=pytest.mark.slow)])
def test_hostile_inputs(seed: int, inputs: int) -> None:
    # In processes of their own, which watch what they open, and whose memory is limited.
    command = [sys.executable, "-m", "tests.fuzz.hostile", "--inputs", str(inputs), "--seed", str(seed)]
    done = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
    tried = dict.fromkeys((surface.name for surface in SURFACES), 0)
    for count, name in re.findall(r"^ *([\d,]+)  ([\w -]+): exit code \d", done.stdout, re.MULTILINE):
        tried[name] += int(count.replace(",", ""))
    assert tried == dict.fromkeys(tried, inputs // len(SURFACES))


def test_a_seed_makes_the_same_inputs(tmp_path: Path) -> None:
    import numpy as np

    for surface in SURFACES:
        if surface.name in ("MoML", "formulas", "pages"):
            (tmp_path / surface.name).mkdir()
            surface.prepare(tmp_path / surface.name)
            texts = []
            for folder in (tmp_path / f"{surface.name} one", tmp_path / f"{surface.name} two"):
                folder.mkdir()
                surface.make(np.random.default_rng(5), tmp_path / surface.name, folder)
                texts.append([each.read_bytes() for each in sorted(folder.iterdir())])
            assert texts[0] == texts[1]
