"""What a study asks of its results: claims, and a guideline."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from epicycle.actors import did_you_mean

from ..text.problems import Position, Problems
from ..text.reading import Text
from .dimensions import Factor

LESS, GREATER, RISES, FALLS, ALWAYS = "less", "greater", "rises", "falls", "always"
FORMS = {
    LESS: ("at", "than", "where", "share"),
    GREATER: ("at", "than", "where", "share"),
    RISES: ("over", "per", "where"),
    FALLS: ("over", "per", "where"),
    ALWAYS: ("where", "share"),
}

Selection = dict[str, tuple[Factor, ...]]  # levels by factor


@dataclass(frozen=True)
class Claim:
    """One hypothesis on the results of a study; see docs/studies.md for what each form means.

    ``form`` is a key of ``FORMS``.  ``metrics`` are the names that it concerns; for ``always``, those of ``condition``.
    """

    name: str
    form: str
    metrics: tuple[Text, ...]
    position: Position
    doc: str = ""
    condition: str = ""
    at: Selection = field(default_factory=dict)
    than: Selection | None = None  # None: all other levels
    over: str = ""
    per: str = ""
    where: Selection = field(default_factory=dict)
    share: float = 1.0

    @property
    def statement(self) -> str:
        """The hypothesis in words."""
        return self.stated()

    def stated(self, words: Callable[[str], str] = str) -> str:
        """The hypothesis, with ``words`` for metrics and factors."""
        where = f", where {_shown(self.where, words)}" if self.where else ""
        share = f" in at least {self.share:.0%} of all cases" if self.share < 1 else ""
        if self.form == ALWAYS:
            often = "holds in every run" if self.share == 1 else f"holds in at least {self.share:.0%} of the runs"
            return f"{self.condition} {often}{where}"
        metrics = " and ".join(words(metric.text) for metric in self.metrics)
        if self.form in (RISES, FALLS):
            what = f"the slope of {metrics} over {words(self.per)}" if self.per else metrics
            return f"{what} {self.form} over {words(self.over)}{where}"
        than = "any other level" if self.than is None else _shown(self.than, words)
        return f"{metrics} is {self.form} at {_shown(self.at, words)} than at {than}{share}{where}"


@dataclass(frozen=True)
class Guideline:
    """Which level of ``choose`` makes ``metric`` least (or ``greatest``), at every combination of the other factors.

    A level is sufficient if it is not significantly worse than the best, or its mean is within ``tolerance`` of the
    best.
    """

    choose: str
    metric: Text
    greatest: bool = False
    tolerance: float = 0.0


@dataclass(frozen=True)
class Questions:
    """Everything that a study asks; the claims are judged separately at each level of the factors in ``apart``."""

    claims: tuple[Claim, ...] = ()
    guideline: Guideline | None = None
    apart: tuple[str, ...] = ()
    lender: tuple[str, str] | None = None  # file and text of the study whose claims these are

    def check(self, metrics: Iterable[str], problems: Problems) -> None:
        """Report metrics that the study does not have."""
        known = list(metrics)
        asked = [(f"claim {claim.name}", metric) for claim in self.claims for metric in claim.metrics]
        if self.guideline is not None:
            asked.append(("guideline", self.guideline.metric))
        for who, metric in asked:
            if metric.text not in known:
                message = f"{who}: the study has no metric {metric.text!r}{did_you_mean(metric.text, known)}"
                problems.add(message, metric.position, f"its metrics: {', '.join(known) or 'none'}")


def shown_level(value: Factor) -> str:
    """A level as messages and reports show it."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _shown(selection: Selection, words: Callable[[str], str]) -> str:
    parts = []
    for factor, levels in selection.items():
        shown = [shown_level(each) for each in levels]
        listed = shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} or {shown[-1]}"
        parts.append(f"{words(factor)}={listed}")
    return " and ".join(parts)
