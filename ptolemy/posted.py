"""PostedDirector: ties are posted, and composites fire again at a tag as long as tokens wait at their inputs."""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable
from typing import Any, TypeVar

from epicycle.actors import Actor, Context, InputPort, Moment, StateMachine, Tag, Wake, Way
from epicycle.runner.engine import Call, Conductor, Delivery, Director, Directors, Instant, Passage, Refinement, Turn
from epicycle.runner.graph import ModelGraph, is_within
from epicycle.runner.text import Limits

from .posts import Posts, is_posted, layout

M = TypeVar("M", Wake, Moment)


class PostedComposites(Directors):
    """Makes the borders of such composites."""

    director: PostedDirector

    def __init__(self, graph: ModelGraph, actors: dict[str, Actor], director: PostedDirector) -> None:
        self.borders: dict[str, Border] = {}  # of strict composites
        super().__init__(graph, actors, director)

    def _is_ours(self, composite: str) -> bool:
        return is_posted(self.graph.dialects[composite], type(self.director))

    def passage(self, path: str, outside: Director | Refinement) -> Passage:
        kind = PostedPassage if self._is_ours(self.graph.owner(path)) else Passage
        return kind(path, outside)

    def prepare(self, composite: str, outside: Director | Refinement) -> None:
        if not composite or not self._is_ours(composite):
            return
        passages: list[list[Any]] = [[self.passages[path] for path in paths] for paths in self.graph.borders(composite)]
        if self.graph.is_strict(composite):
            border = Border(composite, self.graph.end_of(composite), self.director, outside, *passages)
            for passage in (*passages[0], *passages[1]):
                passage.border = border
            self.borders[composite] = border
            if composite not in self.graph.modal:  # whose parts are posted one by one
                self.director.posted[composite] = border
        if composite in self.graph.modal or self.graph.refinement_of(composite) == composite:
            for passage in (*passages[0], *passages[1]):
                passage.is_refired = True
            for passage in passages[1] if composite in self.graph.modal else ():
                passage.holds_one = True

    def conductor(self, composite: str, machine: StateMachine) -> Conductor:
        kind = PostedConductor if self._is_ours(composite) else Conductor
        return kind(composite, machine, self.director, self.of[composite])

    def refinement(self, path: str, outside: Context, conductor: Conductor) -> Refinement:
        kind = PostedRefinement if self._is_ours(path) else Refinement
        return kind(path, outside, self.director, conductor)

    def resumption(self, composite: str) -> Callable[[], None] | None:
        border = self.borders.get(composite)
        return None if border is None else border.resume

    def start(self, before: str, path: str) -> None:
        """Post the composites that are complete."""
        around = before if self.borders else ""
        while around:
            around = around.rpartition(".")[0]
            if around in self.borders and not is_within(path, around):
                self.borders[around].post()


class PostedPassage(Passage):
    """A port of such a composite: with a ``border``, it lets one token through per firing of the composite.

    If it ``is_refired`` with the surroundings of the composite, one per firing of those.  One that ``holds_one`` keeps
    only the latest of the tokens that come together.
    """

    def __init__(self, path: str, director: Director | Refinement) -> None:
        super().__init__(path, director)
        self.border: Border | None = None
        self.is_refired = False
        self.holds_one = False
        self.requests: deque[Delivery] = deque()  # to an aspect that is a model, waiting for its turn

    def clear(self) -> None:
        self.requests.clear()
        super().clear()

    def let_through(self) -> None:
        for lane in self._lanes.values() if self.holds_one else ():
            while len(lane.waiting) > 1:
                lane.waiting.popleft()
        if self.border is None and not self.is_refired:
            super().let_through()
            return
        if self.border is not None:
            if not self.border.lets_pass(self):
                self.wake_in(0)
                return
            while self.requests:
                self.requests.popleft().arrive()
        for lane in self._lanes.values():
            if lane.waiting:
                lane.waiting.popleft().arrive()
        if self.is_waited_for and (self.border is None or self in self.border.behind):
            self.wake_in(0)

    def admit(self, place: str, onward: Way, told: Callable[[Way], Way]) -> tuple[Way, bool]:
        border = self.border
        if border is None:
            return super().admit(place, onward, told)
        onward = told(onward)

        def arrive(token: Any) -> None:
            self.requests.append(self._director.hold(onward, token))
            if border.is_to_come:
                self._director.trigger(self)
            else:
                self.wake_in(0)

        return Call(arrive), True


class Border(Actor):
    """The turn that ends a firing of such a composite, and posts it for what comes next.

    In each of its firings, one token of each channel passes its ports.  The output of an actor whose firing was
    deferred from outside leaves at the next microstep, unless the composite fires at this tag for new input.
    """

    def __init__(
        self,
        composite: str,
        end: str,
        director: PostedDirector,
        outside: Director | Refinement,
        inputs: list[PostedPassage],
        outputs: list[PostedPassage],
    ) -> None:
        super().__init__(end)
        self.enter(outside)
        self.composite = composite
        self.before, self.behind = inputs, outputs
        self._director = director
        self._outside = outside
        ranks = [rank for each, rank in director.ranks.items() if is_within(each, composite)]
        self._first, self._last = min(ranks), max(ranks)
        self._came_in: Tag | None = None  # when something came in
        self._resumed: Tag | None = None  # when a deferred firing was executed
        self._inside: list[tuple[int, int]] = []  # the tags with work to do, a heap
        self._posted: set[tuple[int, int]] = set()  # the tags for which it has been posted

    @property
    def is_to_come(self) -> bool:
        """Whether the composite has yet to fire at the present tag."""
        return self._director.is_to_come(self._first, self._last)

    @property
    def turn(self) -> Turn:
        """The turn that ends a firing of the composite."""
        return self._director.turn(self, self._director.ranks[self.path])

    def note(self, time: int, microstep: int) -> None:
        heapq.heappush(self._inside, (time, microstep))
        if self._director.last.microstep and self._director.is_between(self._first, self._last):
            self.post()

    def post(self) -> None:
        """Request a turn for what comes first inside."""
        now = self._director.last
        while self._inside and self._inside[0] <= now:
            heapq.heappop(self._inside)
        self._posted = {tag for tag in self._posted if tag > now}
        if self._inside and self._inside[0] not in self._posted:
            self._posted.add(self._inside[0])
            self._director.want_at(self.turn, self._inside[0][0])

    def resume(self) -> None:
        """An actor inside now fires after its firing was deferred from outside."""
        self._resumed = self.tag

    def lets_pass(self, passage: PostedPassage) -> bool:
        """Whether waiting tokens may pass a port now."""
        now = self.tag
        if passage in self.before:
            self._came_in = now
            self._outside.trigger(self)
            return True
        return self._resumed != now or self._came_in == now

    def fire(self) -> None:
        if any(passage.is_waited_for for passage in self.before):
            for passage in (*self.before, *self.behind):
                if passage.is_waited_for:
                    self._outside.trigger(passage)
        else:
            self.post()


class PostedConductor(Conductor):
    """Conducts a machine that fires again at a tag as long as tokens wait at the inputs of its composite."""

    @property
    def hears_inputs(self) -> bool:
        return True

    def fire(self) -> None:
        self._left = None
        super().fire()

    def active_in(self, mode: str) -> Refinement | None:
        # The refinement of a final mode no longer fires.
        return None if self.machine.modes[mode].final else super().active_in(mode)


class PostedRefinement(Refinement):
    """The director inside such a refinement: what begins in it begins at once, not at the next microstep."""

    _is_beginning = False

    def not_before(self, time: int) -> tuple[int, int]:
        return (0, 0) if self._is_beginning else super().not_before(time)

    def begin_inside(self, inside: Callable[[], None]) -> None:
        self._is_beginning = True
        inside()
        self._is_beginning = False


class PostedDirector(Director):
    """Fires actors in the order of posting, under the directors whose dialect asks for it.

    A wake-up is posted when it is requested, a token when it is put into a port.  Actors of equal depth and priority
    fire in the order in which they were posted first.  An actor takes all tokens that wait for it, in whichever of its
    turns it fires; its consecutive turns are one firing, and a later one comes even if its tokens have been taken.
    """

    composites = PostedComposites

    def __init__(self, order: dict[str, int], seed: int, limits: Limits, graph: ModelGraph) -> None:
        super().__init__(order, seed, limits, graph)
        found, self._takes_all = layout(graph, PostedDirector)
        self._posts = Posts(found)
        self.posted: dict[str, Border] = {}  # of the composites that are posted as a whole

    # -- the order ------------------------------------------------------------------------------------------------

    def line_up(self, turn: Turn) -> None:
        turn.is_wanted = True
        self._posts.push(turn.rank)

    def next_turn(self) -> Turn | None:
        if self._posts.first() < 0:
            return None
        turn = self._pop()
        self.rank = turn.rank
        return turn

    def _pop(self) -> Turn:
        turn = self.turns[self._posts.pop()]
        assert turn is not None
        turn.is_wanted = False
        return turn

    def has_reason(self, turn: Turn) -> bool:
        found = super().has_reason(turn)
        while turn.actor.path in self._takes_all and (rank := self._posts.first()) >= 0:
            other = self.turns[rank]
            if other is None or other.actor is not turn.actor:
                break
            found = super().has_reason(self._pop()) or found
        return found

    def inputs_at(self, actor: Actor, rank: int) -> list[InputPort[Any]]:
        if actor.path in self._takes_all:
            return [*actor.inputs.values()]
        return super().inputs_at(actor, rank)

    def handle(self, instant: Instant) -> None:
        self._posts.settle()
        self._arrange(instant)
        super().handle(instant)

    def _arrange(self, instant: Instant) -> None:
        """Leave out what was cancelled, and put the contents of a composite behind the turn that posts all of it."""
        if instant.turn is None:
            return
        found = [(instant.turn, instant.wake), *zip(instant.turns or (), instant.wakes or (), strict=True)]
        instant.turn = instant.wake = instant.turns = instant.wakes = None
        for turn, wake in sorted(found, key=lambda entry: self._nesting(entry[0].actor)):
            if wake is None or not wake.cancelled:
                instant.add(turn, wake)

    # -- composites that are posted as a whole --------------------------------------------------------------------

    def wake_turn(self, turn: Turn, time: int) -> Wake:
        return self._note(turn, super().wake_turn(turn, time))

    def call(self, actor: Actor, tag: Tag, rank: int) -> Wake:
        return self._note(self.turn(actor, rank), super().call(actor, tag, rank))

    def want_at(self, turn: Turn, time: int) -> Moment:
        is_now = self.present is None and time <= self.now().time
        moment = super().want_at(turn, time)
        return moment if is_now else self._note(turn, moment)

    def _note(self, turn: Turn, moment: M) -> M:
        """Let the composite that an actor is in know of its turn."""
        if (border := self._around(turn.actor)) is not None:
            border.note(moment.time, moment.microstep)
        return moment

    def _around(self, actor: Actor) -> Border | None:
        """What posts the innermost composite around an actor that is posted as a whole."""
        path = actor.composite if isinstance(actor, Border) else actor.path
        while path and self.posted:
            path = path.rpartition(".")[0]
            if path in self.posted:
                return self.posted[path]
        return None

    def _nesting(self, actor: Actor) -> int:
        """How many such composites are around an actor."""
        border = self._around(actor)
        return 0 if border is None else self._nesting(border) + 1

    # -- for borders --------------------------------------------------------------------------------------------------

    def is_between(self, first: int, last: int) -> bool:
        """Whether none of the turns of these ranks is being taken."""
        return self.present is None or not first <= self.rank <= last

    def is_to_come(self, first: int, last: int) -> bool:
        """Whether a turn of these ranks is still to come at the present tag, and none of them is being taken."""
        if self.present is None or not self.is_between(first, last):
            return False
        return any(turn is not None and turn.is_wanted for turn in self.turns[first : last + 1])
