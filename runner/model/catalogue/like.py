"""The dialects that ``like:`` of a director may name: Epicycle's own, and those of installed packages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from epicycle.actors import Parameter, ParameterError, did_you_mean

from .dialect import Dialect
from .types import CatalogueError, with_offered

GROUP = "epicycle.dialects"


def dialects() -> Mapping[str, type[Dialect]]:
    """All dialects by name; looking one up may import it, and raises ``CatalogueError`` if that fails."""
    known: Any = with_offered(Dialect, GROUP, {Dialect.name: Dialect})
    return known  # type: ignore[no-any-return]


class DialectParameter(Parameter[Any]):
    """The name of a dialect, which becomes its class."""

    def __init__(self, *, doc: str) -> None:
        super().__init__(str, None, doc=doc)

    def convert(self, value: object) -> type[Dialect] | None:
        if value is None or (isinstance(value, type) and issubclass(value, Dialect)):
            return value
        known = dialects()
        if not isinstance(value, str) or value not in known:
            raise ParameterError(f"{value!r} is not one of {', '.join(sorted(known))}{did_you_mean(str(value), known)}")
        try:
            return known[value]
        except CatalogueError as error:
            raise ParameterError("; ".join((error.message, *error.help))) from None


LIKE = DialectParameter(
    doc="whose rules and types apply inside: epicycle, or the name of a dialect that an installed package offers"
)
