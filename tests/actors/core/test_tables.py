"""Tables of others: what is wrong in one is an ``OSError`` with the reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.actors import read_table


def test_a_name_of_a_column_that_is_no_text(tmp_path: Path) -> None:
    file = tmp_path / "signal.csv"
    file.write_bytes(b"time,\x9avalue\n0,1\n")
    with pytest.raises(OSError, match="invalid start byte") as caught:
        read_table(file)
    assert caught.value.strerror == "'utf-8' codec can't decode byte 0x9a in position 0: invalid start byte"
    assert caught.value.filename == str(file)
