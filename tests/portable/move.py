"""After a change of the log's form: ``python -m tests.portable.move [--check]`` moves digests, and nothing else.

All of ``golden.json`` is computed in the old form (``old_form``) first.  Only what is equal there has the same records
as before, with the same times, order and values; its digest in the present form is then written to ``golden.json`` and
to what the tutorials show.  ``--check`` only compares.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .digests import hashed, parts, printed, tutorials
from .portable import GOLDEN, ROOT

OLD = Path(__file__).with_name("old_form")
SHOWN = re.compile(r"\b[0-9a-f]{16}\b")  # the beginning of a digest, as it is shown


def everything(old: bool) -> dict[str, tuple[str, list[str]]]:
    """The digest of each part, and what it prints if it is a tutorial."""
    more = {"PYTHONPATH": f"{OLD}{os.pathsep}{ROOT}", "EPICYCLE_CORE": "python"} if old else {}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "tests.portable.move", "--tell"],
        check=True, cwd=ROOT, env={**os.environ, **more}, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    rows = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("[")]
    return {name: (digest, lines) for name, digest, lines in rows}


def tell() -> None:
    """Print it, a line for each part."""
    for name, compute in parts().items():
        lines = printed(tutorials()[name]) if name in tutorials() else []
        print(json.dumps([name, hashed(*lines) if lines else compute(), lines]), flush=True)


def main(*options: str) -> int:
    """Compare, then write; 1 if some part has other records than before."""
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(everything, [True] if "--check" in options else [True, False]))
    before, new = found[0], found[-1]
    golden = json.loads(GOLDEN.read_text())
    others = [name for name in golden if before[name][0] != golden[name]]
    print(f"{len(golden) - len(others)} of {len(golden)} digests are the same in the old form")
    print(*(f"{name}: the records are others, or the digest has been moved already" for name in others), sep="\n")
    if others or "--check" in options:
        return bool(others)
    GOLDEN.write_text(json.dumps({name: digest for name, (digest, _) in new.items()}, indent=2) + "\n")
    moved = {}
    for name, path in tutorials().items():
        for one, other in zip(before[name][1], new[name][1], strict=True):
            if SHOWN.sub("", one) != SHOWN.sub("", other):
                raise SystemExit(f"{name} prints something else: {one!r}, now {other!r}")
            moved.update(zip(SHOWN.findall(one), SHOWN.findall(other), strict=True))
        text = path.read_text(encoding="utf-8")
        path.write_text(SHOWN.sub(lambda found: moved.get(found[0], found[0]), text), encoding="utf-8")
    changed = sum(before[name][0] != new[name][0] for name in golden)
    print(f"{changed} digests moved in golden.json, {sum(a != b for a, b in moved.items())} in tutorials")
    return 0


if __name__ == "__main__":
    sys.exit(tell() if sys.argv[1:] == ["--tell"] else main(*sys.argv[1:]))
