"""The folders at the root install as one package, completely, once, and import one way."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import textwrap
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

from epicycle.actors.compiled import LIBRARIES
from epicycle.runner.model.catalogue.metrics import TAKES
from tests.plugins import ABSENT
from tests.shipped import CODE_FOLDERS, FOLDERS, ROOT, place_of, shipped_files

# What is declared, without the plug-ins whose folders are missing.
DECLARED = "".join(
    line
    for line in (ROOT / "pyproject.toml").read_text("utf-8").splitlines(keepends=True)
    if not any(f"epicycle.{name}" in line for name in ABSENT)
)
CONFIG = tomllib.loads(DECLARED)
PACKAGES = CONFIG["tool"]["setuptools"]["packages"]
TYPINGS = ROOT / "tests" / "typings"


MODELS = sorted(file.as_posix() for file in shipped_files() if file.suffix == ".yaml" and file.parts[0] == "models")

WHERE = f"""
    import importlib, json, sysconfig
    from pathlib import Path
    folders = []
    for name in {FOLDERS[:-1]!r}:
        folders += map(Path, importlib.import_module(f"epicycle.{{name}}").__path__)
    home = folders[2]
    models = sorted(f"models/{{file.relative_to(home).as_posix()}}" for file in home.rglob("*.yaml"))
    site = sysconfig.get_path("purelib")
    print(json.dumps({{"site": site, "folders": [str(folder) for folder in folders], "models": models}}))
"""


def test_packages_equal_the_tree() -> None:
    on_disk = {".".join(("epicycle", *place_of(file).parent.parts)) for file in shipped_files()}
    assert sorted(PACKAGES) == sorted(on_disk)


def test_every_folder_with_code_has_an_init() -> None:
    code = {file.parent for file in shipped_files() if file.suffix == ".py"}
    without = [folder.as_posix() for folder in sorted(code) if not (ROOT / folder / "__init__.py").is_file()]
    assert without == []


def test_models_hold_yaml_and_its_schema_only() -> None:
    models = [file for file in shipped_files() if file.parts[0] == "models"]
    assert [file.as_posix() for file in models if file.suffix != ".yaml"] == [
        "models/__init__.py",
        "models/schema.json",
    ]


@pytest.mark.parametrize("folder", [each for each in CODE_FOLDERS if each not in ABSENT])
def test_folder_is_typed_and_says_what_it_offers(folder: str) -> None:
    assert (ROOT / folder / "py.typed").is_file()
    body = ast.parse((ROOT / folder / "__init__.py").read_text("utf-8")).body
    assigned = {
        ast.unparse(target)
        for node in body
        if isinstance(node, ast.Assign | ast.AnnAssign)
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
    }
    assert "__all__" in assigned


def test_mypy_redirects_equal_the_tree() -> None:
    code = {file.parent for file in shipped_files() if file.name == "__init__.py"} - {Path("api")}
    expected = {
        "epicycle/__init__.pyi": "from api import *\n",
        "epicycle/aspects/testing.pyi": "from aspects.testing import *\n",  # a module that the runner imports
    }
    for folder in code:
        redirect = f"from {'.'.join(folder.parts)} import *\n"
        expected[f"epicycle/{folder.as_posix()}/__init__.pyi"] = redirect
    for node in ast.parse(Path("api/__init__.pyi").read_text("utf-8")).body:  # the modules that the face names
        module = getattr(node, "module", "") or ""
        if Path(*module.split(".")[1:]) not in code and module:
            name = module.removeprefix("epicycle.")
            expected[f"epicycle/{name.replace('.', '/')}.pyi"] = f"from {name} import *\n"
    stubs = (TYPINGS / "epicycle").rglob("*.pyi")
    found = {stub.relative_to(TYPINGS).as_posix(): stub.read_text("utf-8") for stub in stubs}
    found = {name: text for name, text in found.items() if not name.startswith(tuple(f"epicycle/{n}/" for n in ABSENT))}
    assert found == expected


def test_models_are_found_here_too(busy_folder: Path) -> None:
    found = json.loads(run_in(busy_folder, sys.executable, "-c", textwrap.dedent(WHERE)))
    assert found["models"] == MODELS


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel from a copy, without a download and without leaving a build folder behind."""
    source = tmp_path_factory.mktemp("source")
    for folder in FOLDERS:
        built_here = shutil.ignore_patterns("__pycache__", "*.so", "*.pyd", "built")
        shutil.copytree(ROOT / folder, source / folder, ignore=built_here)
    for name in ("setup.py", "LICENSE", "README.md"):
        if (ROOT / name).is_file():
            shutil.copy(ROOT / name, source)
    (source / "pyproject.toml").write_text(DECLARED, "utf-8")
    target = tmp_path_factory.mktemp("wheel")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EPICYCLE_BUILD", "all")
        pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", target, source)
    (built,) = target.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the scripts folder of a fresh environment that holds the wheel and borrows our dependencies.

    A .pth line lends the packages of this environment but, unlike a site folder, does not run the .pth files
    among them: the editable install of the folders at the root stays invisible.
    """
    home = tmp_path_factory.mktemp("environment")
    venv.create(home, symlinks=os.name != "nt")
    at = {"base": str(home), "platbase": str(home)}
    scripts = Path(sysconfig.get_path("scripts", "venv", at))
    pip("--python", scripts / "python", "install", "--no-deps", "--no-index", wheel)
    ours = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    lent = Path(sysconfig.get_path("purelib", "venv", at)) / "lent.pth"
    lent.write_text("\n".join(sorted(ours)) + "\n", "utf-8")
    return scripts


@pytest.fixture
def busy_folder(tmp_path: Path) -> Path:
    """Return a folder whose own actors, models and so on must not get in the way."""
    for folder in FOLDERS:
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "__init__.py").write_text(f"raise ImportError('the wrong {folder}')\n", "utf-8")
    return tmp_path


PROGRAM = """
import epicycle
from epicycle.actors import Actor, Clock, Exponential, InputPort, OutputPort, Parameter, PoissonClock, PortParameter
from epicycle.actors import Random
from epicycle.aspects import JoinPoint, MeasurementAspect, PacketLoss
from epicycle.runner import Model, Results, Simulation


class Gain(Actor):
    input = InputPort(float)
    output = OutputPort(float)
    factor = Parameter(float, 1.0)
    limit = Parameter(int, None)
    offset = PortParameter(float, None)

    def fire(self) -> None:
        for token in self.input.tokens:
            self.output.send(self.factor * token)


class Twice(MeasurementAspect):
    def pass_token(self, token: float, point: JoinPoint) -> None:
        point.forward(2 * token)


model = Model("gain", stop="1 min", like="epicycle")
clock = model.add(PoissonClock("clock", mean_interval="1 s"))
numbers = model.add(Random("numbers", distribution=Exponential(mean=2)))
gain = model.add(Gain("gain", factor=2.0))
model.connect(clock.output, numbers.trigger)
model.connect(numbers.output, gain.input)
model.weave("twice", Twice(), at=gain.output)
model.weave("loss", PacketLoss(probability=0.1, from_="3 s"), at=gain.input)
model.metric("greatest", of=gain.output, take="max", after=1.0)
results: Results = Simulation(model).run()
again: Results = epicycle.run("mm1", seed=3, set={"load": 0.9}, until="1 h")
epicycle.plot(again, "wait").save("wait.svg")
print(epicycle.compare("mm1", {"a": {}, "b": {"set": {"load": 0.5}}}).differences()[0].p)
print(epicycle.study("waiting_time", replications=3).means("mean_wait"))
"""
REVEALED = """
reveal_type(gain.factor)
reveal_type(gain.input.value)
gain.output.send("text")
Clock("clock", perriod="1 s")
PacketLoss(probabilty=0.1)
Random("numbers", distribution=Exponential(mean=2, seed=1))
model.metric("greatest", of=gain.output, take="maximum")
model.metric("greatest", of=gain.output, take="max", afer=1.0)
epicycle.run("mm1", sed=3)
reveal_type(gain.limit)
reveal_type(Gain.limit)
reveal_type(gain.offset)
"""


def types_of_a_program(folder: Path, python: object, program: str) -> str:
    """What mypy says of a user's program, written in a folder of its own."""
    (folder / "program.py").write_text(program, "utf-8")
    words = [sys.executable, "-m", "mypy", "--strict", "--python-executable", str(python), "program.py"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    assert done.stderr == ""
    return done.stdout


SUCCESS = "Success: no issues found in 1 source file\n"
EXPECTED_TYPES = f"""\
program.py:41: note: Revealed type is "float"
program.py:42: note: Revealed type is "float"
program.py:43: error: Argument 1 to "send" of "OutputPort" has incompatible type "str"; expected "float"  [arg-type]
program.py:44: error: Unexpected keyword argument "perriod" for "Clock"; did you mean "period"?  [call-arg]
program.py:44: note: "Clock" defined in "epicycle.actors.constructors"
program.py:45: error: Unexpected keyword argument "probabilty" for "PacketLoss"; did you mean "probability"?  [call-arg]
program.py:45: note: "PacketLoss" defined in "epicycle.aspects.constructors"
program.py:46: error: Unexpected keyword argument "seed" for "Exponential"  [call-arg]
program.py:46: note: "Exponential" defined in "epicycle.actors.constructors"
program.py:47: error: Argument "take" to "metric" of "Model" has incompatible type "Literal['maximum']"; \
expected "Literal[{", ".join(map(repr, TAKES))}]"  [arg-type]
program.py:48: error: Unexpected keyword argument "afer" for "metric" of "Model"; did you mean "after"?  [call-arg]
program.py:48: note: "metric" defined in "epicycle.runner.model.build.model"
program.py:49: error: Unexpected keyword argument "sed" for "run"; did you mean "seed"?  [call-arg]
program.py:49: note: "run" defined in "epicycle.runner.interface.calls.running"
program.py:50: note: Revealed type is "int | None"
program.py:51: note: Revealed type is "epicycle.actors.core.parameter.Parameter[int | None]"
program.py:52: note: Revealed type is "float | None"
Found 7 errors in 1 file (checked 1 source file)
"""


@pytest.mark.slow
def test_mypy_finds_the_types_of_what_make_installs(tmp_path: Path) -> None:
    if not Path(sys.prefix, "linked").exists():
        pytest.skip("this environment was not made by make")
    assert types_of_a_program(tmp_path, sys.executable, PROGRAM) == SUCCESS
    assert types_of_a_program(tmp_path, sys.executable, PROGRAM + REVEALED) == EXPECTED_TYPES


@pytest.mark.slow
def test_mypy_finds_the_types_of_the_wheel(wheel: Path, tmp_path: Path) -> None:
    venv.create(tmp_path / "environment", symlinks=os.name != "nt")
    at = {"base": str(tmp_path / "environment"), "platbase": str(tmp_path / "environment")}
    python = Path(sysconfig.get_path("scripts", "venv", at)) / "python"
    pip("--python", python, "install", "--no-deps", "--no-index", wheel)
    assert types_of_a_program(tmp_path, python, PROGRAM) == SUCCESS
    assert types_of_a_program(tmp_path, python, PROGRAM + REVEALED) == EXPECTED_TYPES


def pip(*arguments: object) -> None:
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def run_in(folder: Path, *command: object) -> str:
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    words = [str(part) for part in command]
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("folder", ["tests", "benchmarks"])
def test_what_is_shared_is_imported_from_the_root(folder: str) -> None:
    """Two files of one name would be mixed up if each changed where modules are found."""
    change = re.compile(r"sys\.path(\.[a-z]|\[|\s*\+?=[^=])")
    own = {
        ROOT / "tests/mutation/trial.py",
        ROOT / "tests/fuzz/hostile.py",
    }  # tries copies; brings plugins, and undoes it
    files = [file for file in (ROOT / folder).rglob("*.py") if file not in own]
    assert len(files) > 10
    assert [file.name for file in files if change.search(file.read_text(encoding="utf-8"))] == []


@pytest.mark.skipif(shutil.which("make") is None, reason="there is no make")
def test_make_clean_removes_all_that_is_compiled(tmp_path: Path) -> None:
    sources = [
        "actors/core/tag.py",
        "actors/core/order.pyx",
        "results/run/manifest.json",
        "models/mm1.yaml",
        "tests/a.py",
    ]
    made = [
        "actors/core/tag.cpython-311.so",
        "aspects/gone.pyd",
        "runner/execution/engine/way.so",
        "actors/built/manifest.json",
    ]
    for name in (*sources, *made, "runner/__pycache__/cli.pyc", "build/core/tag.c"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    run_in(tmp_path, "make", "-s", "-f", ROOT / "Makefile", "clean")
    left = [path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()]
    assert sorted(left) == sorted(sources)


@pytest.mark.slow
def test_wheel_holds_every_file_and_no_other(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        found = [name for name in archive.namelist() if ".dist-info/" not in name]
    core = {Path(name).name.partition(".")[0] for name in found if name.startswith("epicycle/actors/built/")}
    rest = [name for name in found if not name.startswith("epicycle/actors/built/")]
    assert sorted(rest) == sorted(f"epicycle/{place_of(file).as_posix()}" for file in shipped_files())
    # All of the compiled core or, where there is no compiler, nothing of it.
    assert core in ({*LIBRARIES, "manifest"}, set())


@pytest.mark.slow
def test_wheel_finds_its_own_modules_and_models(installed: Path, busy_folder: Path) -> None:
    found = json.loads(run_in(busy_folder, installed / "python", "-c", textwrap.dedent(WHERE)))
    home = Path(found["site"]) / "epicycle"
    assert [Path(folder) for folder in found["folders"]] == [home / folder for folder in FOLDERS if folder != "api"]
    assert found["models"] == MODELS


@pytest.mark.slow
def test_wheel_runs_the_example_beside_folders_of_the_same_names(installed: Path, busy_folder: Path) -> None:
    run_in(busy_folder, installed / "epicycle", "run", "collision_avoidance", "--seed", "7", "--out", "out")
    assert (busy_folder / "out" / "manifest.json").is_file()
