"""The model graph as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ...support.declare.checked import checked
from ...support.declare.parameters import option, whole

if TYPE_CHECKING:
    from ...model.build.model import Model
    from ...show.graph import Outline
    from ...show.pictures import Picture


@checked
def draw(
    model: Model | str | Path,
    *,
    depth: Annotated[
        int | None,
        option(
            "open composites N levels deep, 0 for none (default: as deep as the drawing stays readable)", "N", whole(0)
        ),
    ] = None,
    expand: Annotated[bool, option("draw every instance of an array, even if they are alike")] = False,
    machine: Annotated[
        str | None, option("draw the modes of this machine or composite as a statechart", "PATH")
    ] = None,
) -> Picture:
    """The model graph as a picture: what ``epicycle graph`` draws, with the same options."""
    from ...show.graph import write_graph
    from ...show.pictures import Picture
    from .running import opened

    made = opened(model, None, None, {}).model
    drawn = outlined(made, depth, expand, machine)
    return Picture(made.name if machine is None else f"{made.name}: {machine}", lambda path: write_graph(drawn, path))


def outlined(model: Model, depth: int | None = None, expand: bool = False, machine: str | None = None) -> Outline:
    """What is drawn of a model."""
    from ...show.graph import outline, statechart

    return outline(model, depth=depth, expand=expand) if machine is None else statechart(model, machine)
