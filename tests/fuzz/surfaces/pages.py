"""Pages: what stands in a model, and is embedded in them, stays text and data."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path

import numpy as np

from epicycle.runner.interface.cli import main
from tests.fuzz.surfaces.case import MODEL, Answer, Case, Surface, chosen, write

_TEXTS = (
    "</script><script>alert(7)</script>", "<img src=x onerror=alert(7)>", '" onload="alert(7)', "' onload='alert(7)",
    "<!--", "-->", "]]>", "<script>", "&lt;script&gt;", "\u2028alert(7)\u2029", "\\u003cscript>", "javascript:alert(7)",
    "</style><style>@import 'http://example.org'</style>", "{{7*7}}", "\u202egnp.exe", "</title><svg onload=alert(7)>",
    "\\", "\\'", '\\"', "\ufeff", "<a href=http://example.org>", "</textarea>", "$", "`${alert(7)}`", "&#x3c;script>",
)  # fmt: skip


class _Reader(HTMLParser):
    """Collects what a browser would run or load."""

    def __init__(self) -> None:
        super().__init__()
        self.wrong: list[str] = []
        self.scripts = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "script":
            self.scripts += 1
        for name, value in attrs:
            said = (value or "").strip().lower()
            if name.startswith("on") or "javascript:" in said:
                self.wrong.append(f"<{tag} {name}={value!r}>")
            if name in ("src", "href", "xlink:href") and not said.startswith(("data:", "#")) and tag != "a":
                self.wrong.append(f"<{tag} {name}={value!r}> is loaded")


def _read(page: Path) -> _Reader:
    reader = _Reader()
    reader.feed(page.read_text(encoding="utf-8"))
    return reader


def _prepare(home: Path) -> None:
    main(["view", str(write(home, "m.yaml", MODEL)), "-o", str(home / "page.html")])


def _make(random: np.random.Generator, home: Path, folder: Path) -> Case:
    text = "".join(str(chosen(random, _TEXTS)) for _ in range(int(random.integers(1, 4)))).replace("'", "''")
    places = (
        ("model: small", f"model: small\ndoc: '{text}'"),
        ("model: small", f"model: '{text}'"),
        ('period: "${wait}"', f"period: 1 s, values: ['{text}', 2]"),
        ("take: last}", f"take: last, label: '{text}'}}"),
        ("take: last}", f"take: last, doc: '{text}'}}"),
        ("size: 2.0", f"size: {{value: 2.0, doc: '{text}'}}"),
        ("size: 2.0", f"size: 2.0, '{text}': 1"),
        ("clock: {", f"'{text}': {{type: Clock}}\n  clock: {{"),
        ("low: always", f"'{text}': always scale.output <= 3\n  low: always"),
    )
    changed = MODEL
    for _ in range(int(random.integers(1, 3))):
        changed = changed.replace(*chosen(random, places), 1)
    page, model = folder / "page.html", write(folder, "m.yaml", changed.replace("\\x00", ""))
    scripts = _read(home / "page.html").scripts

    def judge(answer: Answer) -> str:
        if answer.code not in (0, 3) or not page.exists():
            return ""
        found = _read(page)
        return "; ".join(found.wrong) or ("" if found.scripts == scripts else f"{found.scripts} scripts")

    return Case(("view", model, "-o", page), judge)


SURFACE = Surface("pages", _prepare, _make)
