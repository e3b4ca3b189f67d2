"""repeat one run of a study"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import complain, console, tell
from .options import DONE, FAILED, complain_of

DESCRIPTION = "Repeat one run of a study alone, with its event log, all recorded signals and figures."


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle replay``."""
    command.add_argument("folder", metavar="DIR", type=Path, help="the results folder of the study")
    command.add_argument("run_key", metavar="RUN", help="the run's name in the column 'run', or its beginning")
    command.add_argument("--out", metavar="DIR", type=Path, help="where to write (default: DIR/replays/RUN)")


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Repeat the run, and compare its digest."""
    from ..build import figures_of
    from ..results import write_log
    from ..show import check_folder, draw_figures, summary_table, write_folder
    from ..study import again, open_study, plan_of_folder
    from ..text import Problems

    row = open_study(options.folder).find(options.run_key)
    plan = plan_of_folder(options.folder)
    folder = options.out or options.folder / "replays" / row["run"][:12]
    model, results, simulation, error = again(plan, plan.condition(row["condition"]), row["seed"])
    figures = {} if error is not None else figures_of(model, Problems())
    if replaced := check_folder(folder, model.name, ["epicycle", *given]):
        complain(replaced)
    written = write_folder(folder, results, ["epicycle", *given], "" if error is None else str(error))
    written.append(folder / "log.parquet")
    write_log(simulation.log.records, written[-1])
    drawn, failed = draw_figures(folder, results, figures)
    console().print(summary_table(model, results))
    for path in [*drawn, *written]:
        tell(f"wrote {path}")
    if error is not None or failed:
        return complain_of([*([error] if error is not None else []), *failed], options)
    if row["digest"] is not None and row["digest"] != results.digest:
        complain(f"error: the digest is {results.digest}, but was {row['digest']}: something has changed since")
        return FAILED
    tell(f"digest {results.digest}" + (": the same" if row["digest"] is not None else ""))
    return DONE
