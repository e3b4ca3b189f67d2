"""Manifests of runs and studies: results folders that were sent, whose manifest says something else."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from epicycle.runner.interface.cli import main
from epicycle.runner.study.run.manifest import manifest_text
from tests.fuzz.surfaces.case import MODEL, Case, Surface, chosen, spoiled, twisted, write

STUDY = """
study: small_study
model: ./m.yaml
vary: {size: [1.0, 2.0]}
replications: 2
"""
EVIL = "open('/etc/passwd').read()\nraise SystemExit('code of the folder was run')\n"


def make_results(home: Path) -> None:
    """A run and a study of a small model."""
    write(home, "m.yaml", MODEL)
    write(home, "s.yaml", STUDY)
    main(["run", str(home / "m.yaml"), "--out", str(home / "run")])
    main(["study", str(home / "s.yaml"), "--out", str(home / "study"), "--jobs", "1"])
    main(["report", str(home / "study"), "--jobs", "1"])
    main(["view", str(home / "run"), "-o", str(home / "page.html")])


def commands(random: np.random.Generator, results: Path, kind: str) -> tuple[object, ...]:
    """One of those that read such a folder."""
    out = results.parent / "out"
    if kind == "run":
        return chosen(random, (
            ("view", results, "-o", results.parent / "page.html"),
            ("explain", results, "--out", out, "--no-page", "--runs", 5),
        ))  # fmt: skip
    return chosen(random, (
        ("status", results),
        ("status", results, "--conditions", "--json"),
        ("report", results, "--out", out, "--jobs", 1),
        ("study", results, "--jobs", 1),
        ("run", f"{results}/{chosen(random, '0123456789abcdef')}", "--out", out),
    ))  # fmt: skip


def _more(tree: Any, folder: Path, random: np.random.Generator) -> Any:
    """The manifest with code, or another file, in it."""
    evil = str(write(folder, "evil.py", EVIL))
    if isinstance(tree, dict):
        key = chosen(random, ("types", "file", "model", "source", "origin", "command", "includes", "overrides"))
        tree[key] = chosen(
            random, ([evil], evil, {"evil": evil}, ["/etc/passwd"], "/etc/passwd", "../../../etc/passwd")
        )
    return tree


def _summed(tree: Any) -> str:
    """The manifest as text, with the checksum that is right for it, as whoever changes one can compute it."""
    return manifest_text(tree) if isinstance(tree, dict) and "checksum" in tree else json.dumps(tree)


def _make(random: np.random.Generator, home: Path, folder: Path) -> Case:
    kind = str(chosen(random, ("run", "study")))
    results = folder / kind
    shutil.copytree(home / kind, results, ignore=shutil.ignore_patterns("figures", "report.html"))
    manifest = results / "manifest.json"
    tree = json.loads(manifest.read_text(encoding="utf-8"))
    match int(random.integers(3)):
        case 0:
            manifest.write_bytes(spoiled(manifest.read_bytes(), random))
        case 1:
            manifest.write_text(_summed(twisted(tree, random)), encoding="utf-8")
        case _:
            manifest.write_text(_summed(_more(tree, folder, random)), encoding="utf-8")
    return Case(commands(random, results, kind))


SURFACE = Surface("manifests", make_results, _make)
