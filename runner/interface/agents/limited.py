"""Commands run for an agent: in a process of their own, with limits of time, memory and output, in one folder."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from mcp.server.mcpserver.exceptions import ToolError

from epicycle.actors import FOLDERS

from ...model.catalogue.packaged import model_folders

_TEXT = "model.yaml"  # the name in messages of a model that came as a text
_MEMORY, _FILE = 4 << 30, 64 << 20  # bytes that a command may take, and that a file of it may have
_ARGUMENTS, _ANSWER = 100_000, 400_000  # characters
_PROGRAM = (
    f"from epicycle.runner.support.apart import bound; bound({_MEMORY}, {_FILE})\n"
    "from runpy import run_module; run_module('epicycle', run_name='__main__')"
)


class LimitedCall:
    """Runs commands in ``folder``, each for so many ``seconds`` at most.

    ``types`` are the files of types that the one who started the server has named.
    """

    def __init__(self, folder: Path, types: Sequence[str | Path] = (), seconds: float = 60.0) -> None:
        self.folder = folder.resolve()
        self.types = [Path(each).resolve() for each in types]
        self.seconds = seconds

    def call(
        self, command: str, names: Sequence[str], *options: str, good: Sequence[int] = (0,), file: str = ""
    ) -> bytes:
        """What a command prints as JSON, or a file that it writes with ``-o``; raises ``ToolError``."""
        with tempfile.TemporaryDirectory(prefix="epicycle-") as out:
            named = [self._named(each, out, number) for number, each in enumerate(names)]
            asked = [each.replace("{out}", f"{out}/found") for each in options]
            asked.append(f"-o={out}/{file}" if file else "--json")
            asked += [f"--types={each}" for each in self.types]
            words = [sys.executable, "-P", "-c", _PROGRAM, command, *asked, "--", *named]
            if sum(map(len, words)) > _ARGUMENTS:
                raise ToolError(f"the arguments have more than {_ARGUMENTS:,} characters")
            code, told, complained = self._run(words, out)
            if code not in good or not told:
                raise ToolError((complained or told)[:_ANSWER] or f"the command ended with {code}")
            if file:
                return Path(out, file).read_bytes()
        if len(told) > _ANSWER:
            raise ToolError(
                f"the answer has {len(told):,} characters, more than {_ANSWER:,}: ask for less, or of a smaller model"
            )
        return told.encode()

    def _named(self, name: str, out: str, number: int) -> str:
        """A model as the command line names it: a packaged one or type, a file in the folder, or a text."""
        if len(name) > _ARGUMENTS:
            raise ToolError(f"a model may have {_ARGUMENTS:,} characters, and this one has {len(name):,}")
        if "\n" in name:
            path = Path(out, f"{number or ''}{_TEXT}")
            path.write_text(name, encoding="utf-8", errors="replace")
            return str(path)
        return self.inside(name)

    def inside(self, name: str) -> str:
        """The name of a file, if it is in the folder, or of what is packaged; raises ``ToolError``."""
        try:
            path = (self.folder / name).resolve()
            if name.replace("_", "").isalnum() and not path.exists():  # packaged, or a type
                return name
            is_there = path.is_relative_to(self.folder) and path.is_file()
        except (OSError, RuntimeError, ValueError):  # endless links, too long a name
            is_there = False
        if not is_there:
            raise ToolError(f"there is no file {name[:200]!r} in the folder of this server")
        return str(path.relative_to(self.folder))

    def _run(self, words: Sequence[str], out: str) -> tuple[int, str, str]:
        """The exit code of a command, and what it told and complained of."""
        streams = Path(out, ".stdout"), Path(out, ".stderr")
        readable = [str(each.resolve()) for each in (self.folder, Path(out), *model_folders(), *self.types)]
        with streams[0].open("wb") as told, streams[1].open("wb") as complained:
            try:
                code = subprocess.run(
                    words,
                    cwd=self.folder,
                    stdin=subprocess.DEVNULL,
                    stdout=told,
                    stderr=complained,
                    env={**os.environ, FOLDERS: os.pathsep.join(readable), "NO_COLOR": "1", "COLUMNS": "120"},
                    timeout=self.seconds,
                    check=False,
                    start_new_session=True,
                ).returncode
            except subprocess.TimeoutExpired:
                raise ToolError(
                    f"it was ended after {self.seconds:g} s: give an earlier 'until', fewer runs or a smaller model"
                ) from None
            except ValueError:  # a zero, or half of a pair
                raise ToolError("the arguments are no text") from None
        if code < 0:
            raise ToolError(
                f"it was ended by {signal.Signals(-code).name}: it may have needed too much memory or output"
            )
        said, wrong = (each.read_text("utf-8", errors="replace").replace(f"{out}/", "").strip() for each in streams)
        return code, said, wrong
