"""What if: a run that takes another course from a tag on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Unpack

from ...support.declare.checked import checked
from ...support.declare.parameters import argument, option, repeated
from .changes import SEED, UNTIL, Changes
from .running import REFERENCE, opened

if TYPE_CHECKING:
    from epicycle.actors import Tag

    from ...model.build.model import Model
    from ...search.what_if import WhatIf


@checked
def what_if(
    model: Annotated[Model | str | Path, argument(REFERENCE, "MODEL or RESULTS")],
    at: Annotated[
        float | str | Tag,
        option("the time or tag from which on something changes, such as '3.2 s' or '(3.2 s, 1)'", "TAG"),
    ],
    *,
    change: Annotated[
        Iterable[str] | Mapping[str, object],
        repeated(
            "give a parameter another value from then on, such as load=0.9 or 'robot[0].speed=1 m/s'", "PATH=VALUE"
        ),
    ] = (),
    remove: Annotated[str | Iterable[str], repeated("remove an aspect from then on", "ASPECT")] = (),
    let_through: Annotated[
        str | Iterable[str],
        repeated(
            "let through what an aspect, anywhere or at one of its places, would next lose, delay or alter; #N is the "
            "N-th from then on",
            "ASPECT[@PLACE][#N]",
        ),
    ] = (),
    lose: Annotated[str | Iterable[str], repeated("lose the next token at a port", "PORT")] = (),
    seed: Annotated[int | None, SEED] = None,
    until: Annotated[float | str | None, UNTIL] = None,
    out: Annotated[
        str | Path | None, option("folder for what is found (default: results/MODEL/what_if)", "DIR", Path)
    ] = None,
    progress: bool = True,
    **changes: Unpack[Changes],
) -> WhatIf:
    """Change something from a tag of a run on, and show both futures: where they part, and what follows.

    Before the tag, both are the same run, bit for bit.  ``set``, ``disturb`` and the other options of ``load`` change
    the model of both from the start.  The folder gets the facts as JSON, and a page with both futures, in which the
    first firing that changes is marked.

    >>> epicycle.what_if("collision_avoidance", "12 s", disturb="wifi_burst", let_through="wifi_loss").first
    """
    from ...search.what_if import Changes as Changed
    from ...search.what_if import tag_of
    from ...search.what_if import what_if as search
    from .searching import folder_for

    tag, found = tag_of(at), opened(model, seed, until, changes)
    acts = ([each] if isinstance(each, str) else [*each] for each in (remove, let_through, lose))
    answer = search(found.model, tag, Changed(change, *acts), seed=found.seed, until=found.until, progress=progress)
    answer.folder = folder_for([found.model], out, "what_if")
    return answer
