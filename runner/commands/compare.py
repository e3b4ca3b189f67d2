"""compare variants of a model"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..printing import complain, tell, tell_json
from .options import (
    CHANGES,
    COUNT,
    DISTURB,
    DONE,
    FAILED,
    JOBS,
    SEED,
    UNTIL,
    check_path,
    command,
    option,
    own_types,
    several,
)

if TYPE_CHECKING:
    from ..calls import Changes


@command(
    "compare variants of a model in pairs of runs",
    option("model", metavar="MODEL", help="a path to a YAML file, or the name of a packaged model"),
    several(
        "--disturb",
        metavar="NAME or FILE",
        help="add a variant with this disturbance, a packaged one or a YAML file; 'none' is the unchanged model; "
        "may be repeated",
    ),
    several(
        "--vary",
        metavar="PATH=VALUE,...",
        help="add a variant with this parameter, such as load=0.9, or several: load=0.9,servers=2; may be repeated",
    ),
    *(each for each in CHANGES if each is not DISTURB),
    option("--replications", type=COUNT, metavar="N", default=10, help="runs of each variant (default: 10)"),
    SEED,
    UNTIL,
    JOBS,
    option("--json", action="store_true", help="print one JSON object instead of the table"),
    option(
        "-o",
        "--out",
        metavar="FILE",
        type=Path,
        help="write a page that shows the first runs of the first two variants side by side",
    ),
    imports=("calls.comparing",),
)
def compare(options: argparse.Namespace) -> int:
    """Run variants of a model with the same seeds and compare their metrics with those of the first variant: the mean
    difference over pairs of runs, its 95 % interval, and the p-value of Student's paired test, corrected by Holm's
    method.  A single variant is compared with the unchanged model."""
    from dataclasses import asdict

    from ..calls import Away, compared, load, recorded, seconds
    from ..language.settings import parse_settings
    from ..shown import finite
    from ..study import available_cores
    from ..text.problems import Problems

    common: Changes = {
        "set": options.set,
        "overrides": options.overrides,
        "aspects": options.aspect,
        "without_aspects": options.without,
    }
    if options.max_actors is not None:
        common["max_actors"] = options.max_actors
    variants: dict[str, Changes] = {
        name: common if name == "none" else {**common, "disturb": name} for name in options.disturb
    }
    problems = Problems()
    varied = {each: parse_settings(each, problems, "--vary") for each in options.vary}
    problems.raise_if_any()
    variants |= {each: {**common, "set": [*options.set, *settings]} for each, settings in varied.items()}
    if len(variants) == 1:
        variants = {"none": common, **variants}
    if options.out is not None:
        check_path("--out", options.out)
    types = own_types(options)
    changed: dict[str, Changes] = {name: {**changes, "types": types} for name, changes in variants.items()}
    models = {name: load(options.model, **changes) for name, changes in changed.items()}
    jobs = min(options.jobs or available_cores(), len(models) * options.replications)
    away = None if jobs == 1 else Away(options.model, variants, jobs, [Path(file) for file in options.types])
    found = compared(models, options.replications, options.seed, options.until, away=away)
    if options.json:
        told = {"model": found.model, "seeds": list(found.seeds), "units": found.units}
        tell_json(finite({**told, "differences": [asdict(each) for each in found.differences()]}))
    else:
        tell(str(found))
    if options.out is not None:
        until, names = seconds("--until", options.until), list(models)[:2]
        page = recorded([models[name] for name in names], seed=found.seeds[0], until=until, names=names)
        page.save(options.out)
        if not options.json:
            tell(f"wrote {options.out}")
        for error in page.errors:
            if isinstance(error, KeyboardInterrupt):  # failures are reported below
                raise error
    for (name, seed), error in found.failures.items():
        complain(f"error: {name}, seed {seed}: {error}")
    return FAILED if found.failures else DONE
