"""What a search is about: a monitor of the model's, a property that is given as a text, or aspects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from epicycle.actors import EpicycleError, did_you_mean

from ..model.build.model import Model
from ..model.graph.woven import WovenAspect
from ..model.text.files import COMMAND_LINE
from ..model.text.problems import ModelError, Position

T = TypeVar("T")
AD_HOC = "property"  # the name of a monitor that is made of a text


def monitor_named(model: Model, text: str, name: str = AD_HOC, flag: str = "") -> str:
    """The name of a monitor; a property, which has a space in it, becomes one of the model's with that ``name``.

    ``flag`` is the option of the command line that it comes from, if it does.  Raises ``ModelError``.
    """
    if " " not in text.strip():
        return text
    try:
        model.monitor(name, text)
    except ModelError as error:
        if not flag:
            raise
        option = f"{flag} {text}"
        at = Position(COMMAND_LINE, 1, len(flag) + 2, len(text), option)
        raise ModelError(replace(each, position=at) for each in error.problems) from None
    return name


def monitors_named(model: Model, text: str | None, flag: str = "") -> list[str]:
    """The names of the monitors that are asked for: without a text, all of the model's; raises ``EpicycleError``."""
    if text is not None:
        return [monitor_named(model, text, flag=flag)]
    if not model.output.monitors:
        raise EpicycleError(
            f"{model.name} has no monitor\n   help: say what is to hold, such as "
            f"{flag or 'monitor='}{' ' if flag else ''}'always server.size < 40'"
        )
    return [each.name for each in model.output.monitors]


def aspect_named(model: Model, name: str) -> WovenAspect:
    """An aspect of a model; raises ``EpicycleError`` if there is none of that name."""
    return _known(model, "aspect", name, {woven.name: woven for woven in model.aspects})


def with_monitors(model: Model, monitors: Mapping[str, str]) -> Model:
    """A model with these monitors: those that it does not have are added."""
    known = {each.name for each in model.output.monitors}
    for name, text in monitors.items():
        if name not in known:
            model.monitor(name, text)
    return model


def property_of(model: Model, monitor: str) -> str:
    """The property that a monitor of a model states; raises ``EpicycleError`` if there is no such monitor."""
    return _known(model, "monitor", monitor, {each.name: each.requirement.property for each in model.output.monitors})


def _known(model: Model, what: str, name: str, known: Mapping[str, T]) -> T:
    if name not in known:
        raise EpicycleError(
            f"{model.name} has no {what} {name!r}{did_you_mean(name, known)}\n"
            f"   help: its {what}s: {', '.join(known) or 'none'}"
        )
    return known[name]
