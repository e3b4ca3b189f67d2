"""What MkDocs asks for while it builds the site: pages from files outside of docs/, and the gallery."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

from website.gallery import exhibits, index

ROOT = Path(__file__).parents[1]
PARTS = ROOT / "site-parts"  # what is made on the way; mkdocs.yml names it, too
ABOVE = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}


def on_pre_build(config: Any) -> None:
    """Make the gallery, and the package as mkdocstrings looks for it: `epicycle` with our folders in it."""
    shutil.rmtree(PARTS, ignore_errors=True)
    package = PARTS / "epicycle"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()  # mkdocstrings does not look into namespace packages
    for folder in ("actors", "aspects", "runner"):
        (package / folder).symlink_to(ROOT / folder, target_is_directory=True)
    config.extra["gallery"] = exhibits(PARTS / "gallery")


def on_files(files: Files, *, config: Any) -> Files:
    """Add the documents above docs/, and the gallery."""
    for source, page in ABOVE.items():
        files.append(File.generated(config, page, content=as_page((ROOT / source).read_text(encoding="utf-8"))))
    shown = config.extra["gallery"]
    files.append(File.generated(config, "gallery/index.md", content=index(shown)))
    for each in shown:
        files.append(File.generated(config, f"gallery/{each.name}.md", content=each.page))
        for made in sorted((PARTS / "gallery" / each.name).iterdir()):
            place = f"gallery/{each.name}/{made.name}"
            files.append(File.generated(config, place, abs_src_path=os.fspath(made)))
    return files


def on_post_build(config: Any) -> None:
    """Remove what was made on the way."""
    shutil.rmtree(PARTS, ignore_errors=True)


def as_page(document: str) -> str:
    """A document of the root with the links that it has as a page of the site."""
    for source, page in ABOVE.items():
        document = document.replace(f"]({source}", f"]({page}")
    return re.sub(r"(\]\(|src=\")docs/", r"\1", document)
