"""Composite classes that a model does not use: unfolded for trial, with parameters whose values are not known."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from .catalogue import Catalogue
from .checks import check
from .declarations import CompositeText, ModelText, PartText
from .elaborate import Elaborator, TooLargeError
from .problems import Problems
from .settings import Settings

MAX_INSTANCES = 10_000  # of one class; what is wrong shows in the first ones


def try_classes(
    composites: Mapping[str, CompositeText],
    used: Collection[str],
    problems: Problems,
    catalogue: Catalogue,
    broken: Collection[str] = (),
) -> None:
    """Check what can be checked of every class of which the model has no instance."""
    tried = set(used)
    inner = {
        part.type.text
        for composite in composites.values()
        for part in (*composite.actors.values(), *composite.aspects.values())
    }
    # Those that stand in no other come first, for the others are then tried as their parts.
    for name in sorted(composites, key=lambda name: name in inner):
        if name not in tried:
            trial = _Trial(ModelText(composites[name]), dict(composites), Settings(), problems, catalogue, broken)
            trial.unfold(composites[name])
            tried |= trial.made


class _Trial(Elaborator):
    """Unfolds one instance of a class, called as the class is, with nothing around it."""

    def unfold(self, composite: CompositeText) -> None:
        """Add what is wrong with a class, whatever its parameters are."""
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
            return
        for direction in ("input", "output"):
            for port in composite.ports(direction):
                self.graph.ports.nodes[f"{path}.{port}"]["unmade"] = True  # anything may be connected to it
        self._weave()
        check(self.graph, self.problems, whole=False)

    def _enlist(self, path: str, part: PartText) -> None:
        self._instances += 1
        if self._instances > MAX_INSTANCES:
            self.problems.muted = False
            raise TooLargeError
