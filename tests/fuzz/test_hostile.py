"""Some hostile inputs in every run of the tests; `make fuzz` tries 5,000, and others each time."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.fuzz.surfaces import SURFACES

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_hostile_inputs() -> None:
    inputs = 900
    # In processes of their own, which watch what they open, and whose memory is limited.
    command = [sys.executable, "-m", "tests.fuzz.hostile", "--inputs", str(inputs), "--seed", "2", "--jobs", "1"]
    done = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
    tried = dict.fromkeys((surface.name for surface in SURFACES), 0)
    for count, name in re.findall(r"^ *([\d,]+)  ([\w -]+): exit code \d", done.stdout, re.MULTILINE):
        tried[name] += int(count.replace(",", ""))
    assert tried == dict.fromkeys(tried, inputs // len(SURFACES))


def test_a_seed_makes_the_same_inputs(tmp_path: Path) -> None:
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


GUARDED = """
import sys
from pathlib import Path
from tests.fuzz.hostile import problem, settled
from tests.fuzz.surfaces import Case

home = settled(sys.argv[1], ())
folder = home / "input"
folder.mkdir()
for name, line in (("reads", "open('/etc/hostname')"), ("starts", "import os; os.system('true')")):
    file = folder / f"{name}.py"
    file.write_text(line)
    print(problem(home, folder, Case(("list", "actors", "--types", file), code=folder))[1].splitlines()[-1])
    print(problem(home, folder, Case(("list", "actors", "--types", file)))[1].splitlines()[-1])
"""


@pytest.mark.slow
def test_the_guard_tells_what_is_done(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", GUARDED, str(tmp_path)], cwd=ROOT, check=False, capture_output=True, text=True
    )
    told = [re.sub(r" \(.*", "", line) for line in done.stdout.splitlines()]
    touches = "touches what it must not: "
    assert told == [f"{touches}open", f"{touches}exec", f"{touches}os.system", f"{touches}exec"], done.stderr
