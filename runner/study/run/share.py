"""A share of the runs of a study: one of several that different machines make."""

from __future__ import annotations

import re
from dataclasses import dataclass

from epicycle.actors import EpicycleError

from ..plan.plan import Plan

MAX_SHARES = 100_000


@dataclass(frozen=True)
class Share:
    """``number`` of ``of``, from 0 on.

    It has replication r of condition c if c + r leaves the remainder ``number``: all shares are alike in size and in
    conditions, and more replications move no run from one to another.  With ``until``, where the next runs depend on
    those before, a condition belongs to one share as a whole.
    """

    number: int = 0
    of: int = 1

    @classmethod
    def named(cls, text: str | None) -> Share:
        """That of a text such as ``3/16``, or without one the only share; raises ``EpicycleError``."""
        if text is None:
            return ALL
        found = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
        if found is None or not 1 <= int(found[1]) <= int(found[2]) <= MAX_SHARES:
            raise EpicycleError(f"{text!r} is not a part such as 3/16, the third of 16")
        return cls(int(found[1]) - 1, int(found[2]))

    def __str__(self) -> str:
        return f"{self.number + 1}/{self.of}"

    @property
    def file_name(self) -> str:
        """What its files are called by; empty for the only share."""
        return "" if self.of == 1 else f"{self.number + 1}-of-{self.of}"

    def has(self, plan: Plan, condition: int, replication: int) -> bool:
        """Whether it has this run."""
        return (condition + (0 if plan.study.until else replication)) % self.of == self.number

    def size(self, plan: Plan) -> int:
        """The greatest number of its runs."""
        if self.of == 1:
            return plan.size
        if plan.study.until:
            return len(range(self.number, plan.conditions, self.of)) * plan.replications
        rounds, rest = divmod(plan.replications, self.of)  # `rest` shares have one run more of a condition
        turns, others = divmod(plan.conditions, self.of)
        more = sum((self.number - condition) % self.of < rest for condition in range(others))
        return plan.conditions * rounds + turns * rest + more


ALL = Share()
