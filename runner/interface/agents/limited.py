"""Commands run for an agent: in a process of their own, with limits of time, memory and output, in one folder."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from epicycle.actors import FOLDERS

from ...model.catalogue.packaged import model_folders

_TEXT = "model.yaml"  # the name in messages of a model that came as a text


class ToolError(Exception):
    """The message that an agent gets instead of a result."""


@dataclass(frozen=True)
class Limits:
    """How long a command may take (s), and how large its memory, a file, its arguments and an answer may be (bytes)."""

    seconds: float = 60.0
    memory: int = 4 << 30
    file: int = 64 << 20
    argument: int = 100_000
    answer: int = 400_000


class LimitedCall:
    """Runs commands in ``folder``; ``types`` are the files of types that the one who started the server has named."""

    def __init__(self, folder: Path, types: Sequence[str] = (), limits: Limits | None = None) -> None:
        self.folder = folder.resolve()
        self.types = [f"--types={Path(each).resolve()}" for each in types]
        self.limits = limits or Limits()

    def call(
        self, command: str, names: Sequence[str], *options: str, good: Sequence[int] = (0,), file: str = ""
    ) -> bytes:
        """What a command prints as JSON, or a file that it writes with ``-o``; raises ``ToolError``."""
        with tempfile.TemporaryDirectory(prefix="epicycle-") as out:
            named = [self._named(each, out, number) for number, each in enumerate(names)]
            asked = [each.replace("{out}", f"{out}/found") for each in options]
            asked.append(f"-o={out}/{file}" if file else "--json")
            words = [sys.executable, "-P", "-m", "epicycle", command, *asked, *self.types, "--", *named]
            if sum(map(len, words)) > self.limits.argument or not all(map(_is_text, words)):
                raise ToolError(f"the arguments have more than {self.limits.argument:,} characters, or are no text")
            code, told, complained = self._run(words, out)
            if code not in good or not told:
                raise ToolError((complained or told)[: self.limits.answer] or f"the command ended with {code}")
            if file:
                return Path(out, file).read_bytes()
        if len(told) > self.limits.answer:
            raise ToolError(
                f"the answer has {len(told):,} characters, more than {self.limits.answer:,}: "
                "ask for less, or of a smaller model"
            )
        return told.encode()

    def _named(self, name: str, out: str, number: int) -> str:
        """A model as the command line names it: a packaged one or type, a file in the folder, or a text."""
        if len(name) > self.limits.argument:
            raise ToolError(f"a model may have {self.limits.argument:,} characters, and this one has {len(name):,}")
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
        readable: list[str | Path] = [
            self.folder,
            out,
            *model_folders(),
            *(each.partition("=")[2] for each in self.types),
        ]
        folders = os.pathsep.join(str(Path(each).resolve()) for each in readable)
        with streams[0].open("wb") as told, streams[1].open("wb") as complained:
            process = subprocess.Popen(
                words,
                cwd=self.folder,
                stdin=subprocess.DEVNULL,
                stdout=told,
                stderr=complained,
                env={**os.environ, FOLDERS: folders, "NO_COLOR": "1", "COLUMNS": "120"},
                start_new_session=True,
            )
            self._bound(process.pid)
            try:
                code = process.wait(self.limits.seconds)
            except subprocess.TimeoutExpired:
                raise ToolError(
                    f"it was ended after {self.limits.seconds:g} s: give an earlier 'until', fewer runs or a smaller "
                    "model"
                ) from None
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
        if code < 0:
            raise ToolError(
                f"it was ended by {signal.Signals(-code).name}: it may have needed too much memory or output"
            )
        said, wrong = (each.read_text("utf-8", errors="replace").replace(f"{out}/", "").strip() for each in streams)
        return code, said, wrong

    def _bound(self, process: int) -> None:
        if sys.platform == "linux":
            import resource

            for what, most in ((resource.RLIMIT_AS, self.limits.memory), (resource.RLIMIT_FSIZE, self.limits.file)):
                resource.prlimit(process, what, (most, most))


def _is_text(word: str) -> bool:
    """Whether a process can be given a word."""
    try:
        return b"\0" not in word.encode()
    except UnicodeEncodeError:  # half of a pair
        return False
