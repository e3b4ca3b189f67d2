"""Signal: the tokens that one port sent, as lists, NumPy arrays or a data frame."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import EpicycleError, Tag, counted, did_you_mean, to_seconds

from ...support.shown import short
from ...support.tables import Table, Tabled, pandas_module
from .encoding import field_names, leaves
from .record import Samples

if TYPE_CHECKING:
    import pandas

_SHOWN = 8  # tokens shown of the beginning and of the end


class SignalError(EpicycleError):
    """A signal, or a field of its tokens, that does not exist."""


class Signal(Tabled):
    """The tokens that one port sent, with their tags, in order.

    >>> state = results["main.state"]
    >>> state.times, state["position"]          # arrays of shape (n,) and (n, 2)
    """

    def __init__(self, name: str, tags: Iterable[Tag] = (), tokens: Iterable[Any] = ()) -> None:
        self.name = name
        self.samples = Samples()
        for tag, token in zip(tags, tokens, strict=True):
            self.add(tag, token)

    def add(self, tag: Tag, token: Any) -> None:
        """Append a token."""
        self.samples.add(*tag, token)

    @property
    def tags(self) -> list[Tag]:
        """When each token was sent."""
        return list(map(Tag, self.samples.times, self.samples.microsteps))

    @property
    def tokens(self) -> list[Any]:
        """The tokens."""
        return list(self.samples.tokens[: len(self)])

    def __iter__(self) -> Iterator[tuple[Tag, Any]]:
        """Each token with its tag; all at once, they may not fit into memory."""
        return zip(map(Tag, self.samples.times, self.samples.microsteps), self.samples.tokens, strict=False)

    def __len__(self) -> int:
        return len(self.samples.microsteps)

    @property
    def times(self) -> NDArray[np.float64]:
        """The times in seconds."""
        return np.fromiter(map(to_seconds, self.samples.times), dtype=float, count=len(self))

    @property
    def microsteps(self) -> NDArray[np.int64]:
        """The microsteps."""
        return np.array(self.samples.microsteps, dtype=np.int64)

    @property
    def values(self) -> NDArray[Any]:
        """The tokens as an array: numbers as numbers, arrays of one shape stacked, anything else as objects."""
        return as_array(self.tokens)

    @property
    def fields(self) -> tuple[str, ...]:
        """The names of the tokens' fields, if they are dataclasses or mappings."""
        names: dict[str, None] = {}
        for token in self.tokens:
            names.update(dict.fromkeys(_fields(token)))
        return tuple(names)

    def field(self, name: str) -> NDArray[Any]:
        """One field of all tokens as an array, also written ``signal[name]``; raises ``SignalError``."""
        found = []
        for token in self.tokens:
            if name not in _fields(token):
                valid = _fields(token)
                raise SignalError(
                    f"{self.name}: a token of type {type(token).__name__} has no field {name!r}"
                    f"{did_you_mean(name, valid)}; its fields: {', '.join(valid) or 'none'}"
                )
            found.append(token[name] if isinstance(token, dict) else getattr(token, name))
        return as_array(found)

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.field(name)

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each token, indexed by time in s: ``microstep``, and a column for each number or text in a token.

        The column of a plain number is ``value``; others have the name of their place, such as ``position[0]``.  A
        field ``time`` or ``microstep`` of the token itself is ``token.time`` or ``token.microstep``.
        """
        frames = pandas_module()
        index = frames.Index(self.times, name="time")
        named = {"": "value", "time": "token.time", "microstep": "token.microstep"}
        rows = [{named.get(place, place): leaf for place, leaf in leaves(token)} for token in self.tokens]
        columns = dict.fromkeys(place for row in rows for place in row)
        frame: pandas.DataFrame = frames.DataFrame(rows, index=index, columns=list(columns))
        frame.insert(0, "microstep", self.microsteps)
        return frame

    def __repr__(self) -> str:
        if not len(self):
            return f"<Signal {self.name}: no tokens>"
        kind = type(self.samples.tokens[0]).__name__
        first, last = to_seconds(self.samples.times[0]), to_seconds(self.samples.times[-1])
        tokens = counted(len(self), "token")
        return f"<Signal {self.name}: {tokens} ({kind}) from {first:g} s to {last:g} s>"

    def _caption(self) -> str:
        return repr(self).strip("<>")

    def _tables(self) -> list[Table]:
        rows = [
            (f"{tag.seconds:.9g}", str(tag.microstep), short(token))
            for tag, token in zip(self.tags, self.tokens, strict=True)
        ]
        if len(rows) > 2 * _SHOWN:
            rows = [*rows[:_SHOWN], ("...", "", ""), *rows[-_SHOWN:]]
        return [Table(("time (s)", "microstep", "token"), rows)]


def as_array(tokens: list[Any]) -> NDArray[Any]:
    """Tokens as an array; its first axis counts them."""
    kinds = {type(token) for token in tokens}
    if kinds <= {bool, int, float, str} and (len(kinds) < 2 or str not in kinds):
        return np.array(tokens, dtype=None if tokens else float)
    try:
        found = np.array(tokens)
    except ValueError:  # of different shapes
        found = np.empty(0, dtype=object)
    if found.ndim > 0 and len(found) == len(tokens) and found.dtype.kind in "biuf":
        return found
    return np.fromiter(tokens, dtype=object, count=len(tokens))


def _fields(token: Any) -> tuple[str, ...]:
    if isinstance(token, dict):
        return tuple(str(key) for key in token)
    if dataclasses.is_dataclass(token) and not isinstance(token, type):
        return field_names(type(token))
    return ()
