"""A study with its results, which many tests read and some damage."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.study.study_commands import study
from tests.study.study_parts import write


@pytest.fixture(scope="session")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and its results in ``out``."""
    folder = tmp_path_factory.mktemp("done")
    write(folder)
    assert study(folder, "--jobs", 2) == 0
    return folder


@pytest.fixture
def copied(done: Path, tmp_path: Path) -> Path:
    """Results to damage."""
    shutil.copytree(done, tmp_path, dirs_exist_ok=True)
    return tmp_path
