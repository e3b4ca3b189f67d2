"""Names from former versions of Ptolemy II, which its own reader accepts, too."""

from __future__ import annotations

from typing import Any

from .entities import Entity, kind

_NAMES = {
    "Server": {"newServiceTime": "serviceTime"},
    "VariableDelay": {"defaultDelay": "delay"},
    "Sleep": {"delay": "sleepTime"},
}  # of parameters and ports


def rename_former(model: Entity) -> None:
    """Give ports and parameters their present names."""
    for composite in model.everything():
        for child in composite.entities.values():
            for former, name in _NAMES.get(kind(child), {}).items():
                _rename(child.properties, former, name)
                _rename(child.ports, former, name)
                if links := composite.links.pop(f"{child.name}.{former}", None):
                    composite.links.setdefault(f"{child.name}.{name}", []).extend(links)


def _rename(known: dict[str, Any], former: str, name: str) -> None:
    if former in known and name not in known:
        known[name] = known.pop(former)
        known[name].name = name
