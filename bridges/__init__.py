"""What others have, as parts of a model, and models as parts of what others have.

``processes``: functions and programs written for SimPy.  ``learning``: models as environments of Gymnasium and
PettingZoo.  ``bags``: recordings of ROS 2.  ``fmi``:
FMUs.  ``systems``: systems of python-control.  Bridges use Epicycle's public interface only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .extras import needed

if TYPE_CHECKING:
    from .bags import Bag, BagFolder, bag, lockstep
    from .environments import gym, zoo
    from .fmi import FMU, trust
    from .learning import Agent, AgentError, GymEnv, ZooEnv, deploy
    from .processes import Environment, Process, process
    from .systems import linear

__all__ = [
    "FMU",
    "Agent",
    "AgentError",
    "Bag",
    "BagFolder",
    "Environment",
    "GymEnv",
    "Process",
    "ZooEnv",
    "bag",
    "deploy",
    "gym",
    "linear",
    "lockstep",
    "process",
    "trust",
    "zoo",
]

_HOMES = {
    "bags": ("Bag", "BagFolder", "bag", "lockstep"),
    "environments": ("gym", "zoo"),
    "fmi": ("FMU", "trust"),
    "learning": ("Agent", "AgentError", "GymEnv", "ZooEnv", "deploy"),
    "systems": ("linear",),
    "processes": ("Environment", "Process", "process"),
}


def __getattr__(name: str) -> Any:
    # On first use: most need a package of their own.
    home = next((home for home, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(needed(home, name), name)
