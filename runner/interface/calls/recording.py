"""What was recorded outside of runs: channels fitted to a trace, and recordings that pass a disturbance."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from ...support.declare.checked import checked
from ...support.declare.parameters import COUNT, argument, option, repeated
from .changes import TYPES, seed

if TYPE_CHECKING:
    from ...model.language.settings import Setting
    from ...recorded.channel import Fit
    from ...recorded.passing import Disturbed


@checked
def fit(
    trace: Annotated[str | Path, argument("a .csv or .parquet file with a row for each message", "TRACE")],
    *,
    at: Annotated[
        str | Iterable[str],
        repeated("ports, or a pattern, that the disturbance attaches to (default: all)", "PORTS"),
    ] = "**",
    time: Annotated[str | None, option("column of the times of sending, in s (default: time)", "COLUMN")] = None,
    lost: Annotated[str | None, option("column that says whether a message was lost (default: lost)", "COLUMN")] = None,
    received: Annotated[
        str | None, option("column that says whether it arrived, in place of --lost (default: received)", "COLUMN")
    ] = None,
    delay: Annotated[str | None, option("column of delays (default: delay)", "COLUMN")] = None,
    sequence: Annotated[
        str | None,
        option("column of sequence numbers: messages whose numbers are missing were lost", "COLUMN"),
    ] = None,
    wraps: Annotated[
        int | None, option("how many sequence numbers there are before they start again", "N", COUNT)
    ] = None,
    delay_unit: Annotated[
        Literal["s", "ms", "us", "ns"], option("unit of the delays", choices=("s", "ms", "us", "ns"))
    ] = "s",
) -> Fit:
    """Fit models of losses and delays to a measured trace.

    Models of losses (independent, Gilbert, Gilbert-Elliott) and laws of delays (exponential, gamma, with and without a
    shift) are fitted by maximum likelihood, with tests of how well they fit.  Those with the least BIC, marked *, go
    into a disturbance file.

    >>> epicycle.fit("link.csv", at="*.peer_plan").save("fitted.yaml")
    """
    from epicycle.aspects import TraceFile

    from ...recorded.channel import Fit

    columns = {
        "time": time,
        "lost": lost,
        "received": received,
        "delay": delay,
        "sequence": sequence,
        "wraps": wraps,
    }
    given = {name: value for name, value in columns.items() if value is not None}
    file = TraceFile(file=trace, delay_unit=delay_unit, **given)
    return Fit.of(file.file, file.read(), at)


@checked
def disturb(
    recording: Annotated[str | Path, argument("an .mcap file, or a .csv file: time, topic, value", "RECORDING")],
    disturbance: Annotated[
        str | Path | Iterable[str | Path],
        repeated("a packaged disturbance or a YAML file", "NAME or FILE", flag="--with"),
    ],
    out: Annotated[str | Path, option("the new recording, of the same kind", "FILE", Path, flag="-o --out")],
    *,
    at: Annotated[
        str | Iterable[str],
        repeated(
            "a topic, or a pattern such as '/robot*/plan', to which the aspects attach in place of the ports that the "
            "disturbance names",
            "TOPICS",
        ),
    ] = (),
    set: Annotated[
        Iterable[str | Setting] | Mapping[str, object],
        repeated("set a parameter of the disturbance", "NAME=VALUE"),
    ] = (),
    seed: Annotated[int, option("seed of all random streams", "N", seed)] = 0,
    types: Annotated[Iterable[type | str | Path], TYPES] = (),
) -> Disturbed:
    """Apply a disturbance to recorded data.

    The messages of a recording pass the aspects of the disturbance that lose, delay or alter them, and those that
    arrive are written.  The topic /robot/plan is the port robot.plan.  Other aspects are left out.  Equal arguments
    give equal files.

    >>> epicycle.disturb("recording.mcap", "wifi_burst", "out.mcap", at="/robot*/plan", seed=3)
    """
    from ...recorded.passing import pass_recording
    from .changes import classes

    disturbances = [disturbance] if isinstance(disturbance, (str, Path)) else disturbance
    patterns = [at] if isinstance(at, str) else at
    source, target = Path(recording), Path(out)
    return pass_recording(source, target, disturbances, at=patterns, set=set, seed=seed, types=classes(types))
