"""The revision of a repository is read without running anything."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from epicycle.runner.study.provenance import git_revision


def git(folder: Path, *words: str) -> str:
    """What git says, without the configuration of this machine."""
    who = ["-c", "user.name=A", "-c", "user.email=a@b.c", "-c", "commit.gpgsign=false"]
    done = subprocess.run(["git", *who, *words], cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout.strip()


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    folder = tmp_path / "repository"
    folder.mkdir()
    git(folder, "init", "-q", "-b", "main")
    (folder / "model.yaml").write_text("model: a\n")
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "first")
    return folder


def test_the_revision_is_read_wherever_git_keeps_it(repository: Path, tmp_path: Path) -> None:
    head = git(repository, "rev-parse", "HEAD")
    inside = repository / "models"
    inside.mkdir()
    assert git_revision(inside) == head
    git(repository, "worktree", "add", "-q", "-b", "other/branch", "../tree")
    git(tmp_path / "tree", "commit", "-qm", "second", "--allow-empty")
    second = git(tmp_path / "tree", "rev-parse", "HEAD")
    assert (git_revision(tmp_path / "tree"), git_revision(repository)) == (second, head)
    git(repository, "pack-refs", "--all")
    assert (git_revision(tmp_path / "tree"), git_revision(repository)) == (second, head)
    git(repository, "checkout", "-q", "--detach", second)
    assert git_revision(repository) == second


def test_no_program_of_the_repository_is_run(repository: Path, tmp_path: Path) -> None:
    head, run = git(repository, "rev-parse", "HEAD"), tmp_path / "run"
    program = tmp_path / "program"
    program.write_text(f"#!/bin/sh\ntouch {run}\ncat\n")
    program.chmod(0o755)
    (repository / ".gitattributes").write_text("* filter=own\n")
    for key in ("core.fsmonitor", "filter.own.clean", "core.sshCommand", "core.pager"):
        git(repository, "config", key, str(program))
    (repository / "model.yaml").write_text("model: b\n")
    assert git_revision(repository) == head
    assert not run.exists()


@pytest.mark.parametrize(
    "head",
    ["ref: refs/../../secret", "ref: ../secret", "ref: refs/heads/none", "ref: HEAD", "\0", "ref: refs/heads/main"],
)
def test_a_head_that_leads_nowhere(tmp_path: Path, head: str) -> None:
    refs = tmp_path / ".git" / "refs" / "heads"
    refs.mkdir(parents=True)
    (refs / "main").write_text("ref: refs/heads/main")
    (tmp_path / "secret").write_text("0" * 40)
    (tmp_path / ".git" / "HEAD").write_text(head)
    assert git_revision(tmp_path) is None
