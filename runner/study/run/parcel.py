"""A parcel: a plan with all files that it reads, for machines without access to this file system.

There, a Dask worker passes the runs to its own processes, and ends those that hang.
"""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import platform
import threading
import weakref
import zlib
from collections.abc import Mapping
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ...model.catalogue.code import code_of
from ...model.text.files import noting
from ...model.text.problems import ModelError
from ...support.apart import Outcome, UnwantedError, WorkerError
from ..plan.plan import Plan
from ..provenance import version_of, versions
from .backlog import Task
from .processes import Processes
from .runner import Runner
from .store import Row

SENT = (
    "   help: files named by a path relative to the study or the model are sent along; packages must be installed there"
)
_CODE = ("epicycle.actors", "epicycle.aspects", "epicycle.runner")
_SOURCES = (".py", ".pyx", ".pxd")  # including those of compiled modules
_NO_MATTER = ("pyarrow",)  # workers write no files
_OPTIONAL = ("casadi",)  # takes part in runs, where installed


def pack(plan: Plan) -> bytes:
    """A checked plan with its files.

    Each file is listed under the names by which it may be requested: as it was read, and with links resolved.
    """
    files: dict[str, bytes] = {}
    for name in (*plan.files, *code_of(plan.study.types)):
        path = Path(os.path.abspath(name))
        content = path.read_bytes()
        for each in (path, path.parent.resolve() / path.name, path.resolve()):
            files[str(each)] = content
    manifest = {**plan.manifest(), "model": {}}
    found = {"manifest": manifest, "files": files, "folder": os.getcwd(), "environment": environment()}
    return zlib.compress(pickle.dumps(found), 1)


def unpack(parcel: bytes, root: Path) -> tuple[dict[str, Any], str, str]:
    """Unpack the files of a parcel below a folder, as they were below the root of their machine.

    Returns what a ``ParcelWorker`` is made of: the manifest, the folder, and what is the working directory in it.
    Raises ``WorkerError`` on a machine where a seed may give a different run.
    """
    found: dict[str, Any] = pickle.loads(zlib.decompress(parcel))
    if unlike := mismatch(environment(), found["environment"]):
        raise WorkerError(unlike)
    manifest = found["manifest"]
    for name, content in found["files"].items():
        path = below(root, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    study, folder = below(root, manifest["file"]), below(root, found["folder"])
    for each in (study.parent, folder):  # a name may pass through them
        each.mkdir(parents=True, exist_ok=True)
    types = [str(below(root, name)) for name in manifest["types"]]
    return manifest | {"file": str(study), "types": types}, str(root), str(folder)


def below(root: Path, name: str) -> Path:
    """The new place of a file that was below the root of a file system, or of a drive."""
    path = Path(name)
    return root.joinpath(path.drive.rstrip(":"), *path.parts[1:]) if path.anchor else root / path


# -- who may take part ------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def environment() -> dict[str, str | None]:
    """What must be the same wherever a seed should give the same run."""
    found = {name: each for name, each in versions().items() if name not in _NO_MATTER}
    found |= {name: version_of(name) for name in _OPTIONAL}
    found["python"] = ".".join(platform.python_version_tuple()[:2])
    found["code"] = _code()
    return found


def mismatch(worker: Mapping[str, str | None], client: Mapping[str, str | None]) -> str:
    """What is wrong with a worker that differs from the machine that employs it, to follow its name; or empty."""
    told = [
        f"{name} {worker.get(name) or 'is missing'} there, {wanted or 'none'} here"
        for name, wanted in client.items()
        if name != "code" and wanted != worker.get(name)
    ]
    if not told and worker.get("code") != client["code"]:
        told = ["the code of Epicycle differs"]
    if not told:
        return ""
    return (
        f"differs from this machine: {'; '.join(told)}\n"
        "   help: the same seed must give the same run, so install the same versions there"
    )


def _code() -> str:
    """A hash of Epicycle's code: during development, the version says little."""
    digest = hashlib.sha256()
    for package in _CODE:
        for folder in map(Path, import_module(package).__path__):
            sources = [path for path in folder.rglob("*") if path.suffix in _SOURCES]
            for path in sorted(sources, key=lambda path: path.relative_to(folder).parts):
                digest.update(f"{package}/{path.relative_to(folder).as_posix()}\n".encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()


# -- on a worker ------------------------------------------------------------------------------------------------------


class ParcelWorker:
    """Makes runs of a plan whose files are elsewhere than in the study's place.

    The working directory becomes that of the study, so that names of files in ``--set`` mean the same.
    """

    def __init__(self, manifest: Mapping[str, Any], root: str, folder: str) -> None:
        self._root = root
        os.chdir(folder)
        try:
            self._runner = Runner.of_manifest(manifest)
        except ModelError as error:
            raise WorkerError(
                f"cannot read the study, although this machine can:\n{self._named(str(error))}\n{SENT}"
            ) from error

    def prepare(self, task: Task) -> None:
        """Load the model; raises ``WorkerError`` if this reads other contents than in the study's place."""
        with noting() as noted:
            self._runner.prepare(task)
        if noted.files and (unlike := self._runner.plan.unlike(noted)):
            raise WorkerError(f"has another version of {self._named(unlike[0])} than this machine\n{SENT}")

    def make(self, task: Task) -> tuple[Row, str | None]:
        """The row of a run; and why its model could not be loaded, if it could not."""
        why_not = self._runner.why_not(task)
        row = self._runner.make(task)
        if row["error"] is not None:
            row["error"] = self._named(row["error"])
        return row, None if why_not is None else self._named(why_not)

    def _named(self, text: str) -> str:
        """A text with the names of files as they are in the study's place."""
        return text.replace(self._root, "")


class ParcelOnWorker:
    """A parcel as a value that Dask keeps on workers while a study wants it; called with runs, it makes them there.

    Its processes end when Dask drops it: when the study is over, or whoever ran it is gone.
    """

    def __init__(self, parcel: bytes) -> None:
        self._parcel = parcel
        self._guard = threading.Lock()
        self._processes: Processes | None = None

    def __reduce__(self) -> tuple[type[ParcelOnWorker], tuple[bytes]]:
        return ParcelOnWorker, (self._parcel,)

    def __call__(self, batch: str) -> list[Outcome]:
        """Make runs; raises ``WorkerError`` if this worker cannot.

        It takes and returns plain values, which a scheduler without Epicycle can pass on.
        """
        from distributed import get_worker

        worker = get_worker()
        key = worker.get_current_task()

        def is_wanted() -> bool:
            state = worker.state.tasks.get(key)
            return state is not None and state.state not in ("cancelled", "released")

        given = json.loads(batch)
        try:
            with self._guard:
                if self._processes is None:
                    self._folder = TemporaryDirectory(prefix="epicycle-", dir=worker.local_directory)
                    root = Path(self._folder.name).resolve()
                    self._processes = Processes(ParcelWorker, *unpack(self._parcel, root))
                    weakref.finalize(self, self._processes.end)
            return [self._processes.make(Task(*each), given["timeout"], is_wanted) for each in given["tasks"]]
        except UnwantedError:
            return []  # nobody will read it
        except WorkerError as error:
            raise WorkerError(f"the Dask worker {worker.address} {error}") from None
