"""What is shipped: its folders, its files, and the names of these."""

from pathlib import Path

from tests.plugins import ABSENT, PLUGINS

ROOT = Path(__file__).parents[1]
THERE = tuple(name for name in PLUGINS if name not in ABSENT)
FOLDERS = ("actors", "aspects", "models", "runner", "bridges", *THERE, "api")  # the last is `epicycle` itself
CODE_FOLDERS = ("actors", "aspects", "runner", "api", "bridges", *PLUGINS)


def shipped_files() -> list[Path]:
    """Return every file that belongs in the wheel, relative to the root."""
    return sorted(
        path.relative_to(ROOT)
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*")
        if (
            path.suffix in {".py", ".pyi", ".yaml", ".css", ".js", ".mplstyle", ".pxd", ".pyx", ".template", ".LICENSE"}
            or path.name in {"py.typed", "schema.json"}
        )
        and "__pycache__" not in path.parts
    )


def place_of(file: Path) -> Path:
    """Return where in the package epicycle a file of ours is."""
    return file.relative_to("api") if file.parts[0] == "api" else file


def module_name(file: Path) -> str:
    """Return the dotted name under which a file of ours is imported."""
    parts = place_of(file).with_suffix("").parts
    return ".".join(("epicycle", *(parts[:-1] if file.name == "__init__.py" else parts)))
