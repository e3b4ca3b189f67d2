"""compare variants of a model"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..printing import complain, tell, tell_json
from .options import CHANGES, COUNT, DISTURB, DONE, FAILED, SEED, command, option, own_types, several

if TYPE_CHECKING:
    from ..build import Model
    from ..calls import Changes


@command(
    "compare variants of a model in pairs of runs",
    option("model", metavar="MODEL", help="a path to a YAML file, or the name of a packaged model"),
    several(
        "--disturb",
        metavar="NAME or FILE",
        help="a variant with this disturbance, a packaged one or a YAML file; 'none' is the model as it is; repeat it",
    ),
    several("--vary", metavar="PATH=VALUE", help="a variant with this parameter, such as load=0.9; repeat it"),
    *(each for each in CHANGES if each is not DISTURB),
    option("--replications", type=COUNT, metavar="N", default=10, help="runs of each variant (default: 10)"),
    SEED,
    option("--until", metavar="TIME", help="stop time, such as 30 or '500 ms' (default: the model's)"),
    option("--json", action="store_true", help="print one JSON object instead of the table"),
    imports=("calls.comparing",),
)
def compare(options: argparse.Namespace) -> int:
    """Run variants of a model with the same seeds and compare their metrics with those of the first one: the mean
    difference over pairs of runs, its 95 % interval, and the p-value of Student's paired test, corrected by Holm's
    method. A single variant is compared with the model as it is."""
    from dataclasses import asdict

    from ..calls import compare
    from ..shown import finite

    common: Changes = {
        "set": options.set,
        "overrides": options.overrides,
        "aspects": options.aspect,
        "without_aspects": options.without,
        "types": own_types(options),
    }
    if options.max_actors is not None:
        common["max_actors"] = options.max_actors
    variants: dict[str, Model | Changes] = {
        name: common if name == "none" else {**common, "disturb": name} for name in options.disturb
    }
    variants |= {each: {**common, "set": [*options.set, each]} for each in options.vary}
    if len(variants) == 1:
        variants = {"none": common, **variants}
    found = compare(options.model, variants, replications=options.replications, seed=options.seed, until=options.until)
    if options.json:
        told = {"model": found.model, "seeds": list(found.seeds), "units": found.units}
        tell_json(finite({**told, "differences": [asdict(each) for each in found.differences()]}))
    else:
        tell(str(found))
    for (name, seed), error in found.failures.items():
        complain(f"error: {name}, seed {seed}: {error}")
    return FAILED if found.failures else DONE
