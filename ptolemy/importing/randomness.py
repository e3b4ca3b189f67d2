"""Converts random actors: their distributions, and the generators that reproduce Java's numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from epicycle import actors
from epicycle.actors import declared_parameters

from ..generators import LAWS
from .special import Special, finite_stop

if TYPE_CHECKING:
    from .actors import Actor


def random(law: str, **parameters: str) -> Special:
    """A Random with a distribution: ``ours="theirs=default"``."""

    def convert(actor: Actor) -> None:
        found: dict[str, Any] = {"type": law}
        for ours, said in parameters.items():
            name, _, default = said.partition("=")
            if actor.widths.get(name, 0):
                _vary(actor, name, ours)
            value = actor.get(name, actor.scope.value(default))
            parameter = declared_parameters(getattr(actors, law))[ours]
            if parameter.required or parameter.default != value:
                found[ours] = value
        if "varying" not in actor.values:
            actor.values["type"] = "Random"
        actor.values["distribution"] = found
        generator(actor)

    return convert


def _vary(actor: Actor, name: str, ours: str) -> None:
    """Read a parameter of the distribution from a port."""
    actor.values.setdefault("varying", []).append(ours)
    actor.ports[name] = ours


def _fixed(actor: Actor, *names: str) -> None:
    """Parameters from which those of our distribution are computed before the run."""
    for name in names:
        if actor.widths.get(name, 0):
            actor.notes.error(f"{actor.path}.{name}: a distribution that changes during the run has no counterpart")


def java_hash(text: str) -> int:
    """The hash of a text in Java."""
    found = 0
    for character in text:
        found = (31 * found + ord(character)) % 2**32
    return found - 2**32 if found >= 2**31 else found


def generator(actor: Actor) -> None:
    """The numbers of Java's generators, if the model fixes them by its own seed or the shared one."""
    own, shared = actor.get("privateSeed"), actor.get("seed", actor.seed)
    kind = "DRand" if ".colt." in actor.entity.java else "JavaRandom"
    law = actor.values.get("distribution", {}).get("type", "Exponential")  # which a PoissonClock draws
    if (made := actor.text("generatorClass", "DRand")) != "DRand":
        actor.notes.note(f"{actor.path}.generatorClass = {made!r} has no counterpart; the numbers will differ")
    elif law not in LAWS and (own or shared):
        actor.notes.note(f"{actor.path}: the numbers of its {law} distribution will differ")
    elif isinstance(own, int) and not isinstance(own, bool):
        actor.values["generator"] = {"type": kind, "seed": own}
    elif isinstance(shared, int) and shared:
        actor.values["generator"] = {"type": kind, "seed": shared + java_hash(actor.full_name)}


def poisson_clock(actor: Actor) -> None:
    """Its stop time, and its random numbers."""
    finite_stop(actor)
    generator(actor)


def colt_exponential(actor: Actor) -> None:
    """Its lambda is the rate."""
    _fixed(actor, "lambda")
    rate = actor.get("lambda", 1.0)
    actor.values["distribution"] = {"type": "Exponential", **({} if rate == 1.0 else {"mean": 1.0 / rate})}
    generator(actor)


def colt_gamma(actor: Actor) -> None:
    """Its alpha is the shape, its lambda the rate."""
    _fixed(actor, "alpha", "lambda")
    shape, rate = actor.get("alpha", 1.0), actor.get("lambda", 1.0)
    actor.values["distribution"] = {"type": "Gamma", "shape": shape, "mean": shape / rate}
    generator(actor)


def colt_negative_binomial(actor: Actor) -> None:
    """Its p is the probability of the outcomes that are not counted."""
    _fixed(actor, "n", "p")
    probability = 1.0 - actor.get("p", 0.5)
    actor.values["distribution"] = {
        "type": "NegativeBinomial",
        "successes": actor.get("n", 1),
        "probability": probability,
    }
    generator(actor)


def colt_breit_wigner(actor: Actor) -> None:
    """Its gamma is the width at half the height."""
    _fixed(actor, "mean", "gamma", "cut")
    found = {"type": "Cauchy", "median": actor.get("mean", 1.0), "scale": actor.get("gamma", 1.0) / 2.0}
    cut = actor.get("cut", 1.0)
    actor.values["distribution"] = found if math.isinf(cut) else {**found, "cut": cut}
    generator(actor)
