"""The truth board: what others have published, beside what Epicycle finds, into benchmarks/TRUTH.md and TRUTH.json.

    python -m benchmarks.truth [SOURCE ...] [--jobs N] [--check]

What was made is in results/truth and not made again.  With names of sources the tables are only printed; with
``--check``, the program fails if the page differs from the one in the folder.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.truth.board import FOUND, HERE, SOURCES, as_text, lines_of, page, section, source

PAGE = HERE.parent / "TRUTH.md"


def main() -> None:
    """Run the sources that the command line names, or all."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("sources", nargs="*", metavar="SOURCE", choices=[*SOURCES, []], help=", ".join(SOURCES))
    options.add_argument("--jobs", type=int, help="processes at a time (default: one per core)")
    options.add_argument("--check", action="store_true", help="compare with the page instead of writing it")
    given = options.parse_args()
    found = {name: lines_of(name, given.jobs) for name in given.sources or SOURCES}
    if given.sources:
        print("\n\n".join(section(source(name), lines) for name, lines in found.items()))
        return
    for path, text in ((PAGE, page(found)), (FOUND, as_text(found))):
        if not given.check:
            path.write_text(text, encoding="utf-8")
            print(f"wrote {Path('benchmarks') / path.name}")
        elif path.read_text(encoding="utf-8") != text:
            sys.exit(f"{path.name} is not what was found now")


if __name__ == "__main__":
    main()
