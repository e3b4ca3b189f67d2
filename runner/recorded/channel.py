"""What fitting a channel to a measured trace has found: models, how well they fit, and a disturbance."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import yaml

from epicycle.actors import counted

from ..support.shown import finite, short
from ..support.tables import Table, Tabled
from .delays import DelayLaw
from .fitting import Fitted
from .losses import Goodness, LossModel

_NOTABLE = 0.1  # correlation of successive delays


class Fit(Tabled):
    """Models of the losses and delays in a trace, how well they fit, and a disturbance with the best ones.

    ``fitted`` holds the models: ``fitted.losses`` and ``fitted.delays`` are those with the least BIC, Schwarz's
    Bayesian information criterion.
    """

    def __init__(self, file: Path, fitted: Fitted, at: Iterable[str]) -> None:
        self.file = file
        self.fitted = fitted
        self.at = [at] if isinstance(at, str) else list(at)

    def aspects(self) -> dict[str, dict[str, Any]]:
        """The aspects of the disturbance, by name."""
        losses, law = self.fitted.losses, self.fitted.delays
        found: dict[str, dict[str, Any]] = {}
        if self.fitted.lost:
            found["losses"] = {"type": losses.aspect, **_rounded(losses.parameters), "at": list(self.at)}
        if law is not None and law.shift + law.mean > 0.0:
            rest: dict[str, Any] = {"jitter": _time(law.mean), "distribution": "exponential"} if law.mean > 0.0 else {}
            if law.shape != 1.0:
                rest["distribution"] = {"type": "Gamma", **_rounded({"shape": law.shape}), "mean": 1}
            # Where it is unknown whether messages overtake each other, their delays at least follow the law.
            given = {"delay": _time(law.shift), **rest, "reordering": self.fitted.overtakes is not False}
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
        found: dict[str, Any] = finite({"file": str(self.file), **asdict(self.fitted), "aspects": self.aspects()})
        return found

    def __repr__(self) -> str:
        return f"<Fit of {self._caption()}>"

    def _caption(self) -> str:
        found = self.fitted
        share = f"{100.0 * found.lost / found.messages:.3g} %"
        said = f"{self.file.name}: {counted(found.messages, 'message')}, {found.lost:,} lost ({share})"
        said += f"; losses: {found.losses.name}{_verdict(found.losses.runs)}" if found.lost else ""
        law = found.delays
        if law is not None:
            said += f"; delays: {law.name}{_verdict(law.spread)}"
            if found.at_once and law.name != "constant":
                verb = "is" if found.at_once == 1 else "are"
                said += f"; {counted(found.at_once, 'delay')} {verb} 0, so no gamma law can be fitted"
            if abs(found.correlation) > max(_NOTABLE, 3.0 / math.sqrt(found.messages)):
                said += (
                    f"; successive delays have the correlation {found.correlation:.2f}, but Latency draws independent "
                    "ones: to keep that, replay the trace with TraceReplay"
                )
        return said

    def _tables(self) -> list[Table]:
        found = self.fitted
        losses = [
            (
                _mark(each, found.losses),
                _words(each.parameters),
                f"{each.log_likelihood:,.1f}",
                f"{each.bic:,.1f}",
                _test(each.gain),
                _test(each.runs),
            )
            for each in found.loss_models
        ]
        laws = [
            (
                _mark(each, found.delays),
                _words({"shift": each.shift, "mean": each.mean, "shape": each.shape}),
                f"{each.log_likelihood:,.1f}",
                f"{each.bic:,.1f}",
                _test(each.spread),
            )
            for each in found.delay_laws
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


def _words(parameters: dict[str, float]) -> str:
    return ", ".join(f"{name} {short(float(f'{value:.4g}'))}" for name, value in parameters.items())


def _mark(model: LossModel | DelayLaw, best: LossModel | DelayLaw | None) -> str:
    return f"{model.name} *" if model is best else model.name


def _test(test: Goodness | None) -> str:
    return "-" if test is None else _p(test)


def _p(test: Goodness) -> str:
    return f"p = {test.p:.2g}" if test.p >= 1e-99 else "p < 1e-99"


def _verdict(test: Goodness | None) -> str:
    return " (too few for a test)" if test is None else f" ({'fits' if test.p >= 0.05 else 'does not fit'}: {_p(test)})"
