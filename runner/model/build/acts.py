"""Single acts of aspects that a disturbance names."""

from __future__ import annotations

from collections.abc import Iterable

from epicycle.actors import did_you_mean

from ..graph.acts import ActName
from ..graph.woven import WovenAspect
from ..language.acts import ActText
from ..text.problems import Problems

_FEW = 8  # places that a message lists


def acts_of(texts: Iterable[ActText], aspects: Iterable[WovenAspect], problems: Problems) -> frozenset[ActName]:
    """The names of acts; unknown aspects and places are problems."""
    places = {woven.name: woven.places for woven in aspects}
    found = set()
    for each in texts:
        aspect, place = each.aspect.text, each.at.text
        if aspect not in places:
            message = f"exactly: there is no aspect {aspect!r}{did_you_mean(aspect, places)}"
            problems.add(message, each.aspect.position, f"the aspects: {', '.join(places) or 'none'}")
        elif place not in places[aspect]:
            known = places[aspect]
            rest = f" and {len(known) - _FEW} more" if len(known) > _FEW else ""
            message = f"exactly: aspect {aspect} does not attach to {place!r}{did_you_mean(place, known)}"
            problems.add(message, each.at.position, f"it attaches to {', '.join(known[:_FEW])}{rest}")
        else:
            found.add(ActName(aspect, place, each.token))
    return frozenset(found)
