"""Digests are those in the repository, here and with the libraries of another machine; ``make portable`` tries more."""

from __future__ import annotations

import json

from .digests import parts
from .portable import GOLDEN, Setting, differences, outcome, settings


def test_every_part_has_a_digest_in_the_repository() -> None:
    assert list(json.loads(GOLDEN.read_text())) == list(parts())


def test_digests_hold_with_old_libraries() -> None:
    setting = next(each for each in [*settings(), Setting("as it is")] if "old" in each.name or not each.variables)
    found, wrong, _ = outcome(setting)
    assert wrong == ""
    assert differences(found, json.loads(GOLDEN.read_text())) == []
