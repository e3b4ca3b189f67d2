"""Ptolemy II's own regression models with ``director: {like: ptolemy}``: every send as in the real program.

``models/`` holds those that depart from Ptolemy's as they stand in ``tests/conformance``, or are not quite Ptolemy's
there.  All others match with this director as they do without it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.build.model import Model
from tests.conformance.conformance_parts import TYPES
from tests.conformance.test_conformance import (
    CASES,
    HERE,
    OTHER_MICROSTEPS,
    QUANTITY_MANAGER,
    REFIRING,
    came_in,
    compare,
    recorded,
    requested,
    requests,
    sends,
)

OWN = Path(__file__).parent / "models"
RESUMED = 7.7, 2, "composite_actor.ramp2.output"
"""Like Ptolemy, this send alone is at another microstep: at 1, as all others of actors whose firing was put off."""


def load_like_ptolemy(case: str, folder: Path = OWN) -> Model:
    """The same model, and nothing else, with Ptolemy's rules and actors."""
    file = OWN / f"{case}.yaml"
    if not file.is_file():
        text = (HERE / "models" / file.name).read_text(encoding="utf-8")
        file = folder / file.name
        file.write_text(text + "director: {like: ptolemy}\n", encoding="utf-8")
    return load_model(file, types=TYPES)


@pytest.mark.parametrize("case", CASES)
def test_sends_like_ptolemy(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    resumed = RESUMED if case in OTHER_MICROSTEPS else None
    compare(load_like_ptolemy(case, tmp_path), case, monkeypatch, 1, resumed)


def test_an_aspect_that_is_a_model_like_ptolemy() -> None:
    """Requests wait for the activation of the aspect: all is as there, what comes in by its request ports, too."""
    model = load_like_ptolemy(QUANTITY_MANAGER)
    expected, inside = came_in(model, recorded(QUANTITY_MANAGER))
    assert [(*send[:4], requested(send[4])) for send in sends(model)] == expected
    assert sorted(requests(model)) == sorted(inside)


def test_aspects_that_are_models_like_ptolemy() -> None:
    """All is as there but for the microstep at which the first firing is asked for.

    There, what is asked of an aspect for firings goes by the microstep that its director had last: it had none before.
    """
    model = load_like_ptolemy(REFIRING)
    expected, inside = came_in(model, recorded(REFIRING))

    def ptolemys(send: tuple[float, int, str, int, Any]) -> tuple[float, int, str, int, Any]:
        time, microstep, port, channel, value = send
        return time, microstep - (time == 1 and port.startswith("execution.")), port, channel, value

    assert [ptolemys((*send[:4], requested(send[4]))) for send in sends(model)] == expected
    assert sorted(map(ptolemys, requests(model))) == sorted(inside)
