"""Ctrl-C, held back until no work is half done."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

_PATIENCE = 0.2  # s


@contextmanager
def held() -> Iterator[None]:
    """Make Ctrl-C wait where it would leave half a line or a broken file."""
    before = _handler()
    if before is None:
        yield
        return
    arrived: list[tuple[Any, Any]] = []
    signal.signal(signal.SIGINT, lambda *given: arrived.append(given))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if arrived:
        before(*arrived[0])


@contextmanager
def between_steps(interrupt: Callable[[], None]) -> Iterator[None]:
    """Make Ctrl-C end a run between two of its steps, so that records and counts are complete.

    ``interrupt`` makes the next step raise ``KeyboardInterrupt`` instead.  A step that takes longer than 0.2 s is
    interrupted.
    """
    before = _handler()
    if before is not signal.default_int_handler:  # somebody else handles Ctrl-C
        yield
        return
    late: list[threading.Timer] = []  # made when it is needed: a run may be made of very many short parts

    def handle(number: int, frame: Any) -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        interrupt()
        late.append(threading.Timer(_PATIENCE, partial(signal.pthread_kill, threading.get_ident(), signal.SIGINT)))
        late[0].daemon = True
        late[0].start()

    signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        for timer in late:
            timer.cancel()
            with suppress(KeyboardInterrupt, RuntimeError):  # its signal arrives just now; the timer was not started
                timer.join()
        signal.signal(signal.SIGINT, before)


def _handler() -> Callable[[int, Any], Any] | None:
    """The handler of Ctrl-C, if it may be changed here."""
    if threading.current_thread() is not threading.main_thread():
        return None
    handler = signal.getsignal(signal.SIGINT)
    return handler if callable(handler) else None
