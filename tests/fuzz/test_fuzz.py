"""Some mutants of good models in every run of the tests; `make fuzz` tries many more, and others each time."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_mutants_of_good_models() -> None:
    mutants = 2_000
    # In a process of its own, which watches what it opens, and whose memory is limited.
    command = [sys.executable, "-m", "tests.fuzz.fuzz", "--mutants", str(mutants), "--seed", "2", "--jobs", "1"]
    done = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    counted = re.search(
        rf"{mutants:,} mutants: ([\d,]+) rejected, ([\d,]+) accepted, ([\d,]+) run", done.stdout.splitlines()[-2]
    )
    assert counted is not None
    rejected, accepted, run = (int(each.replace(",", "")) for each in counted.groups())
    assert rejected + accepted == mutants
    assert rejected > mutants / 2
    assert run > mutants / 20
