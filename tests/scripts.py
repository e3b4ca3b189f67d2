"""Checks the types in the JavaScript of our pages: ``python -m tests.scripts``, by TypeScript's compiler.

Where neither ``tsc`` nor node's ``npx`` is, it says so and checks nothing.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from epicycle.runner.interface.studio.server import OWN
from epicycle.runner.show.view.page import PARTS

ROOT = Path(__file__).parents[1]
VERSION = "5.9.3"  # of TypeScript
PATIENCE = 300.0  # s for a download
OPTIONS = "--noEmit --allowJs --checkJs --strict --strictNullChecks false --target es2023 --lib es2023,dom,dom.iterable"
_VIEW, _REPORT = ROOT / "runner" / "show" / "view" / "browser", ROOT / "runner" / "show" / "report"
_STUDIO = ROOT / "runner" / "interface" / "studio" / "browser"
_SHARED = [_VIEW / "types.d.ts", *(_VIEW / f"{part}.js" for part in PARTS)]
# Each is one program, whose files see each other's names.
PROGRAMS = {
    "the page of a run": [*_SHARED, _VIEW / "main.js"],
    "the page of the studio": [*_SHARED, _STUDIO / "types.d.ts", *(_STUDIO / f"{part}.js" for part in OWN)],
    "the page of a report": [_REPORT / "page.js"],
}


def compiler() -> list[str] | None:
    """The command of TypeScript's compiler; None if there is none and none can be had."""
    if (found := shutil.which("tsc")) is not None:
        return [found]
    if (npx := shutil.which("npx")) is None:
        return None
    command = [npx, "--yes", "--package", f"typescript@{VERSION}", "tsc"]
    try:
        subprocess.run([*command, "--version"], check=True, capture_output=True, timeout=PATIENCE)
    except (OSError, subprocess.SubprocessError):
        return None
    return command


def main() -> int:
    """Check all programs; the exit code is 1 if one has mistakes."""
    if (command := compiler()) is None:
        print("JavaScript: not checked: there is no tsc, and no npx that can get it")
        return 0
    wrong = 0
    for name, files in PROGRAMS.items():
        done = subprocess.run([*command, *OPTIONS.split(), *map(str, files)], check=False, cwd=ROOT)
        if done.returncode:
            print(f"JavaScript: mistakes in {name}")
            wrong = 1
    if not wrong:
        print("JavaScript: types are right")
    return wrong


if __name__ == "__main__":
    sys.exit(main())
