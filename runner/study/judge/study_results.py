"""The results of a study: its table, as Arrow, pandas or xarray."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, counted, did_you_mean, read_regular

from ...model.language.dimensions import Factor
from ...support.shown import in_words
from ...support.tables import Table, Tabled, pandas_module
from ..inference import LEVEL, holm, paired_difference, with_interval
from ..plan.columns import Column
from ..plan.plan import Plan
from ..run.backlog import OK
from ..run.manifest import StoreError
from ..run.store import BEST_FIRST, Store, parquet_of, write
from .claims import ClaimVerdict, Ranking, judge, ranked
from .guideline import Recommendation, recommend
from .samples import Samples
from .sensitivity import sensitivity

if TYPE_CHECKING:
    import pandas
    import pyarrow as pa
    import xarray

TIMES = ("wall_time",)  # differs from run to run


class StudyResults(Tabled):
    """The results folder of a study, finished or not.

    >>> results = open_study("results/mm1_load")
    >>> results.to_pandas().groupby("load")["mean_wait"].mean()
    """

    def __init__(self, folder: str | Path, types: Iterable[str | Path] = ()) -> None:
        self.folder = Path(folder)
        self._store = Store(self.folder)
        self.manifest = self._store.manifest
        self.plan = Plan.of_manifest(self.manifest)
        self.types = tuple(map(Path, types))  # whose code may run in place of that of the folder
        if self.types:
            self.plan = self.plan.allowed(self.types)
        self._frozen: tuple[pa.Table, int] | None = None

    def freeze(self) -> StudyResults:
        """Use only the rows that exist now, even if more are added; this makes reading faster.  Returns itself."""
        self._frozen = self._read()
        return self

    @property
    def factors(self) -> list[str]:
        """The columns of varied factors."""
        return list(self.manifest["factors"])

    @property
    def metrics(self) -> list[str]:
        """The columns of metrics."""
        return list(self.manifest["metrics"])

    def table(self, *, times: bool = False) -> pa.Table:
        """A row for each finished run, by condition and replication; with ``times``, including its wall-clock time.

        Without times, the table of a study is the same to the bit, whatever happened while it was made.  It includes
        replications beyond those that the study now asks for.  Runs of another seed, model or study than the folder now
        has are left out; ``left_out`` counts them.
        """
        table, _ = self._read()
        return table if times else table.drop_columns(list(TIMES))

    def _read(self) -> tuple[pa.Table, int]:
        """The table, and the number of runs left out of it."""
        import pyarrow as pa
        import pyarrow.compute as pc

        if self._frozen is not None:
            return self._frozen
        table = pa.Table.from_batches(list(self._store.rows()), self._store.schema)
        # The numbers of the plan's conditions by their keys; a plan may be too large to enumerate.
        known = table.group_by(["condition", *self.factors], use_threads=False).aggregate([]).to_pylist()
        order = {row["condition"]: self.plan.find(row["condition"], row) for row in known}
        at = pc.index_in(table["condition"], value_set=pa.array(order, pa.string()))
        places = pc.take(pa.array(order.values(), pa.int64()), at)
        ranks = pc.index_in(table["status"], value_set=pa.array(BEST_FIRST))
        runs = pc.count_distinct(table["run"]).as_py()
        table = _with(table, "condition", places).append_column("_rank", ranks)
        table = self._replicated(table.filter(pc.is_valid(places))).sort_by(
            [(name, "ascending") for name in ("condition", "replication", "_rank", "run")]
        )
        if table.num_rows:  # if a run was written more than once, its best row comes first
            changes = (
                pc.not_equal(table[name].slice(1), table[name].slice(0, table.num_rows - 1))
                for name in ("condition", "replication")
            )
            table = table.filter(pa.chunked_array([pa.array([True]), *pc.or_(*changes).chunks]))
        columns = {name: _described(column) for name, column in self.plan.columns.items()}
        fields = [each.with_metadata(columns.get(each.name, {})) for each in table.schema if each.name != "_rank"]
        left = runs - table.num_rows
        return table.drop_columns(["_rank"]).combine_chunks().cast(pa.schema(fields)), left

    def _replicated(self, table: pa.Table) -> pa.Table:
        """The rows with seeds of the plan, by the replications of these seeds in it."""
        import pyarrow as pa
        import pyarrow.compute as pc

        study, before = self.plan.study, table["replication"]
        if not study.paired:
            found = zip(table["condition"].to_pylist(), before.to_pylist(), strict=True)
            conditions = {index: self.plan.condition(index) for index in set(table["condition"].to_pylist())}
            seeds = [self.plan.seed(conditions[index], replication) for index, replication in found]
            return table.filter(pc.equal(table["seed"], pa.array(seeds, pa.int64())))
        # Another seed in the study's file shifts the replications; surplus ones are of this seed.
        now = pc.subtract(table["seed"], study.seed)
        is_meant = pc.or_(pc.less(now, self.plan.replications), pc.equal(now, before))
        return _with(table, "replication", now).filter(pc.and_(pc.greater_equal(now, 0), is_meant))

    def digest(self) -> str:
        """SHA-256 of all rows, which identifies a table: the same wherever and however often it is made."""
        digest = hashlib.sha256()
        for batch in self.table().to_batches():
            for row in batch.to_pylist():
                digest.update(json.dumps(row).encode())
        return digest.hexdigest()

    @property
    def left_out(self) -> int:
        """How many runs of the folder do not belong to the present study, and so are not in the table."""
        _, left = self._read()
        return left

    def beyond(self) -> int:
        """How many runs of the table are replications beyond those that the study now asks for."""
        if self.plan.search is not None:  # whose replications count its runs
            return 0
        return sum(each >= self.plan.replications for each in self.table()["replication"].to_pylist())

    def counts(self) -> Counter[str]:
        """How many runs are finished, by status."""
        return Counter(self.table()["status"].to_pylist())

    def failures(self) -> list[dict[str, Any]]:
        """The rows that are not ``ok``, each with the command that repeats its run."""
        return [
            {**row, "replay": f"epicycle run {self.folder / row['run'][:12]}"}
            for row in self.table().to_pylist()
            if row["status"] != OK
        ]

    def values(self, metric: str) -> dict[int, dict[int, float]]:
        """The numbers of a metric by condition and replication, without runs that are not ``ok`` or lack the metric."""
        self._check("metric", metric, self.metrics)
        samples = self._samples()
        return {condition: samples.numbers(condition, metric) for condition in samples.runs}

    def means(self, metric: str, level: float = LEVEL) -> list[dict[str, Any]]:
        """A row for each condition: the varied values, the mean with its standard error and interval, run counts.

        The interval of numbers is Student's; that of a metric that is true or false is Wilson's interval of the share.
        ``runs`` counts the finished runs, ``count`` those among them that have a number.
        """
        self._check("metric", metric, self.metrics)
        samples = self._samples()
        return [
            {
                **self.plan.condition(condition).values,
                **asdict(samples.average(condition, metric, level)),
                "runs": len(runs),
            }
            for condition, runs in samples.runs.items()
        ]

    def differences(self, metric: str, over: str, level: float = LEVEL) -> list[dict[str, Any]]:
        """How the levels of one factor differ, pair by pair, at every combination of the others.

        Each row has the other factors, the two levels as ``first`` and ``second``, the mean of second less first over
        common replications with its interval, the ``p`` of a paired test, and ``p_holm``, corrected for all rows.
        """
        self._check("factor", over, self.factors)
        groups: dict[tuple[Factor, ...], list[tuple[Factor, dict[int, float]]]] = {}
        others = [name for name in self.factors if name != over]
        for condition, numbers in self.values(metric).items():
            levels = self.plan.condition(condition).values
            groups.setdefault(tuple(levels[name] for name in others), []).append((levels[over], numbers))
        rows = []
        for place, members in groups.items():
            for (first, before), (second, after) in combinations(members, 2):
                found = paired_difference(before, after, level)
                pair = {"first": first, "second": second}
                rows.append({**dict(zip(others, place, strict=True)), **pair, **asdict(found.estimate), "p": found.p})
        corrected = holm([row["p"] for row in rows])
        return [{**row, "p_holm": p} for row, p in zip(rows, corrected, strict=True)]

    def _samples(self) -> Samples:
        return Samples(self.plan.study, self.table(), self.plan.shares)

    def _check(self, what: str, name: str, known: list[str]) -> None:
        if name not in known:
            told = f"{self.folder} has no {what} {name!r}{did_you_mean(name, known)}"
            raise StoreError(f"{told}; it has {', '.join(known) or 'none'}")

    def claims(self) -> list[ClaimVerdict]:
        """The verdicts on the claims of the study's file; those of another study at each level of what it lacks."""
        return judge(self._samples())

    def rankings(self) -> list[Ranking]:
        """The evidence for each level that claims are judged separately for, the best first."""
        return ranked(self.claims())

    def guideline(self) -> list[Recommendation]:
        """What the study's guideline recommends, at every combination of the factors that are not chosen."""
        return recommend(self._samples())

    def sensitivity(self, metric: str, level: float = LEVEL) -> list[dict[str, Any]]:
        """How much each parameter of a Sobol or Morris design matters: a row for each parameter and index.

        Each row has the other factors, ``factor``, ``index`` (``first_order`` and ``total``, or ``mu_star``, ``mu`` and
        ``sigma``), its ``value`` with standard error and interval, the ``count`` of blocks of the design behind it, and
        how many are ``missing``; with more than one in 20 missing, there is no value.
        """
        self._check("metric", metric, self.metrics)
        return [
            {**each.where, "factor": each.factor, "index": each.index, **asdict(each.estimate), "missing": each.missing}
            for each in sensitivity(self._samples(), metric, level)
        ]

    def find(self, run: str) -> dict[str, Any]:
        """The row of a run, by the beginning of its key; raises ``StoreError``."""
        found = [row for row in self.table().to_pylist() if row["run"].startswith(run)]
        if len(found) == 1:
            row: dict[str, Any] = found[0]
            return row
        if found:
            raise StoreError(f"{counted(len(found), 'run')} of {self.folder} begin with {run!r}: give more characters")
        raise StoreError(
            f"{self.folder} has no run {run!r}\n"
            f"   help: the column 'run' of {self.folder}/table.parquet lists their names"
        )

    def to_pandas(self) -> pandas.DataFrame:
        """The table as a data frame."""
        frame: pandas.DataFrame = pandas_module().DataFrame(self.table(times=True).to_pydict())
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """The metrics over the factors and the replication; needs the package xarray."""
        try:
            import xarray  # type: ignore[import-not-found, unused-ignore]
        except ImportError as error:
            raise EpicycleError("this needs xarray: pip install 'epicycle[xarray]'") from error
        frame = self.to_pandas().set_index([*self.factors, "replication"])[self.metrics]
        found: xarray.Dataset = xarray.Dataset.from_dataframe(frame)
        return found

    def _caption(self) -> str:
        counts, plan = self.counts(), self.plan
        told = ", ".join(f"{number:,} {status}" for status, number in sorted(counts.items())) or "none is over"
        most = "at most " if plan.study.until or plan.search else ""
        return f"{plan.study.name}: {counts.total():,} of {most}{counted(plan.size, 'run')} ({told}), in {self.folder}"

    def _tables(self) -> list[Table]:
        samples, columns = self._samples(), self.plan.columns
        rows = []
        for condition, runs in samples.runs.items():
            levels = (in_words(each) for each in self.plan.condition(condition).values.values())
            found = (samples.average(condition, name) for name in self.metrics)
            rows.append((*levels, *map(with_interval, found), str(len(runs))))
        units = {name: columns[name].unit for name in (*self.factors, *self.metrics)}
        names = (f"{name} ({unit})" if unit not in ("", "1") else name for name, unit in units.items())
        return [Table((*names, "runs"), rows)]

    @property
    def path(self) -> Path:
        """The path of the table."""
        return self.folder / "table.parquet"

    def write_table(self) -> Path:
        """Write ``table.parquet``."""
        write(self.path, parquet_of(self.table()))
        return self.path

    def is_written(self) -> bool:
        """Whether ``table.parquet`` has the bytes that ``write_table`` would write now, or another pyarrow might."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = self.table()
        ours = parquet_of(table)
        try:
            if (data := read_regular(self.path)) == ours:
                return True
            file = pq.ParquetFile(pa.BufferReader(data))
            is_of_another = file.metadata.created_by != pq.read_metadata(pa.BufferReader(ours)).created_by
            return is_of_another and bool(file.read().equals(table))
        except (OSError, ValueError, pa.ArrowException):  # ValueError: a text in it is not UTF-8
            return False


def _described(column: Column) -> dict[str, str]:
    """A column's metadata."""
    return {key: said for key in ("unit", "doc", "label") if (said := getattr(column, key))}


def _with(table: pa.Table, name: str, values: Any) -> pa.Table:
    """A table with different values in one of its columns."""
    return table.set_column(table.schema.get_field_index(name), name, values)


def open_study(folder: str | Path, types: Iterable[str | Path] = ()) -> StudyResults:
    """The results of a study, which may still be running; raises ``StoreError``.

    ``types`` are Python files to load the model with, in place of those that the folder names; the code of these runs
    only if you have made the folder yourself on this machine, and they have not changed.
    """
    return StudyResults(Path(folder), types)
