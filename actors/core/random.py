"""Random streams: one per (seed, dotted path, purpose), whatever the order in which they are asked for.

The key of a stream is a hash of its names, so adding, removing or reordering actors and aspects moves no other
stream, and neither ``PYTHONHASHSEED`` nor the worker count can.
"""

from __future__ import annotations

import hashlib

import numpy as np


def random_stream(seed: int, path: str, purpose: str = "") -> np.random.Generator:
    """The generator that belongs to one purpose of one actor or aspect in one run."""
    digest = hashlib.sha256(f"{path}\0{purpose}".encode()).digest()
    key = tuple(int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
