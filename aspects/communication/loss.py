"""Messages that are lost at random: independently, or in bursts."""

from __future__ import annotations

from epicycle.actors import Parameter

from ..core import CommunicationAspect, JoinPoint, RandomLoss, is_bad


class PacketLoss(RandomLoss, CommunicationAspect):
    """Drops each message with a fixed probability, independently per receiver and message (Bernoulli).

    It is to messages what ``MeasurementFailure`` is to measurements; for bursts of losses, see ``GilbertElliott``.
    Event: ``dropped``.  Paper: the communication error of the disturbance level, section III.A.
    """

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a message is lost")

    def draw(self, point: JoinPoint) -> bool:
        return bool(point.random.random() < self.probability)


class GilbertElliott(RandomLoss, CommunicationAspect):
    """Drops messages in bursts: a channel that is good or bad, and changes between the two from message to message.

    In the stationary law the channel is bad with probability p / (p + r); it stays bad for 1 / r messages in the mean
    and good for 1 / p.  The mean loss is (p * loss_bad + r * loss_good) / (p + r).  A loss of 25 % in bursts of four:
    ``r: 0.25, p: 0.0833``.  Event: ``dropped``.  Source: Gilbert, Bell Syst. Tech. J. 39, 1960; Elliott, 42, 1963.
    """

    p = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a good channel turns bad, per message")
    r = Parameter(float, 1.0, min=0.0, max=1.0, unit="1", doc="probability that a bad channel recovers, per message")
    loss_bad = Parameter(float, 1.0, min=0.0, max=1.0, unit="1", doc="probability of loss while the channel is bad")
    loss_good = Parameter(float, 0.0, min=0.0, max=1.0, unit="1", doc="probability of loss while it is good")

    def draw(self, point: JoinPoint) -> bool:
        probability = self.loss_bad if is_bad(point, self.p, self.r) else self.loss_good
        return bool(point.random.random() < probability)
