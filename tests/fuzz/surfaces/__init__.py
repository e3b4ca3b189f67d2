"""The surfaces at which input of others comes in, each in a file of its own."""

from __future__ import annotations

from tests.fuzz.surfaces import expressions, formulas, manifests, moml, pages, plugins, recordings, stores, tried
from tests.fuzz.surfaces.case import Answer, Case, Surface

SURFACES: tuple[Surface, ...] = tuple(
    each.SURFACE for each in (moml, expressions, formulas, recordings, manifests, stores, tried, plugins, pages)
)

__all__ = ["SURFACES", "Answer", "Case", "Surface"]
