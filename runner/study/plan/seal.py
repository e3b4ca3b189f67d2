"""Seals: how this user, on this machine, recognises what he has written."""

from __future__ import annotations

import hmac
import json
import os
import secrets
from contextlib import suppress
from pathlib import Path

from epicycle.actors import read_regular

_SIZE = 32  # bytes of a key


def seal(said: object) -> str | None:
    """The seal of plain data: nobody without this user's key can make it.  None if no key can be kept."""
    with suppress(FileExistsError, OSError, RuntimeError):
        _make_key(_path())
    key = _key()
    return None if key is None else _sealed(said, key)


def has_seal(said: object, found: object) -> bool:
    """Whether a seal of plain data was made by this user on this machine."""
    key = _key()
    return (
        key is not None and isinstance(found, str) and hmac.compare_digest(_sealed(said, key).encode(), found.encode())
    )


def _sealed(said: object, key: bytes) -> str:
    return hmac.digest(key, json.dumps(said, sort_keys=True).encode(), "sha256").hex()


def _path() -> Path:
    state = Path(os.environ.get("XDG_STATE_HOME") or "")
    return (state if state.is_absolute() else Path.home() / ".local" / "state") / "epicycle" / "key"


def _key() -> bytes | None:
    """The key, if there is one that others can neither read nor have given."""
    try:
        path = _path()
        about = path.stat()
        key = read_regular(path)
    except (OSError, RuntimeError):  # such as without a home
        return None
    is_ours = os.name != "posix" or (about.st_uid == os.getuid() and not about.st_mode & 0o077)
    return key if is_ours and len(key) == _SIZE else None


def _make_key(path: Path) -> None:
    """Make the key unless it is there; it appears all at once, so that two processes do not make two."""
    if path.exists():
        return
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    aside = path.with_name(f"key.{secrets.token_hex(8)}")
    with open(aside, "wb", opener=lambda name, flags: os.open(name, flags | os.O_EXCL, 0o600)) as file:
        file.write(secrets.token_bytes(_SIZE))
    try:
        os.link(aside, path)
    finally:
        aside.unlink()
