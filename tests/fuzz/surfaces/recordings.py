"""Recordings and traces: CSV, Parquet and MCAP with accidents, and with columns that hold anything."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from epicycle.runner.interface.cli import main
from tests.fuzz.surfaces.case import MODEL, Case, Surface, chosen, spoiled, write
from tests.fuzz.surfaces.expressions import PIECES

TRACE = "time,lost,delay,sequence\n" + "".join(
    f"{each},{each % 3 == 1:d},{'' if each % 3 == 1 else 0.1 + each % 5 / 10},{each}\n" for each in range(40)
)
TOPICS = "time,topic,value\n" + "".join(f"{each / 10},/scale/input,{each}\n" for each in range(40))
SIGNAL = "time,value\n" + "".join(f"{each},{2 * each}\n" for each in range(8))
_CELLS = ("", "nan", "inf", "-inf", "-1", "1e400", "1e-400", "true", "a", '"', "'", "99999999999999999999", "0x1",
    "1;2",
          "\x00", "=cmd()", "1e9", "1e18", "9" * 5_000, *PIECES)  # fmt: skip


def _prepare(home: Path) -> None:
    import pandas

    write(home, "m.yaml", MODEL)
    for name, text in (("trace", TRACE), ("topics", TOPICS), ("signal", SIGNAL)):
        file = write(home, f"{name}.csv", text)
        pandas.read_csv(file).to_parquet(home / f"{name}.parquet")
    main(["view", str(home / "m.yaml"), "-o", str(home / "page.html"), "--mcap", str(home / "topics.mcap")])


def _make(random: np.random.Generator, home: Path, folder: Path) -> Case:
    kind = str(chosen(random, ("trace", "topics", "signal")))
    ends = (".csv", ".csv", ".parquet", ".mcap") if kind == "topics" else (".csv", ".csv", ".parquet")
    file = folder / f"{kind}{chosen(random, ends)}"
    data = (home / file.name).read_bytes()
    if file.suffix == ".csv" and random.random() < 0.6:
        lines = [line.split(",") for line in data.decode().splitlines()]
        for _ in range(int(random.integers(1, 4))):
            line = chosen(random, lines)
            line[int(random.integers(len(line)))] = str(chosen(random, _CELLS))
        file.write_text("\n".join(map(",".join, lines)) + "\n", encoding="utf-8", errors="backslashreplace")
    else:
        file.write_bytes(spoiled(data, random))
    if kind == "trace":
        return Case(("recording", "fit", file, "-o", folder / "fitted.yaml"))
    if kind == "topics":
        options = ("--with", "wifi_burst", "--at", "/scale/input", "-o", folder / f"out{file.suffix}")
        return Case(("recording", "apply", file, *options))
    vary = ("--vary", "size=1..3", "--out", folder / "out")
    return Case(("calibrate", home / "m.yaml", "--match", f"scale.output={file}", *vary))


SURFACE = Surface("recordings", _prepare, _make)
