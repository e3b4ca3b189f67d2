# cython: binding=True
"""Random streams: one per (seed, dotted path, purpose), independent of the order in which they are requested.

The key of a stream is a hash of its names, so adding, removing or reordering actors and aspects moves no other
stream, and neither does ``PYTHONHASHSEED`` or the number of workers.

NumPy guarantees the bits of its bit generators for all versions and machines, but not the values of its distributions.
So only the bits come from NumPy (PCG64); every law is our own (``laws``), and draws the same numbers everywhere.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import math
from collections.abc import Callable, MutableSequence, Sequence
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike

from . import choices, laws
from .messages import did_you_mean
from .primitives import Words

Size = int | Sequence[int] | None

_STEP: Final = 1 / 2**53  # from one number of ``random`` to the next
_PLAIN: Final = frozenset({float, int, bool})


class RandomStream(Words):
    """Random numbers of one purpose, with the methods of ``numpy.random.Generator`` and bits that never change.

    Parameters may be arrays, and ``size`` requests an array; its values are drawn one by one in C order, so that
    ``normal(size=3)`` gives the values of three calls.  A law with a closed inverse uses one 64-bit word per value and
    increases with it, so streams stay in step when only parameters differ (common random numbers).

    Differences from NumPy: the numbers, except those of ``random`` and ``uniform``; ``choice``, ``shuffle`` and
    ``permutation`` support only the first axis; rare laws are missing.  Raises ``ValueError`` for parameters out of
    range.
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return f"<Stream {self.state}>"

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("_") and hasattr(np.random.Generator, name):
            known = ["word", *(each for each in vars(RandomStream) if not each.startswith("_"))]
            raise AttributeError(
                f"a random stream has no {name!r}{did_you_mean(name, known)}: NumPy's results depend on its version "
                f"and the machine; available: {', '.join(sorted(known))}"
            )
        raise AttributeError(f"a random stream has no {name!r}")

    @property
    def state(self) -> tuple[int, int]:
        """The position of the stream: the state of PCG64 before the next word, and its increment."""
        bits = np.random.PCG64()
        bits.state = self._bits.state
        inner = bits.advance(-len(self._ahead)).state["state"]
        return int(inner["state"]), int(inner["inc"])

    # -- bits ------------------------------------------------------------------------------------------------------

    def below(self, bound: int) -> int:
        """An integer of 0, 1, ..., ``bound`` - 1, all equally likely.

        Source: D. Lemire, Fast Random Integer Generation in an Interval, ACM TOMACS 29, 2019.
        """
        if bound > 1 << 64:
            # A value of many words at a time, until one lies below the bound.
            words = (bound.bit_length() + 63) // 64
            while True:
                value = 0
                for _ in range(words):
                    value = value << 64 | self.word()
                value >>= 64 * words - bound.bit_length()
                if value < bound:
                    return value
        product = self.word() * bound
        low = product & 0xFFFF_FFFF_FFFF_FFFF
        if low < bound:
            refused = (1 << 64) % bound
            while low < refused:
                product = self.word() * bound
                low = product & 0xFFFF_FFFF_FFFF_FFFF
        return product >> 64

    def _words(self, count: int) -> np.ndarray[Any, np.dtype[np.uint64]]:
        """The next words, as an array."""
        ahead = [self.word() for _ in range(min(count, len(self._ahead)))]
        return np.append(np.array(ahead, np.uint64), self._bits.random_raw(count - len(ahead)))

    def _many_below(self, bound: int, count: int) -> np.ndarray[Any, np.dtype[np.uint64]]:
        """As many values of ``below``, for a bound of at most 32 bits; many times as fast."""
        found = np.empty(0, np.uint64)
        while len(found) < count:
            words, factor, half = self._words(count - len(found)), np.uint64(bound), np.uint64(32)
            high = ((words >> half) * factor + ((words & np.uint64(0xFFFF_FFFF)) * factor >> half)) >> half
            found = np.append(found, high[words * factor >= np.uint64((1 << 64) % bound)])
        return found

    def bytes(self, length: int) -> bytes:
        """As many random bytes."""
        words = b"".join(self.word().to_bytes(8, "little") for _ in range(-(-length // 8)))
        return words[:length]

    # -- numbers ---------------------------------------------------------------------------------------------------

    def random(self, size: Size = None) -> Any:
        """Uniform in [0, 1), a multiple of 2^-53."""
        if size is None:
            return (self.word() >> 11) * _STEP
        shape = _shape(size)
        return (self._words(math.prod(shape)) >> np.uint64(11)).reshape(shape) * _STEP

    def integers(
        self,
        low: ArrayLike,
        high: ArrayLike | None = None,
        size: Size = None,
        dtype: Any = np.int64,
        endpoint: bool = False,
    ) -> Any:
        """Integers from ``low`` up to, but not including, ``high`` (with ``endpoint`` including it); or from 0."""
        low, high = (0, low) if high is None else (low, high)
        if size is not None and isinstance(low, int) and isinstance(high, int) and 0 < high - low + endpoint < 1 << 32:
            shape = _shape(size)
            drawn = self._many_below(high - low + endpoint, math.prod(shape)).astype(dtype)
            return drawn.reshape(shape) + np.asarray(low, dtype)

        def draw(low: int, high: int) -> int:
            count = int(high) - int(low) + endpoint
            if count <= 0:
                raise ValueError(f"there is no integer from {low} to {high}{'' if endpoint else ' (excluded)'}")
            return int(low) + self.below(count)

        return self._drawn(draw, size, low, high, dtype=dtype)

    def weighted(self, sums: Sequence[float]) -> int:
        """An index with a probability in proportion to its weight; ``sums`` are the cumulated weights."""
        return choices.weighted(self, sums)

    def choice(self, a: Any, size: Size = None, replace: bool = True, p: ArrayLike | None = None) -> Any:
        """One of the elements of ``a``, or of 0 ... ``a`` - 1; with weights ``p``; several with ``size``."""
        items = np.arange(a) if isinstance(a, (int, np.integer)) else a
        count = len(items)
        if not count:
            raise ValueError("the choice is empty: give at least one element")
        weights = None if p is None else np.asarray(p, float).ravel().tolist()
        if weights is not None and len(weights) != count:
            raise ValueError(f"{len(weights)} weights for {count} elements; give one for each")
        sums = None if weights is None else choices.cumulated(weights)
        if size is None:
            return items[self.below(count) if sums is None else choices.weighted(self, sums)]
        shape = _shape(size)
        wanted = math.prod(shape)
        if not replace:
            draws = choices.without_replacement(self, count, wanted, weights)
        else:
            draws = [self.below(count) if sums is None else choices.weighted(self, sums) for _ in range(wanted)]
        chosen = np.asarray(items)[np.array(draws, np.int64)]
        return chosen.reshape(*shape, *chosen.shape[1:])

    def shuffle(self, x: MutableSequence[Any] | np.ndarray[Any, Any]) -> None:
        """Put a list or the rows of an array into random order, in place."""
        if isinstance(x, np.ndarray):
            x[...] = x[self.permutation(len(x))]
            return
        for last in range(len(x) - 1, 0, -1):
            other = self.below(last + 1)
            x[last], x[other] = x[other], x[last]

    def permutation(self, x: Any) -> Any:
        """The numbers 0 ... ``x`` - 1, or the elements of a sequence, in random order, as an array."""
        if not isinstance(x, (int, np.integer)):
            items = np.asarray(x)
            return items[self.permutation(len(items))]
        order = list(range(x))
        self.shuffle(order)
        return np.array(order, np.int64)

    # -- vectors -------------------------------------------------------------------------------------------------------

    def multinomial(self, n: int, pvals: ArrayLike, size: Size = None) -> Any:
        """How often each outcome comes in ``n`` trials with these probabilities; the last outcome takes the rest."""
        weights = np.asarray(pvals, float).ravel().tolist()
        return self._vectors(lambda: choices.multinomial(self, n, weights), len(weights), size, np.int64)

    def dirichlet(self, alpha: ArrayLike, size: Size = None) -> Any:
        """Shares that add up to 1, with concentrations ``alpha``."""
        shapes = np.asarray(alpha, float).ravel().tolist()
        return self._vectors(lambda: choices.dirichlet(self, shapes), len(shapes), size, float)

    def multivariate_normal(self, mean: ArrayLike, cov: ArrayLike, size: Size = None) -> Any:
        """A normal vector with this mean and covariance (symmetric, positive semidefinite)."""
        means, root = np.asarray(mean, float).tolist(), choices.square_root(np.asarray(cov, float).tolist())
        return self._vectors(lambda: choices.multivariate_normal(self, means, root), len(means), size, float)

    # -- shapes --------------------------------------------------------------------------------------------------------

    def _drawn(self, draw: Callable[..., Any], size: Size, *parameters: ArrayLike, dtype: Any = float) -> Any:
        """One value of ``draw`` for each element of the parameters, broadcast to ``size``."""
        if size is None and _PLAIN.issuperset(map(type, parameters)):
            return draw(*parameters)
        arrays = [np.asarray(each) for each in parameters]
        shape = np.broadcast_shapes(*(each.shape for each in arrays)) if size is None else _shape(size)
        columns = [np.broadcast_to(each, shape).ravel().tolist() for each in arrays]
        if size is None and not shape:
            return draw(*(column[0] for column in columns))
        values = map(draw, *columns) if columns else (draw() for _ in range(math.prod(shape)))
        return np.array(list(values), dtype).reshape(shape)

    def _vectors(self, draw: Callable[[], Sequence[Any]], length: int, size: Size, dtype: Any) -> Any:
        shape = _shape(size)
        return np.array([draw() for _ in range(math.prod(shape))], dtype).reshape(*shape, length)


def _method(law: Callable[..., Any]) -> Callable[..., Any]:
    """The method of a stream that draws from a law: its parameters may be arrays, and ``size`` requests an array."""
    own = inspect.signature(law)
    first, *parameters = own.parameters.values()
    size = inspect.Parameter("size", inspect.Parameter.POSITIONAL_OR_KEYWORD, default=None)
    signature = own.replace(parameters=[first.replace(name="self"), *parameters, size])
    dtype = np.int64 if own.return_annotation == "int" else float
    most = len(parameters)

    @functools.wraps(law)
    def draw(self: RandomStream, *values: Any, **named: Any) -> Any:
        if not named and len(values) <= most:
            for value in values:
                if type(value) not in _PLAIN:
                    break
            else:
                return law(self, *values)
        given = signature.bind(self, *values, **named)
        given.apply_defaults()
        return self._drawn(functools.partial(law, self), given.args[-1], *given.args[1:-1], dtype=dtype)

    draw.__signature__ = signature  # type: ignore[attr-defined]
    return draw


for _law in laws.OF_ONE_VALUE:
    setattr(RandomStream, _law.__name__, _method(_law))


def _shape(size: Size) -> tuple[int, ...]:
    return () if size is None else (int(size),) if isinstance(size, (int, np.integer)) else tuple(size)


if TYPE_CHECKING:

    class Stream(np.random.Generator):
        """A ``RandomStream``, whose methods have the types of NumPy's."""

        state: tuple[int, int]

        def word(self) -> int: ...
        def below(self, bound: int) -> int: ...
        def weighted(self, sums: Sequence[float]) -> int: ...

else:
    Stream = RandomStream


def random_stream(seed: int, path: str, purpose: str = "") -> Stream:
    """The stream of one purpose of one actor or aspect in one run."""
    digest = hashlib.sha256(f"{path}\0{purpose}".encode()).digest()
    # As SeedSequence(seed, spawn_key=...) puts them together itself, in three times the time.
    size = max(16, -(-seed.bit_length() // 32) * 4)
    words = np.frombuffer(seed.to_bytes(size, "little") + digest[:16], "<u4")
    return cast(Stream, RandomStream(np.random.PCG64(np.random.SeedSequence(words))))


class Streams:
    """The random streams of a run."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._made: list[tuple[RandomStream, str, str]] = []

    def of(self, path: str, purpose: str = "") -> Stream:
        """A new stream for one purpose of one actor or aspect."""
        stream = random_stream(self._seed, path, purpose)
        self._made.append((cast(RandomStream, stream), path, purpose))
        return stream

    def reseed(self, seed: int) -> None:
        """From now on all streams, those that are still to be made too, are those of a run with another seed."""
        self._seed = seed
        for stream, path, purpose in self._made:
            other = cast(RandomStream, random_stream(seed, path, purpose))
            stream._bits, stream._ahead = other._bits, other._ahead
