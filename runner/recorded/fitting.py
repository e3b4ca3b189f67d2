"""A measured channel, and the aspects that are most like it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from epicycle.aspects import Trace

from .delays import DelayLaw, autocorrelation, delay_laws
from .losses import LossModel, loss_models


@dataclass(frozen=True)
class Fitted:
    """The models of a trace in order of freedom.  ``losses`` and ``delays`` are those with the least BIC.

    ``overtakes``: whether messages overtook each other; None if the trace does not say when they were sent.
    """

    messages: int
    lost: int
    losses: LossModel
    delays: DelayLaw | None
    loss_models: list[LossModel]
    delay_laws: list[DelayLaw]
    at_once: int  # messages without any delay
    correlation: float  # of successive delays
    overtakes: bool | None


def fitted(trace: Trace) -> Fitted:
    """Fit all models to a trace."""
    losses = loss_models(trace.lost)
    laws: list[DelayLaw] = []
    at_once, correlation, overtakes = 0, 0.0, None
    arrived = ~trace.lost
    if trace.delays is not None and arrived.any():
        delays = trace.delays[arrived] / 1e9
        laws, correlation = delay_laws(delays), autocorrelation(delays)
        at_once = int(np.count_nonzero(delays == 0.0))
        if trace.times is not None:
            overtakes = bool((np.diff((trace.times + trace.delays)[arrived]) < 0).any())
    return Fitted(
        len(trace),
        int(np.count_nonzero(trace.lost)),
        min(losses, key=lambda each: each.bic),
        min(laws, key=lambda each: each.bic, default=None),
        losses,
        laws,
        at_once,
        correlation,
        overtakes,
    )
