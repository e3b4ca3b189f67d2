"""Calls of a program that change a model: each does all that it is to do, or raises and has done nothing.

A call only adds, or it looks whether it may take something away before it does.  So what there was before is known by
its size, which costs nothing to remember, and what has been added since is at the end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar, cast

if TYPE_CHECKING:
    from .model import Model
    from .scope import Scope

F = TypeVar("F", bound=Callable[..., Any])


def all_or_nothing(method: F) -> F:
    """Let a method of a scope leave the model as it was if it raises."""

    @wraps(method)
    def whole(scope: Scope, *arguments: Any, **keywords: Any) -> Any:
        with transaction(scope.model):
            return method(scope, *arguments, **keywords)

    return cast(F, whole)


@contextmanager
def transaction(model: Model) -> Iterator[None]:
    """What is done inside is undone if it raises."""
    graph, before = model.graph, _Before(model)
    try:
        yield
    except BaseException:
        graph.shrink(before.graph)
        before.restore(model)
        model.scopes.renew()
        raise


class _Before:
    """What there was: the graph, what is made anew at each change, and lists, which are that or grow."""

    def __init__(self, model: Model) -> None:
        self.graph: Any = model.graph.size()
        self._attributes = {name: getattr(model, name) for name in ("aspects", "warnings", "is_checked", "_order")}
        self._lists = {name: getattr(model, name) for name in ("recorded", "stop_ports", "metrics")}
        self._lengths = list(map(len, self._lists.values()))
        self._stop_when = model.graph.positions.get("stop_when")

    def restore(self, model: Model) -> None:
        """Let it be as it was."""
        for watched, length in zip(self._lists.values(), self._lengths, strict=True):
            del watched[length:]
        for name, value in (*self._attributes.items(), *self._lists.items()):
            setattr(model, name, value)
        if self._stop_when is not None:
            model.graph.positions["stop_when"] = self._stop_when
