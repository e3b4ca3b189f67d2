"""start something of your own: a model, or a package of actors"""

from __future__ import annotations

import argparse
from pathlib import Path

from ...support.printing import tell
from .options import DONE, command, option

TEMPLATES = Path(__file__).parent / "templates"
MODEL = {"$name.yaml": "model.yaml"}
PACKAGE = {
    "pyproject.toml": "pyproject.toml",
    "README.md": "README.md",
    "$name.yaml": "use.yaml",
    "src/$name/__init__.py": "source.py",
    "tests/test_$name.py": "tests.py",
}


@command(
    "start a model or a package of actors",
    option("name", metavar="NAME", help="its name, such as my_model"),
    option(
        "--package",
        action="store_true",
        help="a Python package with an actor, an aspect, a model that uses them and tests, in a folder NAME",
    ),
    imports=("model.text",),
)
def new(options: argparse.Namespace) -> int:
    """Write NAME.yaml, a model to start from, which is ready to run.

    With --package, write a package whose entry points make its actors and aspects known to models.
    """
    from keyword import iskeyword
    from string import Template

    from epicycle.actors import EpicycleError

    from ...model.text.reading import NAME, NAMES_HAVE

    name: str = options.name
    if not NAME.match(name) or iskeyword(name) or not name.isascii():
        raise EpicycleError(f"{name!r} is not a name\n   help: {NAMES_HAVE}")
    files = PACKAGE if options.package else MODEL
    home = Path(name) if options.package else Path()
    texts = {
        home / Template(path).substitute(name=name): Template(
            (TEMPLATES / f"{template}.template").read_text(encoding="utf-8")
        ).substitute(name=name)
        for path, template in files.items()
    }
    there = [path for path in ([home] if options.package else texts) if path.exists()]
    if there:
        raise EpicycleError(f"{there[0]} already exists\n   help: choose another name or another folder")
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        tell(f"wrote {path}")
    if options.package:
        tell(f"install it: pip install --editable {name}; then: epicycle run {name}/{name}.yaml")
    else:
        tell(f"run it: epicycle run {name}.yaml")
    return DONE
