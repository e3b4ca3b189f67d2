"""What ``epicycle describe`` says of files from elsewhere."""

from __future__ import annotations

from pathlib import Path

from .extras import needed


def fmu(path: Path) -> str:
    """The variables of an FMU."""
    said: str = needed("fmi", "an FMU").told(path)
    return said


def recording(path: Path) -> str:
    """The topics of a recording of ROS 2."""
    topics = needed("bags", "a recording of ROS 2").bag(path).topics
    width = max(map(len, topics), default=0)
    return "\n".join(f"{topic.ljust(width)}  {kind}" for topic, kind in topics.items())
