"""What fitting a channel to a measured trace has found: models, how well they fit, and a disturbance."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from epicycle.actors import counted
from epicycle.aspects import Trace

from ..support.shown import finite, short
from ..support.tables import Table, Tabled
from .delays import DelayLaw, autocorrelation, delay_laws
from .losses import Goodness, LossModel, loss_models

_NOTABLE = 0.1  # correlation of successive delays


@dataclass(repr=False)
class Fit(Tabled):
    """Models of the losses and delays in a trace, how well they fit, and a disturbance with the best ones.

    ``losses`` and ``delays`` are those with the least BIC, Schwarz's Bayesian information criterion, of the models in
    order of freedom.  ``overtakes``: whether messages overtook each other; None if the trace does not say when they
    were sent.
    """

    file: Path
    at: list[str]
    messages: int
    lost: int
    losses: LossModel
    delays: DelayLaw | None
    loss_models: list[LossModel]
    delay_laws: list[DelayLaw]
    at_once: int  # messages without any delay
    correlation: float  # of successive delays
    overtakes: bool | None

    @classmethod
    def of(cls, file: Path, trace: Trace, at: str | Iterable[str]) -> Fit:
        """All models fitted to a trace, which stands in a file."""
        losses, arrived = loss_models(trace.lost), ~trace.lost
        laws: list[DelayLaw] = []
        at_once, correlation, overtakes = 0, 0.0, None
        if trace.delays is not None and arrived.any():
            delays = trace.delays[arrived] / 1e9
            laws, correlation = delay_laws(delays), autocorrelation(delays)
            at_once = int(np.count_nonzero(delays == 0.0))
            if trace.times is not None:
                overtakes = bool((np.diff((trace.times + trace.delays)[arrived]) < 0).any())
        return cls(
            file,
            [at] if isinstance(at, str) else list(at),
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

    def aspects(self) -> dict[str, dict[str, Any]]:
        """The aspects of the disturbance, by name."""
        losses, law = self.losses, self.delays
        found: dict[str, dict[str, Any]] = {}
        if self.lost:
            found["losses"] = {"type": losses.aspect, **_rounded(losses.parameters), "at": list(self.at)}
        if law is not None and law.shift + law.mean > 0.0:
            rest: dict[str, Any] = {"jitter": _time(law.mean), "distribution": "exponential"} if law.mean > 0.0 else {}
            if law.shape != 1.0:
                rest["distribution"] = {"type": "Gamma", **_rounded({"shape": law.shape}), "mean": 1}
            # Where it is unknown whether messages overtake each other, their delays at least follow the law.
            given = {"delay": _time(law.shift), **rest, "reordering": self.overtakes is not False}
            found["delays"] = {"type": "Latency", **given, "at": list(self.at)}
        return found

    def disturbance(self, name: str | None = None) -> str:
        """A disturbance file with these aspects."""
        name = re.sub(r"\W", "_", name or self.file.stem, flags=re.ASCII)
        head = {"disturbance": f"_{name}" if name[:1].isdigit() else name or "fitted", "doc": self._caption()}
        text: str = yaml.safe_dump({**head, "aspects": self.aspects()}, sort_keys=False, allow_unicode=True, width=110)
        return text

    def save(self, path: str | Path) -> Path:
        """Write the disturbance file."""
        path = Path(path)
        path.write_text(self.disturbance(path.stem), encoding="utf-8")
        return path

    def facts(self) -> dict[str, Any]:
        """Everything that was found, as JSON-like data."""
        found: dict[str, Any] = finite({**asdict(self), "file": str(self.file), "aspects": self.aspects()})
        return found

    def _caption(self) -> str:
        share = f"{100.0 * self.lost / self.messages:.3g} %"
        said = f"{self.file.name}: {counted(self.messages, 'message')}, {self.lost:,} lost ({share})"
        said += f"; losses: {self.losses.name}{_verdict(self.losses.runs)}" if self.lost else ""
        law = self.delays
        if law is not None:
            said += f"; delays: {law.name}{_verdict(law.spread)}"
            if self.at_once and law.name != "constant":
                verb = "is" if self.at_once == 1 else "are"
                said += f"; {counted(self.at_once, 'delay')} {verb} 0, so no gamma law can be fitted"
            if abs(self.correlation) > max(_NOTABLE, 3.0 / math.sqrt(self.messages)):
                said += (
                    f"; successive delays have the correlation {self.correlation:.2f}, but Latency draws independent "
                    "ones: to keep that, replay the trace with TraceReplay"
                )
        return said

    def _tables(self) -> list[Table]:
        losses = [_row(each, self.losses, each.parameters, each.gain, each.runs) for each in self.loss_models]
        laws = [
            _row(each, self.delays, {"shift": each.shift, "mean": each.mean, "shape": each.shape}, each.spread)
            for each in self.delay_laws
        ]
        head = ("parameters", "log likelihood", "BIC")
        return [
            Table(("losses", *head, "better than the one above by chance", "runs fit, chi-square"), losses),
            Table(("delays", *head, "law fits, Kolmogorov-Smirnov"), laws),
        ]


def _rounded(values: dict[str, Any]) -> dict[str, Any]:
    return {key: float(f"{value:.6g}") if type(value) is float else value for key, value in values.items()}


def _time(seconds: float) -> str:
    return f"{1e3 * seconds:.6g} ms"


def _row(
    model: LossModel | DelayLaw,
    best: LossModel | DelayLaw | None,
    parameters: dict[str, float],
    *tests: Goodness | None,
) -> tuple[str, ...]:
    words = ", ".join(f"{name} {short(float(f'{value:.4g}'))}" for name, value in parameters.items())
    name, likelihood = f"{model.name} *" if model is best else model.name, f"{model.log_likelihood:,.1f}"
    return name, words, likelihood, f"{model.bic:,.1f}", *("-" if each is None else _p(each) for each in tests)


def _p(test: Goodness) -> str:
    return f"p = {test.p:.2g}" if test.p >= 1e-99 else "p < 1e-99"


def _verdict(test: Goodness | None) -> str:
    return " (too few for a test)" if test is None else f" ({'fits' if test.p >= 0.05 else 'does not fit'}: {_p(test)})"
