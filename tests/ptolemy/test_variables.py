"""Variables under ``like: ptolemy``: what sets one counts as there."""

from __future__ import annotations

import pytest

from tests.actors import test_variables
from tests.actors.test_variables import model, sends

LIKE = "\nmodel: m\ndirector: {like: ptolemy}\n"


@pytest.mark.parametrize("delayed", [True, False])
def test_a_new_value_counts_as_it_does_by_epicycle_s_rules(delayed: bool) -> None:
    actors = ("set", "const", "text", "v")
    ours, theirs = (sends(model(delayed, director), *actors) for director in ("epicycle", "ptolemy"))
    assert ours == theirs
    assert len(ours) > 12


def test_several_set_one_variable_in_the_order_in_which_they_fire(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in Ptolemy's Priority1."""
    monkeypatch.setattr(test_variables, "load", lambda text: LOAD(text.replace("\nmodel: m\n", LIKE)))
    test_variables.test_several_set_one_variable_in_the_order_in_which_they_fire()


@pytest.mark.parametrize("director", ["", "director: {}"])
def test_a_port_parameter_of_a_composite(director: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(test_variables, "load", lambda text: LOAD(text.replace("\nmodel: m\n", LIKE)))
    test_variables.test_a_port_parameter_of_a_composite(director)


LOAD = test_variables.load
