"""The command line.  Nothing heavy is imported before a command needs it, so ``--help`` answers at once."""

from __future__ import annotations

import argparse
import json
import logging
import sys
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .model import Model

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code: 0 done, 1 the run failed, 2 bad input."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    options = parser().parse_args(given)
    command: Callable[[argparse.Namespace, list[str]], int] = options.command
    from epicycle.actors import EpicycleError

    from .engine import ActorError, LoopError

    try:
        return command(options, given)
    except (ActorError, LoopError) as error:
        complain(f"error: {error}")
        return FAILED
    except EpicycleError as error:
        text = str(error)
        complain(text if ": error: " in text or text.startswith("error: ") else f"error: {text}")
        return BAD_INPUT
    except BrokenPipeError:
        # Whoever read our output has gone; point stdout elsewhere so that Python's own flush stays quiet.
        sys.stdout = None
        return FAILED
    except OSError as error:
        complain(f"error: {error}")
        return FAILED
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED


def parser() -> argparse.ArgumentParser:
    """The options of all commands."""
    top = argparse.ArgumentParser(
        prog="epicycle", description="Discrete-event simulation of actor models that are written in YAML."
    )
    commands = top.add_subparsers(required=True, metavar="COMMAND")

    run = commands.add_parser("run", help="run a model", description="Run a model once and report what came of it.")
    add_model(run)
    run.add_argument("--seed", type=seed, metavar="N", help="seed of all random streams (default: the model's)")
    run.add_argument("--until", metavar="TIME", help="stop time, such as 30 or '500 ms' (default: the model's)")
    run.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        help="folder for manifest, signals and figures (default: results/MODEL; with --json: none)",
    )
    run.add_argument("--log", metavar="FILE", type=Path, help="write the event log to FILE (.parquet, .csv or .jsonl)")
    run.add_argument("--json", action="store_true", help="print one JSON object instead of the table")
    run.set_defaults(command=run_command)

    validate = commands.add_parser("validate", help="check a model", description="Check a model without running it.")
    add_model(validate)
    validate.set_defaults(command=validate_command)

    models = commands.add_parser("models", help="list the packaged models")
    models.set_defaults(command=models_command)
    return top


def add_model(command: argparse.ArgumentParser) -> None:
    """The options that say which model is meant, and what to change in it."""
    command.add_argument("model", metavar="MODEL", help="a path to a YAML file, or the name of a packaged model")
    command.add_argument(
        "--set",
        metavar="PATH=VALUE",
        action="append",
        default=[],
        help="set a parameter, such as observers=3 or 'observer[*].sensor.max_range=5 m'; may be repeated",
    )
    command.add_argument(
        "--aspect",
        metavar="NAME=TYPE,KEY=VALUE,...",
        action="append",
        default=[],
        help="add an aspect, or put it in the place of the one of that name; may be repeated",
    )
    command.add_argument(
        "--without", metavar="NAME", action="append", default=[], help="remove an aspect; may be repeated"
    )


def seed(text: str) -> int:
    """A seed: a whole number from 0 on."""
    number = int(text) if text.isdecimal() else -1
    if not 0 <= number < 2**64:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 to 2**64 - 1")
    return number


def load(options: argparse.Namespace) -> tuple[Model, dict[str, Any]]:
    """The model that the options describe, and its figures."""
    from .model import Problems, load_model
    from .show import figures_of

    model = load_model(options.model, set=options.set, aspects=options.aspect, without_aspects=options.without)
    problems = Problems()
    figures = figures_of(model, problems)
    problems.raise_if_any()
    return model, figures


def run_command(options: argparse.Namespace, given: list[str]) -> int:
    """``epicycle run``."""
    from epicycle.actors import EpicycleError, convert

    from .engine import ActorError, LoopError, Simulation, check_log_path, write_log
    from .show import summary_object, summary_table, write_folder

    if options.log is not None:
        check_log_path(options.log)
    until = None
    if options.until is not None:
        until = float(convert(options.until, "s"))
        if not 0.0 <= until < 1e9:
            raise EpicycleError(f"--until {options.until}: expected a time from 0 s to 1e9 s")
    model, figures = load(options)
    folder = options.out or (None if options.json else Path("results") / model.name)
    if folder is not None and folder.exists() and not folder.is_dir():
        raise EpicycleError(f"--out {folder} is a file, not a folder")
    simulation = Simulation(model, seed=options.seed, keep_log=options.log is not None)
    with progress(model, until) as report:
        try:
            results = simulation.run(until=until, progress=report)
        except (ActorError, LoopError) as error:
            results = simulation.results("failed")
            if options.log is not None:
                write_log(simulation.log.records, options.log)
            if folder is not None:
                write_folder(folder, results, {}, ["epicycle", *given], str(error))
                complain(f"what was recorded until then is in {folder}")
            raise
    if options.log is not None:
        write_log(simulation.log.records, options.log)
    written = [] if folder is None else write_folder(folder, results, figures, ["epicycle", *given])
    if options.json:
        print(json.dumps(summary_object(results)))
        return DONE
    from rich.console import Console

    # Piped output has no width of its own; the default of 80 would fold the table.
    console = Console() if sys.stdout.isatty() else Console(width=120)
    console.print(summary_table(model, results))
    for path in written:
        console.print(f"wrote {path}", highlight=False, markup=False)
    return DONE


def validate_command(options: argparse.Namespace, given: list[str]) -> int:
    """``epicycle validate``."""
    model, _ = load(options)
    wires = sum(1 for _ in model.graph.wires())
    print(f"{options.model} is valid: {len(model.graph.actors)} actors, {wires} wires, {len(model.aspects)} aspects")
    return DONE


def models_command(options: argparse.Namespace, given: list[str]) -> int:
    """``epicycle models``."""
    from .model import load_model, packaged_models

    for name, path in packaged_models().items():
        doc = load_model(path).doc
        first, _, _ = doc.partition(". ")
        print(f"{name}: {first}" if doc else name)
    return DONE


@contextmanager
def progress(model: Model, until: float | None) -> Iterator[Callable[[float], None] | None]:
    """A bar on a terminal's standard error, and notices of what takes long."""
    from rich.console import Console
    from rich.logging import RichHandler
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    notices = logging.getLogger("epicycle")
    handler = RichHandler(console=console, show_time=False, show_level=False, show_path=False)
    notices.addHandler(handler)
    notices.setLevel(logging.INFO)
    try:
        if not console.is_terminal:
            yield None
            return
        end = until if until is not None else None if model.stop is None else model.stop / 1e9
        text = TextColumn("{task.description} {task.completed:.1f} s of model time")
        with Progress(text, BarColumn(), TimeElapsedColumn(), console=console, transient=True) as bar:
            task = bar.add_task(model.name, total=end)
            yield lambda now: bar.update(task, completed=now)
    finally:
        notices.removeHandler(handler)


def complain(text: str) -> None:
    """Say what went wrong."""
    print(text, file=sys.stderr)


if __name__ == "__main__":
    raise SystemExit(main())
