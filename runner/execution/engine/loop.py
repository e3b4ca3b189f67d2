"""The loop of a run: which comes next, a tag of the director's agenda or a SimPy event."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from epicycle.actors import NEVER

from ..results import STOP_TIME
from .errors import ActorError, LoopError, of_process
from .pace import notice

if TYPE_CHECKING:
    from epicycle.actors import Actor

    from .director import Director
    from .pace import Pace

_NOTICED = 16  # steps between two checks for other work


def handle_events(
    director: Director,
    stop: int | None,
    actors: list[Actor],
    progress: Callable[[float], None] | None = None,
    pace: Pace | None = None,
    most: int | None = None,
) -> str:
    """Handle events up to and including ``stop`` (ns), until none is left, or until a stop is requested.

    Returns why it ended, or an empty text after ``most`` steps, each of which is a tag or a SimPy event.
    """
    times, events = director._times, director.events
    queue = events.content
    last_step = NEVER if most is None else director.steps + most
    last_time = NEVER - 1 if stop is None else stop
    here, never = 0, NEVER
    now = director._last.time
    if pace is not None:
        pace.wait_for(now)
    if progress is not None:
        progress(now / 1e9)
    while director.steps < last_step:
        instant = None if director.present is None else director._next
        if director._stop_after is not None and director._last.tag >= director._stop_after:
            break
        is_of_simpy = False
        if instant is not None:  # more at the present time
            upcoming = instant.time
        else:
            upcoming = times.first()
            if queue and queue[0][0] <= upcoming:
                is_of_simpy = True
                upcoming = min(queue[0][0], NEVER)
            if upcoming == never:
                break
            if director._stop_after is not None and max(upcoming, director._last.time) > director._stop_after.time:
                break
        if upcoming > last_time:
            if pace is not None:
                pace.wait_for(last_time)
            return STOP_TIME
        if upcoming > now:
            if director.watch is not None and director.watch(upcoming):
                break
            if pace is not None:
                pace.wait_for(upcoming)
        try:
            if director._is_interrupted:
                raise KeyboardInterrupt
            if is_of_simpy:
                director._time = upcoming
                events.happen()
            elif instant is not None:
                director._next = None
                director.handle(instant)
            else:
                director._time = upcoming
                director.handle(director.take())
        except BaseException as error:
            director.present = None
            if isinstance(error, (ActorError, LoopError, KeyboardInterrupt)):
                raise
            found, cause = of_process(error, actors, director.tag)
            raise found from cause
        if upcoming != now:
            here, now = 0, upcoming
        elif instant is None:
            here += 1
            if here > director._most_steps:
                raise LoopError(director.tag.time, ())
        director.steps += 1
        if director.steps % _NOTICED == 0:
            notice(progress, now)
    else:
        return ""
    return director._reason
