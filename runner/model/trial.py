"""Composite classes that a model does not use: unfolded for trial, with parameters whose values are not known."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from epicycle.actors import counted

from ..language import CompositeText, ModelText, PartText, Settings, Values
from ..text import RAISE_IT
from .checks import check
from .elaborate import Elaborator, TooLargeError

_OVERHEAD = 3  # what a class takes beside what is in it, as many actors


def try_classes(composites: Mapping[str, CompositeText], model: Elaborator, broken: Collection[str] = ()) -> None:
    """Check what can be checked of every class of which the model has no instance.

    All trials together may cost as much as a model of half the largest size; a warning tells what is left over.
    """
    problems, limits = model.problems, model.graph.limits
    tried = set(model.made)
    inner = {
        part.type.text
        for composite in composites.values()
        for part in (*composite.actors.values(), *composite.aspects.values())
    }
    most = left = limits.actors // 2
    untried: list[str] = []
    # Those that stand in no other come first, for the others are then tried as their parts.
    for name in sorted(composites, key=lambda name: name in inner):
        if name in tried:
            continue
        is_whole = False
        if left > 0:
            trial = _Trial(ModelText(composites[name]), dict(composites), Settings(), problems, model.catalogue, broken)
            trial.values = Values(problems, model.values.budget)
            trial.most = left
            is_whole = trial.unfold(composites[name])
            left -= trial.cost
            tried |= trial.made
        if not is_whole:
            untried.append(name)
    if untried:
        names = (
            f"{untried[0]} is" if len(untried) == 1 else f"{untried[0]} and {counted(len(untried) - 1, 'other')} are"
        )
        problems.warn(
            f"{names} not checked in full: the model has no instance of such a class, and to try all that it has none "
            f"of takes more than {most:,} actors and composites",
            composites[untried[0]].position,
            RAISE_IT,
        )


class _Trial(Elaborator):
    """Unfolds one instance of a class, called as the class is, with nothing around it."""

    most = 0

    @property
    def cost(self) -> int:
        """What it has taken, counted in actors."""
        return _OVERHEAD + self._instances + (len(self.graph.ports.edges) + self._places) // 5

    def unfold(self, composite: CompositeText) -> bool:
        """Add what is wrong with a class, whatever its parameters are; whether all of it was looked at."""
        path = composite.name
        names: dict[str, object] = {}
        for name, declared in composite.parameters.items():
            if declared.value is not None:
                known = {**names, "index": self.values.missing}
                value = self.values.of(declared.value, known, f"{path}.{name}", path, list(composite.parameters))
                self.values.declared(f"{path}.{name}", declared, value, declared.value.position, path)
            # The default is one value of many: what is computed from it is not judged.
            names[name] = self.values.missing
        names.setdefault("index", self.values.missing)
        try:
            self._unfold(path, composite, names, None, ())
        except TooLargeError:
            return False
        for direction in ("input", "output"):
            for port in composite.ports(direction):
                self.graph.ports.nodes[f"{path}.{port}"]["unmade"] = True  # anything may be connected to it
        self._weave()
        check(self.graph, self.problems, whole=False)
        return True

    def _enlist(self, path: str, part: PartText) -> None:
        self._instances += 1
        if self._instances > self.most:
            self.problems.muted = False
            raise TooLargeError
