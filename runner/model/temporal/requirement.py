"""What is said of a monitor, declared once: for the reader, its messages, the schema and the docs."""

from __future__ import annotations

from typing import TypedDict

from epicycle.actors import Configurable, Parameter

HOLD, LINEAR = "hold", "linear"


class RequirementOptions(TypedDict, total=False):
    """What may be said of a monitor in Python beside its name and its property."""

    between: str
    stop: bool
    unit: str
    doc: str
    label: str


class Requirement(Configurable):
    """What is said of a monitor beside its name."""

    property = Parameter(str, doc="what is to hold, such as 'always clearance.distance >= 2 m'")
    between = Parameter(
        str,
        HOLD,
        choices=(HOLD, LINEAR),
        doc="the margins of comparisons between two tokens: they hold, or change linearly",
    )
    stop = Parameter(bool, False, doc="whether the run ends as soon as the property is broken")
    unit = Parameter(
        str, "", doc="the unit of its robustness, which is converted to it where the property has numbers with units"
    )
    doc = Parameter(str, "", doc="what it is")
    label = Parameter(str, "", doc="what it is called in figures and reports (default: its name)")
