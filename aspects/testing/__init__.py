"""Tests that an aspect does not interfere with what it is not woven on: for anyone's aspects, on anyone's models.

Each function runs a model a few times and raises an ``AssertionError`` that says which event of the log was the first
to differ.  How to run it is told by a *trial*: a function that weaves aspects around a model in addition to its own,
runs it, and returns the records of the event log.  ``epicycle.runner.Trial`` makes one of a model:

>>> trial = Trial("collision_avoidance", until=2.0)
>>> def test_offset():
...     assert_silent_at_zero(Offset(by=0.0), trial, at="**.measurement")
...     assert_removal_moves_nothing(Offset(by=0.3), trial, at="**.measurement")
...     assert_streams_are_its_own(Offset(by=0.3), trial, at="**.measurement")

Where no token passes the aspect a test shows nothing, and fails for that reason.
"""

from .interference import (
    assert_observes_only,
    assert_order_of_unrelated_aspects_is_free,
    assert_removal_moves_nothing,
    assert_silent_at_zero,
    assert_streams_are_its_own,
)
from .trial import Event, RunModel, Woven

__all__ = [
    "Event",
    "RunModel",
    "Woven",
    "assert_observes_only",
    "assert_order_of_unrelated_aspects_is_free",
    "assert_removal_moves_nothing",
    "assert_silent_at_zero",
    "assert_streams_are_its_own",
]
