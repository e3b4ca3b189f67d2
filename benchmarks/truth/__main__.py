"""The truth board: what others have published, beside what Epicycle finds, into benchmarks/TRUTH.md.

    python -m benchmarks.truth [SOURCE ...] [--jobs N] [--check]

What was made is in results/truth and not made again.  With names of sources the tables are only printed; with
``--check``, the program fails if the page differs from the one in the folder.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.truth.board import HERE, SOURCES, lines_of, page, section, source

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
    text = page(found)
    if given.check:
        sys.exit(0 if PAGE.read_text(encoding="utf-8") == text else f"{PAGE.name} is not what was found now")
    PAGE.write_text(text, encoding="utf-8")
    print(f"wrote {Path('benchmarks') / PAGE.name}")


if __name__ == "__main__":
    main()
