"""How well tracks match the truth."""

from __future__ import annotations

import numpy as np

from ..core import Actor, InputPort, OutputPort, Parameter
from .messages import BodyState, Tracks
from .receiving import PLANE, by_channel, latest


class TrackingError(Actor):
    """The GOSPA metric of tracks: the distance between the positions of the true bodies and those of the tracks.

    Tracks are assigned to bodies at the least cost.  With p = 2 and alpha = 2, the squared metric adds the squared
    errors of the pairs nearer than ``cutoff``, and half the squared cutoff for each body without a track and each track
    without a body.  A body that sends no state at the tag does not exist then.
    """

    bodies = InputPort(BodyState, multi=True, required=False, doc="the truth, a connection for each body")
    tracks = InputPort(Tracks, doc="the tracks to judge")
    gospa = OutputPort(float, doc="the metric in metres")
    error = OutputPort(float, doc="root mean square error of the pairs in metres, if there are any")
    missed = OutputPort(int, doc="number of bodies without a track")
    false = OutputPort(int, doc="number of tracks without a body")

    cutoff = Parameter(float, 5.0, unit="m", above=0, doc="distance from which a track is not that of a body")

    def initialize(self) -> None:
        from .numerics import gospa

        self._gospa = gospa.gospa

    def fire(self) -> None:
        if not self.tracks.present:
            return
        there = [states[-1].position for states in by_channel(self.bodies, PLANE) if states]
        found = [estimate.mean[:2] for estimate in latest(self.tracks, PLANE).estimates]
        truth, tracks = (np.array(each).reshape((len(each), 2)) for each in (there, found))
        total, error, missed, false = self._gospa(truth, tracks, self.cutoff)
        self.gospa.send(total)
        if missed < len(there):
            self.error.send(error)
        self.missed.send(missed)
        self.false.send(false)
