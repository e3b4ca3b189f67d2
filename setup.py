"""Builds the compiled core, if there is a compiler; everything else about the package is in pyproject.toml.

Its modules are the Python sources themselves, with types for C in a ``.pxd`` beside them, or have a twin in Cython
(``.pyx``).  They are compiled from a copy under ``build``, where folders have the names under which they are imported,
and linked into a few libraries.  A manifest records their sources: they do not replace other ones
(``actors/compiled.py``).
"""

from __future__ import annotations

import ast
import json
import os
import re
import runpy
import shutil
import sys
from pathlib import Path
from typing import Any

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).parent
TREE = ROOT / "build" / "core"
core = runpy.run_path(str(ROOT / "actors" / "compiled.py"), run_name="setup")
OF_TYPES = "classmethod(__import__('types').GenericAlias)"  # what makes InputPort[float] a name of a type
CHOICES = {"none": (), "core": core["CORE_LIBRARIES"], "all": tuple(core["LIBRARIES"])}
if (choice := os.environ.get("EPICYCLE_BUILD") or "none") not in CHOICES:
    sys.exit(f"EPICYCLE_BUILD={choice} is unknown; choose {', '.join(CHOICES)}")
WANTED = CHOICES[choice]
# The same bits everywhere: no fused multiplication and addition, no reordering.
FLAGS = ["-DNPY_NO_DEPRECATED_API=NPY_1_7_API_VERSION"]
OPTIMISED: dict[str, list[str]] = {name: [] for name in core["LIBRARIES"]}
if sys.platform != "win32":
    FLAGS += ["-g0", "-ffp-contract=off", "-fno-fast-math", "-Wno-unused-function"]
    OPTIMISED = {name: ["-O2" if name == "kernel" else "-O1"] for name in OPTIMISED}  # -O2 takes twice the time


def _signature(name: str, initializer: Any) -> str:
    """What shows a class in C with the parameters of its initializer, as in ``help``."""
    arguments = initializer.args
    plain = ast.arguments(
        *([ast.arg(each.arg) for each in part] for part in (arguments.posonlyargs, arguments.args[1:])),
        vararg=arguments.vararg and ast.arg(arguments.vararg.arg),
        kwonlyargs=[ast.arg(each.arg) for each in arguments.kwonlyargs],
        kw_defaults=arguments.kw_defaults,
        kwarg=arguments.kwarg and ast.arg(arguments.kwarg.arg),
        defaults=arguments.defaults,
    )
    owner = "__import__('epicycle.actors.compiled', fromlist=['_']).OwnSignature"
    return f"__signature__ = {owner}(__name__, {name!r}, {f'lambda {ast.unparse(plain)}: None'!r})"


def for_cython(source: Path) -> str:
    """A source in the form that classes in C accept.

    It lacks the imports that the types for C replace (those for type checkers, those of the .pxd), overloads, and the
    parameters of generic classes.
    """
    text = source.read_text(encoding="utf-8")
    types = source.with_suffix(".pxd")
    told = types.read_text(encoding="utf-8") if types.exists() else ""
    names = {name.strip() for line in re.findall(r"cimport (.*)", told) for name in line.split(",")}
    in_c = set(re.findall(r"cdef class (\w+)", told))
    lines = text.splitlines()

    def put(first: int, last: int, left: str) -> None:
        lines[first - 1 : last] = [left] + [""] * (last - first)  # keeps the lines of errors

    for node in ast.walk(ast.parse(text)):
        last = getattr(node, "end_lineno", 0)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            put(node.lineno, node.body[-1].end_lineno, " " * node.col_offset + "if False: pass")
        elif isinstance(node, ast.ImportFrom) and names & {each.name for each in node.names}:
            node.names = [each for each in node.names if each.name not in names]
            put(node.lineno, last, ast.unparse(node) if node.names else "")
        elif isinstance(node, ast.FunctionDef) and [ast.unparse(each) for each in node.decorator_list] == ["overload"]:
            put(node.lineno - 1, last, "")
        elif isinstance(node, ast.ClassDef) and node.name in in_c:
            bases = [ast.unparse(each).partition("[")[0] for each in node.bases]
            generic = "Generic" in bases
            bases = [each for each in bases if each != "Generic"]
            head = f"class {node.name}({', '.join(bases)}):" if bases else f"class {node.name}:"
            put(node.lineno, node.lineno, head)
            added = [f"__class_getitem__ = {OF_TYPES}"] if generic else []
            added += [_signature(node.name, each) for each in node.body if getattr(each, "name", "") == "__init__"]
            if added and ast.get_docstring(node) is not None and node.body[0].end_lineno is not None:
                # In the blank line after the docstring, which would be lost with anything behind it.
                lines[node.body[0].end_lineno] = " " * node.body[0].col_offset + "; ".join(added)
    return "\n".join(lines) + "\n"


def copied(modules: list[str]) -> list[Path]:
    """Copy the sources to the places that their module names require; returns those to compile."""
    found = []
    for face in ROOT.glob("*/**/__init__.pxd"):
        if face.is_relative_to(ROOT / "build"):
            continue
        target = TREE / "epicycle" / face.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(face, target)
    for name in modules:
        source = ROOT / Path(*name.split(".")[1:])
        target = TREE / Path(*name.split("."))
        target.parent.mkdir(parents=True, exist_ok=True)
        for ending in (".pxd", ".pyx", ".py"):
            if source.with_suffix(ending).exists():
                shutil.copy2(source.with_suffix(ending), target.with_suffix(ending))
            else:
                target.with_suffix(ending).unlink(missing_ok=True)  # from an earlier build
        found.append(target.with_suffix(".pyx" if target.with_suffix(".pyx").exists() else ".py"))
        if found[-1].suffix == ".pyx":  # its twin is the Python source
            target.with_suffix(".py").unlink(missing_ok=True)
        else:
            found[-1].write_text(for_cython(found[-1]), encoding="utf-8")
            shutil.copystat(source.with_suffix(".py"), found[-1])  # unchanged files are not compiled again
    return found


class BuildCore(build_ext):
    """Builds the libraries of the core or, if one cannot be built, leaves no manifest: then the Python core is used.

    EPICYCLE_BUILD chooses: ``none`` (the default), ``core``, or ``all`` (the modules of robots, too).
    """

    def run(self) -> None:
        """Build what has changed."""
        if not WANTED:
            return
        self.parallel = self.parallel or os.cpu_count()
        try:
            from Cython import __version__ as cython
            from Cython.Build import cythonize
            from numpy import get_include

            if [int(each) for each in cython.split(".")[:2]] >= [3, 3]:
                raise RuntimeError(f"Cython {cython} adds 0 and -0.0 wrongly: install a version below 3.3")
            options = {
                "language_level": 3,
                "annotation_typing": False,
                "auto_pickle": False,
                "binding": False,
                "embedsignature": True,
                "embedsignature.format": "clinic",
            }
            modules = [module for library in WANTED for module in core["LIBRARIES"][library]]
            pairs = zip(modules, copied(modules), strict=True)
            made = [Extension(name, [str(path)]) for name, path in pairs]
            made = cythonize(made, include_path=[str(TREE)], compiler_directives=options, quiet=True)
        except Exception as error:  # no Cython or NumPy, or an unsuitable one
            print(f"the core is not compiled, so the Python core is used: {error}", file=sys.stderr)
            return
        written = {each.name: each for each in made}
        # setuptools has filled in what it needs to know about the libraries.
        for extension in self.extensions:
            parts = [written[module] for module in core["LIBRARIES"][extension.name.rpartition(".")[2]]]
            extension.sources = [source for part in parts for source in part.sources]
            extension.depends = [file for part in parts for file in part.depends]
            extension.include_dirs = [*extension.include_dirs, get_include()]
        (ROOT / core["FOLDER"]).mkdir(exist_ok=True)  # where setuptools copies what is built in place
        super().run()
        self._say()

    def get_export_symbols(self, ext: Extension) -> list[str]:
        """The modules in a library."""
        return [f"PyInit_{Path(source).stem}" for source in ext.sources]

    def _say(self) -> None:
        files = [Path(self.get_ext_fullpath(each.name)) for each in self.extensions]
        sources = [max(Path(source).stat().st_mtime for source in each.sources) for each in self.extensions]
        # A library that could not be compiled may have left an older file in its place.
        if all(file.exists() and file.stat().st_mtime >= time for file, time in zip(files, sources, strict=True)):
            current = core["digests"](ROOT)
            names = [each.name.rpartition(".")[2] for each in self.extensions]
            built = {"python": sys.implementation.cache_tag, "libraries": {name: current[name] for name in names}}
            place = files[0].with_name(Path(core["MANIFEST"]).name)
            place.write_text(json.dumps(built, indent=1), encoding="utf-8")


PACKAGE = "epicycle." + core["FOLDER"].replace("/", ".")
setup(
    ext_modules=[
        Extension(f"{PACKAGE}.{name}", [], optional=True, extra_compile_args=[*FLAGS, *OPTIMISED[name]])
        for name in WANTED
    ],
    setup_requires=["Cython>=3.1,<3.3", "numpy>=2"] if WANTED else [],
    cmdclass={"build_ext": BuildCore},
)
