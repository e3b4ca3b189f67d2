"""apply a disturbance to recorded data"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import tell, tell_json
from .options import DONE, JSON, TYPES, check_path, command, option, own_types, seed, several


@command(
    "apply a disturbance to recorded data",
    option("recording", metavar="RECORDING", type=Path, help="an .mcap file, or a .csv file: time, topic, value"),
    several(
        "--with",
        metavar="NAME or FILE",
        dest="disturbances",
        required=True,
        help="a packaged disturbance or a YAML file; may be repeated",
    ),
    option("-o", "--out", metavar="FILE", type=Path, required=True, help="the new recording, of the same kind"),
    several(
        "--at",
        metavar="TOPICS",
        help="a topic, or a pattern such as '/robot*/plan', to which the aspects attach in place of the ports "
        "that the disturbance names; may be repeated",
    ),
    several("--set", metavar="NAME=VALUE", help="set a parameter of the disturbance; may be repeated"),
    option("--seed", type=seed, metavar="N", default=0, help="seed of all random streams (default: 0)"),
    TYPES,
    JSON,
    imports=("calls.disturbing",),
)
def disturb(options: argparse.Namespace) -> int:
    """Let the messages of a recording pass the aspects of a disturbance that lose, delay or alter them, and write those
    that arrive.  The topic /robot/plan is the port robot.plan.  Other aspects are left out."""
    from ..calls import disturb

    check_path("--out", options.out)
    found = disturb(
        options.recording,
        options.disturbances,
        options.out,
        at=options.at,
        set=options.set,
        seed=options.seed,
        types=own_types(options),
    )
    if options.json:
        tell_json(found.facts())
        return DONE
    tell(str(found))
    tell(f"wrote {options.out}")
    return DONE
