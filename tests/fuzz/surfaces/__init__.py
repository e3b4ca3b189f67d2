"""The surfaces at which input of others comes in, each in a file of its own."""

from __future__ import annotations

from importlib import import_module

from tests.fuzz.surfaces import expressions, formulas, manifests, pages, plugins, recordings, stores, tried
from tests.fuzz.surfaces.case import Answer, Case, Surface
from tests.plugins import ABSENT

OF_PLUGINS = [] if "ptolemy" in ABSENT else [import_module("tests.ptolemy.fuzz_moml")]
SURFACES: tuple[Surface, ...] = tuple(
    each.SURFACE for each in (*OF_PLUGINS, expressions, formulas, recordings, manifests, stores, tried, plugins, pages)
)

__all__ = ["SURFACES", "Answer", "Case", "Surface"]
