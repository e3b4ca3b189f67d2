"""Verdict: whether a run has a property that a monitor asks for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ...support.shown import short
from .outcome import Outcome

_NAMED = 4  # of those that broke a monitor after the first


@dataclass(frozen=True)
class Verdict:
    """Whether a property holds, and its robustness: above 0 by how much it holds, below 0 by how much it does not.

    Both are None if that cannot be told, for the reason in ``missing``.  ``time`` (s) is when it broke first, and
    ``values`` are what its ports had sent by then, if that was kept.  ``broken_by`` are the paths that broke a monitor
    of every one of several, the earliest first.
    """

    holds: bool | None = None
    robustness: float | None = None
    time: float | None = None
    values: Mapping[str, Any] = field(default_factory=dict)
    missing: str = ""
    broken_by: tuple[str, ...] = ()

    @property
    def said(self) -> str:
        """Whether the property holds, in words."""
        if self.holds is not False:
            return "holds" if self.holds else "cannot be judged"
        return "broken" if self.time is None else f"broken at {self.time:.9g} s"

    @property
    def remark(self) -> str:
        """What people should know of it."""
        if self.holds is not False or (self.time is None and not self.broken_by):
            return ""
        by = f" by {self.broken_by[0]}" if self.broken_by else ""
        seen = ", ".join(f"{name} = {short(value)}" for name, value in self.values.items())
        when = "" if self.time is None else f" at {self.time:.9g} s"
        return f"broken{by}{when}" + (f", where {seen}" if seen else "") + self._others()

    def _others(self) -> str:
        others = list(self.broken_by[1:])
        if len(others) > _NAMED:
            others[_NAMED - 1 :] = [f"{len(others) - _NAMED + 1} others"]
        if not others:
            return ""
        return "; then by " + (" and ".join(filter(None, (", ".join(others[:-1]), others[-1]))))

    def outcome(self, whether: bool) -> Outcome:
        """The same as of a metric: whether the property holds, or by how much."""
        if self.missing:
            return Outcome(missing=self.missing)
        if whether:
            return Outcome(self.holds, note=self.remark)
        if self.robustness is not None and math.isinf(self.robustness):  # of which nobody can take a mean
            return Outcome(missing="it is infinite: no comparison of numbers decides the property")
        return Outcome(self.robustness)

    def plain(self) -> dict[str, Any]:
        """The same for programs."""
        found = {"holds": self.holds, "robustness": self.robustness, "time": self.time, "values": dict(self.values)}
        by = {"broken_by": list(self.broken_by)} if self.broken_by else {}
        return {**found, **by, **({"missing": self.missing} if self.missing else {})}
