"""The pages of the reference: docs/reference.md, one long document, as an overview and a page for each purpose."""

from __future__ import annotations

import re
from typing import NamedTuple

FOLDER = "reference"  # of the pages, beside the overview
# Chapters that share a page; each other chapter without purposes has its own.
SHARED = {
    "Values of parameters": ("FilterDesign", "Distribution", "Generator", "Dynamics", "Objective", "Solver"),
    "Metrics and figures": ("Metrics", "Figures", "Figures of studies"),
}
_CHAPTER = re.compile(r"^## (.+)\n", re.M)
_ENTRY = re.compile(r"^(?=### )", re.M)
_PURPOSE = re.compile(r"^\*\*(?P<title>.+)\.\*\* (?P<doc>.+)\n\n(?P<table>(?:\|.*\n)+)", re.M)
_INSIDE = re.compile(r"\]\(#([\w-]+)\)")
_OUTSIDE = re.compile(r"(\]\((?:\.\./)*)reference\.md#([\w-]+)\)")


class Reference(NamedTuple):
    """The overview, the other pages by the names of their files, and the file of each heading."""

    overview: str
    pages: dict[str, str]
    places: dict[str, str]

    def linked(self, document: str) -> str:
        """Another document with links that lead to the pages."""
        return _OUTSIDE.sub(lambda found: f"{found[1]}{FOLDER}/{self.places[found[2]]}#{found[2]})", document)


def reference(document: str) -> Reference:
    """Split the document."""
    head, *chapters = _CHAPTER.split(document)
    overview, pages, others = [head.rstrip()], dict[str, str](), dict[str, list[str]]()
    for chapter, text in zip(chapters[::2], chapters[1::2], strict=True):
        start, *entries = _ENTRY.split(text)
        purposes = list(_PURPOSE.finditer(start))
        if not purposes:
            title = next((title for title, shared in SHARED.items() if chapter in shared), chapter)
            page = pages.setdefault(_file(title), f"# {title}\n")
            pages[_file(title)] = page + (f"\n## {chapter}\n{text}" if title != chapter else text)
            others.setdefault(title, []).append(f"[{chapter}](#{_slug(chapter)})")
            continue
        overview.append(f"## {chapter}")
        by_slug = {_slug(entry.partition("\n")[0]): entry[1:] for entry in entries}
        for title, doc, table in (purpose.groups() for purpose in purposes):
            overview += [f"**[{title}]({FOLDER}/{_file(title)}).** {doc}", table]
            own = [by_slug.pop(slug) for slug in re.findall(r"^\| \[.+?\]\(#([\w-]+)\)", table, re.M)]
            pages[_file(title)] = f"# {title}\n\n{doc}\n\n{table}\n{''.join(own)}"
        if by_slug:
            raise ValueError(f"no purpose lists {', '.join(by_slug)}")
    overview += ["## Values, metrics, figures and keys", "\n".join(f"- {', '.join(each)}" for each in others.values())]
    places: dict[str, str] = {}
    for file, page in pages.items():
        for heading in re.findall(r"^#+ .+$", page, re.M):
            places.setdefault(_slug(heading), file)  # a link leads to the first of two that are equal
    linked = {
        file: _INSIDE.sub(lambda found: f"]({places[found[1]]}#{found[1]})", page) for file, page in pages.items()
    }
    start = _INSIDE.sub(lambda found: f"]({FOLDER}/{places[found[1]]}#{found[1]})", "\n\n".join(overview))
    return Reference(start + "\n", linked, places)


def _slug(title: str) -> str:
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", title).strip().lower())


def _file(title: str) -> str:
    return f"{_slug(title)}.md"
