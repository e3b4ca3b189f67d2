"""What MkDocs calls while it builds the site: pages from files outside docs/, and the gallery."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files, InclusionLevel

from website.gallery import exhibits, index
from website.notebook import page as notebook_page
from website.reference import FOLDER, reference
from website.truth import draw_truth, truth_page

ROOT = Path(__file__).parents[1]
PARTS = ROOT / "site-parts"  # temporary files; mkdocs.yml names the folder, too
ABOVE = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "ptolemy/README.md": "ptolemy_room.md",
}
REFERENCE = reference((ROOT / "docs" / "reference.md").read_text(encoding="utf-8"))


def on_startup(*, command: str, dirty: bool) -> None:
    """Lay out the package as mkdocstrings expects it: `epicycle`, with our folders in it."""
    del command, dirty
    shutil.rmtree(PARTS, ignore_errors=True)
    package = PARTS / "epicycle"
    package.mkdir(parents=True)
    for name in ("__init__.py", "__init__.pyi"):
        (package / name).symlink_to(ROOT / "api" / name)
    for folder in ("actors", "aspects", "bridges", "ptolemy", "runner"):
        (package / folder).symlink_to(ROOT / folder, target_is_directory=True)


def on_files(files: Files, *, config: Any) -> Files:
    """Add the documents above docs/, the pages of the reference, and the gallery."""
    for source, page in ABOVE.items():
        files.append(File.generated(config, page, content=as_page((ROOT / source).read_text(encoding="utf-8"))))
    files.remove(files.src_uris["reference.md"])
    files.append(File.generated(config, "reference.md", content=REFERENCE.overview))
    for name, content in REFERENCE.pages.items():
        files.append(File.generated(config, f"{FOLDER}/{name}", content=content))
    for notebook in sorted((ROOT / "docs").rglob("*.ipynb")):
        place = notebook.relative_to(ROOT / "docs").as_posix()
        files.remove(files.src_uris[place])
        content = notebook_page(notebook)
        files.append(File.generated(config, place.replace(".ipynb", ".md"), content=content))
    files.append(File.generated(config, "truth.md", content=truth_page()))
    for picture in draw_truth(PARTS / "truth"):
        files.append(File.generated(config, f"truth/{picture.name}", abs_src_path=os.fspath(picture)))
    shown = exhibits(PARTS / "gallery")
    files.append(File.generated(config, "gallery/index.md", content=index(shown)))
    for each in shown:
        shown_page = File.generated(config, f"gallery/{each.name}.md", content=each.page)
        shown_page.inclusion = InclusionLevel.NOT_IN_NAV  # the gallery's first page links to it
        files.append(shown_page)
        for made in sorted((PARTS / "gallery" / each.name).iterdir()):
            place = f"gallery/{each.name}/{made.name}"
            files.append(File.generated(config, place, abs_src_path=os.fspath(made)))
    return files


def on_post_build(config: Any) -> None:
    """Remove temporary files."""
    shutil.rmtree(PARTS, ignore_errors=True)


def as_page(document: str) -> str:
    """A document outside docs/ with its links adapted to its place on the site."""
    for source, page in {**ABOVE, "benchmarks/TRUTH.md": "truth.md"}.items():
        document = document.replace(f"]({source}", f"]({page}")
    return linked(re.sub(r"\]\((\.\./)?docs/", "](", document))


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Adapt the links of a page, and let mkdocstrings fill in that of the Python API."""
    if page.file.src_uri == "api.md":
        markdown = re.sub(r"^- `(epicycle[.\w]+)`.*$", r"::: \1\n", markdown, flags=re.M)
    for source, target in ABOVE.items():
        markdown = markdown.replace(f"](../{source}", f"]({target}")
    return linked(markdown)


def linked(document: str) -> str:
    """The document with links to the pages made from notebooks, and to those of the reference."""
    return REFERENCE.linked(re.sub(r"(\]\([\w./-]+)\.ipynb\)", r"\1.md)", document))
