"""``make portable``: is every digest the same under settings that stand for other machines and other versions?

Each setting is a process of its own that computes all of ``digests``; the result is compared with ``golden.json``,
which is in the repository, and what tutorials print with what they print under the first setting.  ``--golden`` writes
that file anew, from the first setting.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from .digests import SMALL, parts, tutorials

ROOT = Path(__file__).parents[2]
GOLDEN = Path(__file__).with_name("golden.json")
OLD = ("numpy==2.0.2", "scipy==1.13.1")  # beside whatever is installed; an older NumPy needs an older pyarrow
NO_FMA = "glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA,-FMA4"


@dataclass(frozen=True)
class Setting:
    """A machine, as far as a process can be told to be on another one."""

    name: str
    variables: dict[str, str] = field(default_factory=dict)
    command: tuple[str, ...] = ()  # that runs Python
    parts: tuple[str, ...] = ()  # all of them if empty


def numpy_features() -> str:
    """What NumPy would choose from when it runs; a processor that has none of it is an old one."""
    try:
        from numpy._core._multiarray_umath import __cpu_dispatch__
    except ImportError:  # NumPy 1
        from numpy.core._multiarray_umath import __cpu_dispatch__
    return " ".join(__cpu_dispatch__)


def threads(count: int) -> dict[str, str]:
    """So many threads for whoever uses threads."""
    return dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), str(count))


def old_libraries() -> dict[str, str]:
    """BLAS, libm and NumPy as on an old processor."""
    return {"OPENBLAS_CORETYPE": "Prescott", "GLIBC_TUNABLES": NO_FMA, "NPY_DISABLE_CPU_FEATURES": numpy_features()}


def settings() -> list[Setting]:
    """Those that make a difference on this kind of machine, the plain one first."""
    found = [
        Setting("as it is"),
        Setting("hash seed 1, one thread", {"PYTHONHASHSEED": "1", **threads(1)}),
        Setting("hash seed 77, two threads, Tokyo", {"PYTHONHASHSEED": "77", **threads(2), "TZ": "Asia/Tokyo"}),
        Setting("NumPy's plain loops", {"NPY_DISABLE_CPU_FEATURES": numpy_features()}),
        Setting("kernels for any processor", {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}),
        Setting("kernels not compiled", {"NUMBA_DISABLE_JIT": "1"}),
        Setting("the core in Python", {"EPICYCLE_CORE": "python"}),
        Setting("native forms off", {"EPICYCLE_FORMS": "off"}),
    ]  # fmt: skip
    if platform.machine() in ("x86_64", "AMD64"):
        flags = set(Path("/proc/cpuinfo").read_text().split()) if Path("/proc/cpuinfo").exists() else set()
        found += [
            Setting("BLAS of a Prescott", {"OPENBLAS_CORETYPE": "Prescott"}),
            Setting("BLAS of a Nehalem", {"OPENBLAS_CORETYPE": "Nehalem"}),
            Setting("libm without AVX2 and FMA", {"GLIBC_TUNABLES": NO_FMA}),
            Setting("kernels of a Nehalem", {"NUMBA_CPU_NAME": "nehalem", "NUMBA_CPU_FEATURES": ""}),
            Setting("all of the old at once", {**old_libraries(), "NUMBA_CPU_NAME": "core2", "NUMBA_CPU_FEATURES": ""}),
        ]  # fmt: skip
        if {"avx2", "fma"} <= flags:
            found += [
                Setting("BLAS of a Haswell", {"OPENBLAS_CORETYPE": "Haswell"}),
                Setting("BLAS of a Zen", {"OPENBLAS_CORETYPE": "Zen"}),
                Setting("kernels of a Haswell", {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx2,+fma"}),
            ]
        if "avx512f" in flags:
            found.append(Setting("BLAS of a Skylake-X", {"OPENBLAS_CORETYPE": "SkylakeX"}))
        if emulator := shutil.which("qemu-x86_64") or shutil.which("qemu-x86_64-static"):
            found.append(Setting("an emulated Nehalem", {}, (emulator, "-cpu", "Nehalem"), SMALL))
    return found


def older_packages(folder: Path) -> Setting | None:
    """The oldest versions of NumPy and SciPy that are supported; None where they cannot be installed."""
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        "--no-deps",
        "--target",
    ]
    if subprocess.run([*command, str(folder), *OLD], check=False, capture_output=True).returncode:
        return None
    return Setting(", ".join(OLD).replace("==", " "), {"PYTHONPATH": str(folder)})


def outcome(setting: Setting, cache: str = "") -> tuple[dict[str, str], str, float]:
    """The digests under a setting, what went wrong if anything did, and how long it took.

    ``cache`` is a folder for compiled kernels; numba tells apart there what it has compiled for different processors.
    """
    before = time.monotonic()
    done = subprocess.run(
        [*setting.command, sys.executable, "-W", "ignore", "-m", "tests.portable.digests", *setting.parts],
        check=False,
        cwd=ROOT,
        env={**os.environ, **({"NUMBA_CACHE_DIR": cache} if cache else {}), **setting.variables},
        capture_output=True,
        text=True,
    )
    found = dict(json.loads(line) for line in done.stdout.splitlines() if line.startswith("["))
    wrong = done.stderr.strip().splitlines()[-1] if done.returncode and done.stderr.strip() else ""
    return found, wrong or (f"exit code {done.returncode}" if done.returncode else ""), time.monotonic() - before


def differences(found: dict[str, str], wanted: dict[str, str]) -> list[str]:
    """The parts whose digests are others than they should be."""
    return [name for name, digest in found.items() if digest != wanted.get(name)]


def main() -> int:
    """Compare all settings, print a line for each; 1 if one of them differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--golden", action="store_true", help="write golden.json anew")
    if parser.parse_args().golden:
        found, wrong, _ = outcome(Setting("as it is"))
        if wrong:
            print(wrong)
            return 1
        kept = {name: digest for name, digest in found.items() if name not in tutorials()}
        GOLDEN.write_text(json.dumps(kept, indent=2) + "\n")
        return 0
    wanted, bad = json.loads(GOLDEN.read_text()), 0
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        cache = f"{folder}/kernels"
        older = older_packages(Path(folder, "older"))
        chosen = [*settings(), *([older] if older else [])]
        print(f"{len(parts())} digests of functions, laws, models, studies and tutorials; {len(chosen)} settings")
        for setting, (found, wrong, seconds) in zip(
            chosen, pool.map(outcome, chosen, [cache] * len(chosen)), strict=True
        ):
            if setting is chosen[0]:  # pages are reworded now and then, and tests compare them with what they print
                wanted |= {name: found[name] for name in found.keys() & tutorials().keys()}
            others = differences(found, wanted)
            missing = len(setting.parts or parts()) - len(found)
            said = (
                wrong
                or (f"{missing} missing" if missing else "")
                or ("differ: " + ", ".join(others) if others else "same")
            )
            bad += said != "same"
            print(f"{setting.name:36} {len(found):3} digests  {seconds:4.0f} s  {said}", flush=True)
        if older is None:
            print(f"not tried: {', '.join(OLD)} cannot be installed here")
        if not any(setting.command for setting in chosen):
            print("not tried: an emulated processor (install qemu-user)")
    print(
        "every digest is that of tests/portable/golden.json, and tutorials print the same"
        if not bad
        else f"{bad} settings differ"
    )
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
