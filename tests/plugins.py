"""The parts of Epicycle that are plug-ins: without their folders everything else works, and its tests pass.

``python -m tests.plugins [arguments of pytest]`` runs the tests in a copy that lacks the plug-ins and their tests.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
PLUGINS = ("ptolemy",)
ABSENT = tuple(name for name in PLUGINS if not (ROOT / name).is_dir())
BLOCKER = """\
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[:2] in [["epicycle", plugin] for plugin in PLUGINS]:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Blocker())
"""
METADATA = "Metadata-Version: 2.1\nName: epicycle\nVersion: 0.1.0\n"


def _offered() -> str:
    """The entry points of what is no plug-in, as they stand in an installation."""
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["entry-points"]
    lines: list[str] = []
    for group, points in groups.items():
        kept = [f"{name} = {value}" for name, value in points.items() if value.startswith("epicycle.bridges")]
        lines += [f"\n[{group}]", *kept] if kept else []
    return "\n".join([*lines, ""])


def copied(to: Path) -> dict[str, str]:
    """Copy what is under version control, without plug-ins; returns the environment in which the copy is Epicycle."""
    words = ["git", "ls-files", "-co", "--exclude-standard"]
    for name in subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines():
        is_of_plugin = name.split("/")[0] in PLUGINS or name.split("/")[:2] in [["tests", each] for each in PLUGINS]
        if not is_of_plugin and (ROOT / name).is_file():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, to / name)
    package = to / "links" / "epicycle"
    package.mkdir(parents=True)
    for folder in ("actors", "aspects", "bridges", "models", "runner"):
        (package / folder).symlink_to(to / folder)
    for file in (to / "api").iterdir():
        (package / file.name).symlink_to(file)
    # What comes first on the path counts: this package has no plug-ins, and they cannot be imported.
    info = to / "links" / "epicycle-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(METADATA, "utf-8")
    points = "[console_scripts]\nepicycle = epicycle.runner.interface.cli:main\n" + _offered()
    (info / "entry_points.txt").write_text(points, "utf-8")
    (to / "links" / "sitecustomize.py").write_text(f"PLUGINS = {PLUGINS!r}\n{BLOCKER}", "utf-8")
    settings = {key: value for key, value in os.environ.items() if not key.startswith("EPICYCLE_")}
    return {**settings, "PYTHONPATH": str(to / "links")}


def main(arguments: list[str]) -> int:
    """Run tests without the plug-ins; the exit code of pytest."""
    with tempfile.TemporaryDirectory() as folder:
        environment = copied(Path(folder))
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments]
        return subprocess.run(words, cwd=folder, env=environment, check=False).returncode


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
