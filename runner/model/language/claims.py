"""What a study asks of its results: claims, and a guideline."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from epicycle.actors import did_you_mean

from ...support.shown import listed
from ..text.problems import Position, Problems
from ..text.reading import Text
from .dimensions import Factor
from .fields import AT, LABEL, TEXT, Reader, Schema, keyed, number, ref

MAX_NUMBER = 1e305  # below which statistics are made of numbers
LESS, GREATER, RISES, FALLS, ALWAYS = "less", "greater", "rises", "falls", "always"
FORMS = {
    LESS: ("at", "than", "where", "share"),
    GREATER: ("at", "than", "where", "share"),
    RISES: ("over", "per", "where"),
    FALLS: ("over", "per", "where"),
    ALWAYS: ("where", "share"),
}

Selection = dict[str, tuple[Factor, ...]]  # levels by factor


_LEVELS: Schema = {
    "type": "object",
    "minProperties": 1,
    "additionalProperties": {"anyOf": [LABEL, {"type": "array", "minItems": 1}]},
}


def _levels(key: str) -> Reader:
    return Reader(_LEVELS, lambda reader, node, what: reader.selection(node, what, key))


def _trend(key: str) -> Reader:
    return Reader({"type": "string"}, lambda reader, node, what: reader.trend(node, what, key))


@dataclass(frozen=True)
class Claim:
    """One hypothesis on the results of a study; see docs/studies.md for what each form means.

    ``form`` is a key of ``FORMS``.  ``metrics`` are the names that it concerns; for ``always``, those of ``condition``.
    """

    name: str
    form: str
    metrics: tuple[Text, ...]
    position: Position
    doc: str = keyed(TEXT, "The claim in words.", called="doc", default="")
    condition: str = ""
    at: Selection = keyed(
        _levels("at"),
        "Where they are less, or greater: 'factor: level' or 'factor: [level, ...]' (default, with a number: all).",
        default_factory=dict,
    )
    than: Selection | float | None = keyed(
        Reader({"anyOf": [{"type": "number"}, _LEVELS]}, lambda reader, node, what: reader.than(node, what)),
        "What they are compared with: levels, or a number (default: all other levels, so that these are the best).",
        default=None,
    )
    over: str = keyed(_trend("over"), "The factor over which something rises or falls.", default="")
    per: str = keyed(_trend("per"), "What rises or falls is the slope over this factor.", default="")
    where: Selection = keyed(
        _levels("where"), "The levels to which the claim is restricted (default: all).", default_factory=dict
    )
    share: float = keyed(
        number(float, 0.5, 1.0),
        "The share of the comparisons, or runs, in which it must hold (default: 1, all).",
        called="{what}: share",
        default=1.0,
    )

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
        at = f" at {_shown(self.at, words)}" if self.at else ""
        if isinstance(self.than, float):
            return f"{metrics} is {self.form} than {self.than:g}{at}{share}{where}"
        than = "any other level" if self.than is None else _shown(self.than, words)
        return f"{metrics} is {self.form}{at} than at {than}{share}{where}"


@dataclass(frozen=True)
class Guideline:
    """Which level of ``choose`` makes ``metric`` least (or ``greatest``), at every combination of the other factors.

    A level is sufficient if it is not significantly worse than the best, or its mean is within ``tolerance`` of the
    best.
    """

    choose: str = keyed(
        TEXT.described({"type": "string"}),
        "The factor whose best level is to be found, for every combination of the others.",
    )
    least: Text | None = keyed(AT.described(ref("name")), "The metric to minimise.", default=None)
    greatest: Text | None = keyed(AT.described(ref("name")), "The metric to maximise.", default=None)
    tolerance: float = keyed(
        number(float, 0.0),
        "How much worse than the best is still good enough (default: 0).",
        called="guideline: tolerance",
        default=0.0,
    )

    @property
    def metric(self) -> Text:
        """What is to be minimised or maximised."""
        found = self.least or self.greatest
        assert found is not None
        return found


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
    parts = (f"{words(name)}={listed([*map(shown_level, levels)], 'or')}" for name, levels in selection.items())
    return " and ".join(parts)
