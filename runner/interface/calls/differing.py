"""Two models compared, without running them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Unpack

from ...support.declare.checked import checked
from ...support.declare.parameters import argument
from .changes import Changes

if TYPE_CHECKING:
    from ...desk import Difference
    from ...model.build.model import Model


@checked
def diff(
    before: Annotated[Model | str | Path, argument("a model: a path to a YAML file, or a packaged one", "BEFORE")],
    after: Annotated[Model | str | Path, argument("the model that it is compared with", "AFTER")],
    **changes: Unpack[Changes],
) -> Difference:
    """What differs between two models: actors, ports, connections, values, aspects and their places, outputs.

    Texts do not count: comments, order of keys, or a value that is given or a default. ``set`` and the other options of
    ``load`` change both models first.

    >>> print(epicycle.diff("mm1", "mg1"))
    """
    from ...desk import difference
    from ...model.build.model import Model
    from .running import load

    one, other = (each if isinstance(each, Model) else load(each, **changes) for each in (before, after))
    return difference(one, other)
