"""The keys of claims and of a guideline; how they are read and checked against the study."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from math import prod
from pathlib import Path

from epicycle.actors import did_you_mean
from epicycle.actors.expression import ExpressionError, Formula

from ..text.document import Entry, Node, Scalar, Sequence, parse
from ..text.document import Mapping as MappingNode
from ..text.faults import blame
from ..text.kinds import OF_STUDY
from ..text.problems import POISON, Poison, Position, Problems
from ..text.reading import NodeReader, Text, inside
from .claims import (
    ALWAYS,
    FALLS,
    FORMS,
    GREATER,
    LESS,
    MAX_NUMBER,
    RISES,
    Claim,
    Guideline,
    Questions,
    Selection,
    shown_level,
)
from .dimensions import Dimension, Factor, as_factor
from .fields import TEXTS, Field, Reader, Record, Schema, names_of, node_as, ref
from .files import named_file

MAX_CONDITIONS = 10_000  # of a study with claims or a guideline, which evaluate all of them


def without(node: Node, *keys: str) -> Node:
    """A mapping without some of its entries."""
    if not isinstance(node, MappingNode):
        return node
    return replace(node, entries={key: entry for key, entry in node.entries.items() if key not in keys})


def levels_of(dimensions: Iterable[Dimension], factor: str) -> list[Factor]:
    """The values that a factor takes, each once, in the order of the study."""
    for dimension in dimensions:
        if factor in dimension.columns:
            values = (dimension.level(index).values[factor] for index in range(dimension.size))
            return list(dict.fromkeys(values))
    raise KeyError(factor)


class QuestionReader(NodeReader):
    """Reads ``claims`` and ``guideline`` of a study; anything malformed or not in the study is reported and left out.

    ``kinds`` are the factors and what they hold, ``folder`` that of the study's file; ``factors_of`` returns what
    another study varies, given the node of its text and its file.
    """

    def __init__(
        self,
        problems: Problems,
        dimensions: tuple[Dimension, ...],
        kinds: Mapping[str, str],
        folder: Path,
        factors_of: Callable[[Node, Path, Problems], Mapping[str, str]],
    ) -> None:
        super().__init__(problems)
        self.dimensions = dimensions
        self.kinds = kinds
        self.folder = folder
        self.factors_of = factors_of

    def questions(self, entries: Mapping[str, Entry], lender: tuple[str, str] | None = None) -> Questions:
        """Everything that is asked; ``lender``: file and text of the study that owns the claims, if they are known."""
        asked = [entries[key] for key in ("claims", "guideline") if key in entries]
        if asked and prod(dimension.size for dimension in self.dimensions) > MAX_CONDITIONS:
            self.problems.add(
                f"a study of more than {MAX_CONDITIONS:,} conditions cannot have claims or a guideline",
                asked[0].key.position,
            )
            return Questions()
        guideline = (self.guideline(entries["guideline"]) or None) if "guideline" in entries else None
        node = entries["claims"].value if "claims" in entries else None
        if node is None:
            return Questions(guideline=guideline)
        if not isinstance(node, Scalar) or node.value is None:
            return Questions(self.claims(node), guideline)
        lender = lender or self.lender(node)
        borrowed = None if lender is None else self.borrowed(node, *lender)
        if borrowed is None:
            return Questions(guideline=guideline)
        tree, factors = borrowed
        misfits = Problems()
        claims = QuestionReader(misfits, self.dimensions, self.kinds, self.folder, self.factors_of).claims(tree)
        if first := next(iter(misfits.found), None):
            more = f", and {len(misfits) - 1} more" if len(misfits) > 1 else ""
            message = f"claims: the claims of {node.text!r} do not fit this study: {first.message}{more}"
            self.problems.add(message, node.position, *first.help)
        apart = tuple(name for name in self.kinds if name not in factors)
        return Questions(claims, guideline, apart, lender)

    def lender(self, node: Scalar) -> tuple[str, str] | None:
        """File and text of the study that is named instead of claims."""
        said = Text(node.text, node.position)
        path = named_file(said, self.folder, "study", self.problems, "claims: ")
        return None if path is None else (str(path), path.read_text(encoding="utf-8", errors="replace"))

    def borrowed(self, node: Scalar, file: str, text: str) -> tuple[Node, Mapping[str, str]] | None:
        """The claims of another study, and what it varies."""
        problems = Problems(OF_STUDY)
        tree = parse(text, file, problems)
        factors = {} if tree is None else self.factors_of(tree, Path(file), problems)
        claims = tree.entries.get("claims") if isinstance(tree, MappingNode) else None
        if len(problems):
            self.problems.add(
                f"claims: the study {node.text!r} is not valid", node.position, f"see 'epicycle validate {file}'"
            )
        elif claims is None or not isinstance(claims.value, MappingNode):
            self.problems.add(f"claims: the study {node.text!r} has no claims of its own", node.position)
        else:
            return claims.value, factors
        return None

    # -- claims ---------------------------------------------------------------------------------------------------

    def claims(self, node: Node) -> tuple[Claim, ...]:
        """A mapping from names to claims."""
        found = (self.claim(name, entry) for name, entry in self.named(node, "claims") or ())
        return tuple(claim for claim in found if claim)

    def claim(self, name: str, entry: Entry) -> Claim | Poison:
        """One claim: one of the forms, and what belongs to it."""
        what, position = f"claim {name}", entry.key.position
        entries = CLAIM.entries(self, entry.value, what)
        if entries is POISON:
            return POISON
        forms = [form for form in FORMS if form in entries]
        if len(forms) != 1:
            reason = f"has more than one form: {', '.join(forms)}" if forms else "claims nothing"
            return self.problems.add(f"{what} {reason}", position, f"give one of {', '.join(FORMS)}")
        form, wrong = forms[0], list[Poison]()
        for key in entries.keys() - {"doc", form, *FORMS[form]}:
            message, takes = f"{what}: {key!r} cannot be used with {form!r}", ", ".join(FORMS[form])
            wrong.append(self.problems.add(message, entries[key].key.position, f"{form!r} takes: {takes}"))
        is_apart = "than" in entries and isinstance(entries["than"].value, Scalar)  # compared with no level
        for key in {"at", "over"} & set(FORMS[form]) - entries.keys() - ({"at"} if is_apart else set()):
            example = "'at: {load: 0.5}', or a number: 'than: 0.9'" if key == "at" else "'over: load'"
            wrong.append(self.problems.add(f"{what} has no {key!r}", position, f"for example, add {example}"))
        if wrong:
            return POISON
        said = CLAIM.values(self, entries, what, position)
        if said[form] in ((), ("", ())):
            said[form] = self.problems.add(f"{what} names no metric", entries[form].value.position)
        if POISON in said.values():
            return POISON
        condition, metrics = said.pop(form) if form == ALWAYS else ("", said.pop(form))
        at, than = said.get("at", {}), said.get("than")
        if isinstance(than, dict) and than.keys() != at.keys():
            message = f"{what}: 'at' and 'than' name different factors"
            hint = f"at: {', '.join(at)}; than: {', '.join(than) or 'none'}"
            return self.problems.add(message, entries["than"].key.position, hint)
        claim = Claim(name, form, metrics, position, condition=condition, **said)
        self.compares(claim)
        return claim

    def condition(self, node: Node, what: str) -> tuple[str, tuple[Text, ...]] | Poison:
        """An expression over metrics that is true or false."""
        text = self.text(node, what)
        if text is POISON or not isinstance(node, Scalar):
            return POISON
        try:
            formula = Formula(text)
        except ExpressionError as error:
            return blame(self.problems, what, error, node)
        if not formula.is_condition or not formula.names:
            advice = "write a comparison such as 'longest_wait < 30'"
            return self.problems.add(f"{what}: {text!r} is not a condition on metrics", node.position, advice)
        return text, tuple(Text(name, inside(node, text, max(text.find(name), 0), name)) for name in formula.names)

    def selection(self, node: Node, what: str, key: str) -> Selection | Poison:
        """``{factor: level}`` or ``{factor: [level, ...]}``, with levels of the study."""
        if not isinstance(node, MappingNode) or not node.entries:
            hint = "write {load: 0.5} or {load: [0.5, 0.7]}"
            return self.problems.add(f"{what}: {key!r} is not a mapping from factors to levels", node.position, hint)
        found: dict[str, list[tuple[Factor] | Poison]] = {}
        for factor, entry in node.entries.items():
            items = entry.value.items if isinstance(entry.value, Sequence) else (entry.value,)
            if not self.is_factor(factor, entry.key.position, what):
                found[factor] = [POISON]
            elif items:
                known = levels_of(self.dimensions, factor)
                found[factor] = [self.level(factor, known, item, what) for item in items]
            else:
                found[factor] = [self.problems.add(f"{what}: {key!r} lists no level of {factor}", entry.value.position)]
        if any(POISON in levels for levels in found.values()):
            return POISON
        return {factor: tuple(dict.fromkeys(level[0] for level in levels if level)) for factor, levels in found.items()}

    def than(self, node: Node, what: str) -> Selection | float | Poison:
        """Levels, or a number, which has the unit of the metric."""
        if not isinstance(node, Scalar):
            return self.selection(node, what, "than")
        value = node.value
        if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < MAX_NUMBER:
            return float(value)
        message = f"{what}: 'than' is neither a number below 1e305 nor a mapping from factors to levels"
        hint = "write a number without a unit, which is that of the metric, or levels such as {load: [0.5, 0.7]}"
        return self.problems.add(message, node.position, hint)

    def level(self, factor: str, known: list[Factor], node: Node, what: str) -> tuple[Factor] | Poison:
        """The level that a node names, of those that a factor takes, as the table holds it."""
        value = as_factor(node, self.kinds[factor]) if isinstance(node, (Scalar, Sequence)) else ""
        is_number = self.kinds[factor] == "float" and isinstance(value, (int, float)) and not isinstance(value, bool)
        for each in known:
            if each == value and isinstance(each, bool) == isinstance(value, bool):
                return (each,)
        for each in known:  # 70 % need not be 0.7 in the last digit
            if is_number and math.isclose(float(each or 0), float(value or 0), rel_tol=1e-9):
                return (each,)
        shown = node.text if isinstance(node, Scalar) else "[...]" if isinstance(node, Sequence) else "{...}"
        texts = [shown_level(each) for each in known]
        guess = did_you_mean(shown, texts) if self.kinds[factor] == "text" else ""
        hint = f"its levels: {', '.join(texts[:20])}{', ...' if len(texts) > 20 else ''}"
        message = f"{what}: the study has no level {shown} of {factor}{guess}"
        return self.problems.add(message, node.position, hint)

    def is_factor(self, name: str, position: Position, what: str) -> bool:
        """Whether the study varies it; a problem otherwise."""
        if name in self.kinds:
            return True
        message = f"{what}: the study does not vary {name!r}{did_you_mean(name, self.kinds)}"
        self.problems.add(message, position, f"it varies: {', '.join(self.kinds) or 'nothing'}")
        return False

    def trend(self, node: Node, what: str, key: str) -> str | Poison:
        """A factor whose levels have an order; for ``per`` they must be numbers."""
        name = self.text(node, what)
        if name is POISON or not self.is_factor(name, node.position, what):
            return POISON
        wrong = []
        if key == "per" and self.kinds[name] not in ("int", "float"):
            wrong.append(f"the levels of {name} are not numbers, so there is no slope over it")
        size = next(dimension.size for dimension in self.dimensions if name in dimension.columns)
        if len(levels_of(self.dimensions, name)) < size:
            wrong.append(f"{name} takes a value more than once, so it has no order")
        for message in wrong:
            self.problems.add(f"{what}: {message}", node.position)
        return POISON if wrong else name

    def compares(self, claim: Claim) -> None:
        """Check that a claim has more than one level to compare."""
        what, position = f"claim {claim.name}", claim.position
        if claim.form in (RISES, FALLS):
            homes = [
                next(each for each in self.dimensions if name in each.columns)
                for name in (claim.over, claim.per)
                if name
            ]
            if len(homes) == 2 and homes[0] is homes[1]:
                self.problems.add(f"{what}: {claim.over} and {claim.per} always vary together", position)
            names = (claim.over, claim.per) if claim.per else (claim.over,)
            for name in names:
                if len(set(claim.where.get(name, levels_of(self.dimensions, name)))) < 2:
                    self.problems.add(f"{what}: {name} has only one level, so there is nothing to compare", position)
        elif claim.form in (LESS, GREATER):
            than = claim.than if isinstance(claim.than, dict) else {}
            for key, selection in (("at", claim.at), ("than", than)):
                for name, levels in selection.items():
                    if not set(levels) <= set(claim.where.get(name, levels)):
                        self.problems.add(f"{what}: 'where' excludes a level of {name} that {key!r} names", position)
            if claim.than is None and all(
                set(levels) >= set(claim.where.get(name, levels_of(self.dimensions, name)))
                for name, levels in claim.at.items()
            ):
                self.problems.add(f"{what}: there are no other levels to compare with", position)
            if than and all(set(claim.at[name]) & set(than[name]) for name in claim.at):
                self.problems.add(f"{what}: compares a level with itself", position)

    # -- the guideline --------------------------------------------------------------------------------------------

    def guideline(self, entry: Entry) -> Guideline | Poison:
        """``{choose: servers, least: mean_wait, tolerance: 0.5}``."""
        entries = GUIDELINE.entries(self, entry.value, "guideline")
        if entries is POISON:
            return POISON
        aims = [key for key in ("least", "greatest") if key in entries]
        if "choose" not in entries or len(aims) != 1:
            message = "guideline needs 'choose' and either 'least' or 'greatest'"
            return self.problems.add(message, entry.key.position, "write {choose: servers, least: mean_wait}")
        said = GUIDELINE.values(self, entries, "guideline", entry.key.position)
        name, at = said["choose"], entries["choose"].value.position
        if name is not POISON and not self.is_factor(name, at, "guideline"):
            return POISON
        if name is not POISON and len(levels_of(self.dimensions, name)) < 2:
            return self.problems.add(f"guideline: {name} has only one level, so there is nothing to choose", at)
        if POISON in said.values():
            return POISON
        return Guideline(**said)


_METRICS = TEXTS.described({"anyOf": [ref("name"), {"type": "array", "items": ref("name"), "minItems": 1}]})
_MEAN = "Metrics whose mean is {} at some levels than at others, or than a number."
_TREND = "Metrics whose mean, or slope per unit of another factor, {} over the levels of a factor."
_APART: Schema = {"anyOf": [{"required": ["at"]}, {"required": ["than"], "properties": {"than": {"type": "number"}}}]}
_OF_CLAIM = Record.of(Claim, called="{what}").keys
CLAIM = Record(
    "A hypothesis on the results.",
    {
        "doc": _OF_CLAIM["doc"],
        LESS: Field(_METRICS, _MEAN.format(LESS), "{what}"),
        GREATER: Field(_METRICS, _MEAN.format(GREATER), "{what}"),
        RISES: Field(_METRICS, _TREND.format(RISES), "{what}"),
        FALLS: Field(_METRICS, _TREND.format(FALLS), "{what}"),
        ALWAYS: Field(
            Reader({"type": "string"}, QuestionReader.condition),
            "A condition on the metrics that holds in every run.",
            "{what}",
        ),
        **_OF_CLAIM,
    },
    type="object",
    oneOf=[
        {"required": [LESS], **_APART},
        {"required": [GREATER], **_APART},
        {"required": [RISES, "over"]},
        {"required": [FALLS, "over"]},
        {"required": [ALWAYS]},
    ],
)
GUIDELINE = Record.of(
    Guideline, type="object", required=["choose"], oneOf=[{"required": ["least"]}, {"required": ["greatest"]}]
)
CLAIMS = node_as({"anyOf": [names_of(ref("claim")), {"type": "string"}]})
