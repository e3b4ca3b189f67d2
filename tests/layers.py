"""The order of imports, as pyproject.toml has it under ``tool.importlinter``: ``python -m tests.layers``.

Import Linter looks for packages in folders, and ours lie in the tree of ``epicycle`` only when it is installed: it is
shown a tree of links.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def main() -> int:
    """Check all contracts; the exit code."""
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder, "epicycle")
        package.mkdir()
        for name in ("actors", "aspects", "bridges", "models", "ptolemy", "runner"):
            (package / name).symlink_to(ROOT / name)
        for file in (ROOT / "api").glob("*.py"):
            (package / file.name).symlink_to(file)
        words = [Path(sys.executable).with_name("lint-imports"), "--no-logo", "--no-cache"]
        return subprocess.run(words, cwd=ROOT, env={**os.environ, "PYTHONPATH": folder}, check=False).returncode


if __name__ == "__main__":
    raise SystemExit(main())
