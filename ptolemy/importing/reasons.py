"""Why some classes of Ptolemy II have no counterpart and will not get one."""

from __future__ import annotations

import re

_REASONS = (
    (r"\.lib\.(python|js|jjs|vertx)\.|Script\Z", "a script is a program, and no program in an imported file is run"),
    (r"Date|\.lib\.WallClock", "it depends on the date, which a run does not"),
    (
        r"\.(\w*ModelReference|RunCompositeActor|Execute\w*Actor|LifeCycleManager|Mobile\w+|ExceptionManagerModel)\Z",
        "it runs a separate model or reads one from a file",
    ),
    (
        r"\.lib\.(io|net|database|excel|fmi|mail|xslt)\.|\.lib\.(URL|Exec\Z|\w*Reader)",
        "no other file or program is read",
    ),
    (r"\.gui\.|javasound|\.image\.|\.video\.|\.jai\.|\.jmf\.|joystick|\.vergil\.", "it needs a user at a screen"),
    (r"domains\.(continuous|ct)\.", "continuous models are not imported"),
    (r"domains\.(wireless|ptides|pn|csp|rendezvous|ddf|giotto|tdl|ptera|gr)\.", "its domain is not supported"),
)


def why_not(java: str) -> str:
    """The end of the message about a class without a counterpart: a reason, or nothing."""
    return next((f": {reason}" for pattern, reason in _REASONS if re.search(pattern, java)), "")
