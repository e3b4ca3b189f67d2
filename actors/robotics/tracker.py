"""Tracks of several targets from the scans of all robots, by joint probabilistic data association."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..core import Actor, InputPort, OutputPort, Parameter, to_seconds
from .arrays import Array
from .estimator import EXPECTED, PREDICTED, TargetModel
from .history import History, Step
from .messages import Detections, Estimate, Tracks
from .receiving import PLANE, received
from .sensor_models import RANGE

_LIKELY = 0.5  # probability from which a track counts as in range, or a detection as new; share of expected detections


@dataclass(frozen=True, slots=True)
class _Record:
    """What is kept of a track besides its estimate."""

    origin: int  # a count of the tracks that have begun, also of those that a late scan has undone
    is_confirmed: bool = False
    hits: int = 0  # steps that detected it
    steps: int = 0  # steps that could have
    expected: float = 0.0  # detections at this step
    detected: float = 0.0  # probably
    sources: tuple[str, ...] = ()  # robots that detected it at this step


class _Picture(NamedTuple):
    """All tracks at one time, never modified; older ones come first."""

    means: Array  # (T, 4)
    covariances: Array  # (T, 4, 4)
    existence: Array  # (T,) how likely each exists
    records: tuple[_Record, ...]
    rough: int = 0  # probabilities so far that are not exact

    def only(self, kept: list[int]) -> _Picture:
        """The same with some of the tracks."""
        if len(kept) == len(self.records):
            return self
        records = tuple(self.records[place] for place in kept)
        return self._replace(
            means=self.means[kept], covariances=self.covariances[kept], existence=self.existence[kept], records=records
        )


class JPDATracker(TargetModel, Actor):
    """Tracks an unknown number of targets by joint probabilistic data association (JPDA) and the unscented filter.

    At each trigger the tracker predicts all tracks to the present and fuses the scans of all robots, one after the
    other, sorted by time and robot.  In a scan, a track causes at most one detection inside its ``gate``, and a
    detection has at most one cause.  A track becomes the mean over all such joint events, weighted by their
    probabilities.  These are exact in every cluster of tracks that share detections if 2^tracks (1 + detections) is at
    most 131,072.  A larger cluster is solved by Fitzgerald's formula, and its tracks are counted at ``approximated``.

    Each track exists with a probability, which is part of the association (JIPDA); if it is 1, this is JPDA.  It starts
    as the share of new targets in the detections that belong to no track.

    A relative position that probably belongs to no track starts a tentative track; a range cannot start one.  A step
    (all scans of one time) is a *hit* if it detects the track at least half as often as expected, and a *miss*
    otherwise.  Scans with the track probably out of range do not count.  A tentative track is confirmed when it has
    ``confirm_hits`` hits and exists with ``confirm_probability``.  It is dropped after more misses than
    ``confirm_steps`` allow.  A confirmed track is dropped when it exists with less than ``delete_probability``, or when
    its position is less certain than ``max_deviation``.  If two tracks are nearer to each other than
    ``merge_distance``, the younger is dropped.

    A late scan is inserted at its time, and the tracker runs again from there.  Later tracks are those of a tracker
    that received it in time, but maybe with other numbers: a track that was told keeps its number.  If the new run has
    not confirmed it, maybe because it began with another detection, its number goes to the nearest track without one
    that is within the ``gate`` during the next ``max_delay``.  Scans more than ``max_delay`` late are not fused but
    counted at ``too_late``.  A scan from the future, due to a wrong clock, counts as made now.  A copy has no effect.
    A scan that is not finite is ignored.
    """

    trigger = InputPort(object, doc="predict to the present time, fuse, and send the tracks")
    detections = InputPort(
        Detections, multi=True, required=False, triggers=False, doc="scans of all robots, including this one"
    )
    tracks = OutputPort(Tracks, doc="all confirmed tracks (x, y, vx, vy) after fusion")
    confirmed = OutputPort(int, doc="how many these are")
    too_late = OutputPort(int, doc="number of scans so far that came more than max_delay late; sent with each of them")
    approximated = OutputPort(
        int, doc="number of tracks so far that were in too large a cluster in a scan; sent when it has changed"
    )

    period = Parameter(float, 0.1, unit="s", above=0, doc="the time over which the process noise was measured")
    gate = Parameter(
        float, 16.0, unit="1", above=0, max=1e3,
        doc="squared Mahalanobis distance up to which a track may cause a detection; chi-square, with 2 degrees of "
        "freedom for a relative position: 16 is exceeded by 0.03 % of them",
    )  # fmt: skip
    birth_density = Parameter(
        float, 1e-5, above=0, max=1e6,
        doc="expected detections of targets without a track per m^2 (m for ranges) of a scan, besides the clutter",
    )  # fmt: skip
    birth_variance = Parameter(float, 4.0, unit="m^2/s^2", min=0, doc="variance of a new track's velocity")
    confirm_hits = Parameter(int, 3, min=1, doc="M: hits that confirm a track")
    confirm_steps = Parameter(int, 4, min=1, doc="N: among its first steps, the one that began it included")
    confirm_probability = Parameter(
        float, 0.99, unit="1", min=0, max=1, doc="how likely a target must exist for a confirmed track"
    )
    delete_probability = Parameter(
        float, 0.05, unit="1", min=0, max=1, doc="a confirmed track ends when it exists with less probability"
    )
    lifetime = Parameter(float, 30.0, unit="s", above=0, doc="mean time after which a target is gone")
    max_deviation = Parameter(
        float, 10.0, unit="m", above=0, doc="root mean square of the position's two deviations that ends a track"
    )
    merge_distance = Parameter(
        float, 1.0, unit="1", min=0,
        doc="squared Mahalanobis distance of two tracks, chi-square with 4 degrees of freedom, that makes them one",
    )  # fmt: skip
    max_tracks = Parameter(int, 64, min=1, max=1000, doc="number of tracks, tentative ones included, never exceeded")
    max_delay = Parameter(float, 2.0, unit="s", min=0, max=1e9, doc="largest age of a scan that is still fused")
    noise_direction = Parameter(
        str, EXPECTED, choices=(EXPECTED, PREDICTED),
        doc="the noise ellipse is averaged over the directions that the prediction allows, or turned along its mean",
    )  # fmt: skip

    def initialize(self) -> None:
        from .numerics import association, ukf
        from .numerics.warm_up import compile_tracking

        compile_tracking()
        self._kinds = {True: float(ukf.RANGE), False: float(ukf.RELATIVE_POSITION)}
        self._predict, self._fuse = association.predict_tracks, association.fuse_scan
        self._begin, self._duplicates = association.new_track, association.duplicates
        self._separations = association.separations
        self._noise = self.process_noise()
        self._averaged = self.noise_direction == EXPECTED
        self._rough = 0
        nothing = _Picture(np.empty((0, 4)), np.empty((0, 4, 4)), np.empty(0), ())
        self._history = History(nothing, _order, self.max_delay)
        self._begun = 0  # tracks so far
        self._given = 0  # numbers so far
        self._numbers: dict[int, int] = {}  # of the tracks that were told, by origin
        self._told_at: int | None = None
        self._undone: list[tuple[int, _Picture]] = []  # what was told of tracks that late scans have undone, and when

    def fire(self) -> None:
        now, history = self.tag.time, self._history
        if history.take([each for each in received(self.detections, PLANE) if each.finite], now):
            self.too_late.send(history.too_late)
        if not self.trigger.present:
            return
        picture, _ = history.run(now, self._advance)
        self._pass_on(now, picture)
        if history.forget(now):
            self._forget_numbers()
        if picture.rough != self._rough:
            self._rough = picture.rough
            self.approximated.send(self._rough)
        told = sorted((self._number_of(each), place) for place, each in enumerate(picture.records) if each.is_confirmed)
        self._told_at = now
        time = to_seconds(now)
        estimates = tuple(
            Estimate(picture.means[place], picture.covariances[place], time, picture.records[place].sources)
            for _, place in told
        )
        self.tracks.send(Tracks(tuple(number for number, _ in told), estimates, time))
        self.confirmed.send(len(told))

    # --- numbers ----------------------------------------------------------------------------------------

    def _number_of(self, record: _Record) -> int:
        """The number of a track, which it gets when it is first sent."""
        if record.origin not in self._numbers:
            self._given += 1
            self._numbers[record.origin] = self._given
        return self._numbers[record.origin]

    def _pass_on(self, now: int, present: _Picture) -> None:
        """Give the numbers of tracks that late scans have undone to the nearest tracks that have none."""
        there = {each.origin for each in present.records}
        for time, told in self._undone:
            lost = [at for at, each in enumerate(told.records) if each.origin in self._numbers.keys() - there]
            free = [at for at, each in enumerate(present.records) if each.origin not in self._numbers]
            if not lost or not free:
                continue
            then = self._predicted(told.only(lost), to_seconds(now - time))
            means = np.concatenate([then.means, present.means[free]])
            covariances = np.concatenate([then.covariances, present.covariances[free]])
            distances = self._separations(means, covariances, len(lost))
            for at in np.argsort(distances, axis=None, kind="stable").tolist():
                row, column = divmod(at, len(free))
                one, other = told.records[lost[row]].origin, present.records[free[column]].origin
                if distances[row, column] <= self.gate and one in self._numbers and other not in self._numbers:
                    self._numbers[other] = self._numbers.pop(one)

    def _forget_numbers(self) -> None:
        """Forget the numbers of tracks that no scan can bring back."""
        steps = self._history.steps
        self._undone = [each for each in self._undone if each[0] >= steps[0].time and each[1].records]
        pictures = [self._history.before, *(each.after for each in steps)]
        pictures.extend(told for _, told in self._undone)
        kept = {each.origin for picture in pictures for each in picture.records}
        self._numbers = {origin: number for origin, number in self._numbers.items() if origin in kept}

    # --- tracks -----------------------------------------------------------------------------------------

    def _advance(self, before: _Picture, elapsed: float, step: Step) -> tuple[_Picture, bool]:
        told = step.after if step.time == self._told_at else None
        picture = self._step(before, elapsed, step.data)
        if told is not None:
            sure = {each.origin for each in picture.records if each.is_confirmed}
            numbered = self._numbers.keys() - sure
            undone = [place for place, each in enumerate(told.records) if each.origin in numbered]
            if undone:
                self._undone.insert(0, (step.time, told.only(undone)))
        return picture, True

    def _step(self, picture: _Picture, elapsed: float, scans: list[Detections]) -> _Picture:
        """All tracks ``elapsed`` seconds later, after the scans of that time."""
        picture = self._predicted(picture, elapsed)
        before = tuple(replace(each, expected=0.0, detected=0.0, sources=()) for each in picture.records)
        picture = picture._replace(records=before)
        for scan in scans:
            picture = self._after_scan(picture, scan)
        picture = self._managed(picture)
        if len(picture.records) > 1 and self.merge_distance > 0.0:
            extra = self._duplicates(picture.means, picture.covariances, self.merge_distance)
            picture = picture.only([place for place, same in enumerate(extra.tolist()) if not same])
        largest = 2.0 * self.max_deviation * self.max_deviation
        spread = (picture.covariances[:, 0, 0] + picture.covariances[:, 1, 1]).tolist()
        return picture.only([place for place, each in enumerate(spread) if each <= largest])

    def _predicted(self, picture: _Picture, elapsed: float) -> _Picture:
        if elapsed <= 0.0 or not picture.records:
            return picture
        noise = self._noise * (elapsed / self.period)
        means, covariances, existence = self._predict(*picture[:3], noise, elapsed, self.lifetime)
        return picture._replace(means=means, covariances=covariances, existence=existence)

    def _after_scan(self, picture: _Picture, scan: Detections) -> _Picture:
        count = len(scan.values)
        rows = np.zeros((1 + count, 7))  # the sensor, without a value, and each detection
        rows[:, 0] = self._kinds[scan.kind == RANGE]
        rows[:, 1:3] = scan.observer
        rows[1:, 3 : 3 + scan.values.shape[1]] = scan.values
        rows[:, 5], rows[:, 6] = scan.along, scan.across
        density = scan.clutter_density + self.birth_density
        means, covariances, existence, caused, in_range, rough = self._fuse(
            *picture[:3], self.kappa, rows[0], rows[1:], scan.probability, density, scan.max_range, self.gate,
            self._averaged,
        )  # fmt: skip
        left = [1.0] * count
        for row in caused.tolist():
            left = [each - taken for each, taken in zip(left, row[1:], strict=True)]
        records = []
        for known, missed, share in zip(picture.records, caused[:, 0].tolist(), in_range.tolist(), strict=True):
            records.append(known if share < _LIKELY else _counted(known, scan, scan.probability * share, 1.0 - missed))
        new = [rows[1 + place] for place, free in enumerate(left) if free >= _LIKELY and scan.kind != RANGE]
        begun = [self._begin(row, self.birth_variance) for row in new[: max(self.max_tracks - len(records), 0)]]
        if begun:
            means = np.concatenate([means, [mean for mean, _ in begun]])
            covariances = np.concatenate([covariances, [covariance for _, covariance in begun]])
            existence = np.concatenate([existence, [self.birth_density / density] * len(begun)])
            origins = range(self._begun, self._begun + len(begun))
            records.extend(_counted(_Record(origin), scan, scan.probability, 1.0) for origin in origins)
            self._begun += len(begun)
        return _Picture(means, covariances, existence, tuple(records), picture.rough + rough)

    def _managed(self, picture: _Picture) -> _Picture:
        """The tracks that are left at the end of a step."""
        records, kept = [], []
        for place, (known, exists) in enumerate(zip(picture.records, picture.existence.tolist(), strict=True)):
            record = known
            if known.expected > 0.0 or known.detected > 0.0:  # somebody looked there
                is_hit = known.detected >= _LIKELY * known.expected
                record = replace(known, hits=known.hits + is_hit, steps=known.steps + 1)
            if record.is_confirmed and exists < self.delete_probability:
                continue
            if not record.is_confirmed:
                if record.steps - record.hits > max(self.confirm_steps - self.confirm_hits, 0):
                    continue
                if record.hits >= self.confirm_hits and exists >= self.confirm_probability:
                    record = replace(record, is_confirmed=True)
            records.append(record)
            kept.append(place)
        return picture.only(kept)._replace(records=tuple(records))


def _counted(record: _Record, scan: Detections, expected: float, detected: float) -> _Record:
    """A record after a scan with the probability that it should have detected the track, and that it has."""
    sources = tuple(sorted({*record.sources, scan.robot})) if detected >= _LIKELY else record.sources
    return replace(record, expected=record.expected + expected, detected=record.detected + detected, sources=sources)


def _order(scan: Detections) -> Any:
    return scan.robot, scan.time, scan.kind, scan.observer.tolist(), scan.values.tolist()
