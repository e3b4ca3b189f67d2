"""PostedDirector: ties are posted, and composites fire again at a tag as long as tokens wait at their inputs."""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from epicycle.actors import Actor, InputPort, Moment, Receiver, StateMachine, Tag, Wake, paths
from epicycle.runner.execution.engine import (
    Activation,
    BoundaryPort,
    Call,
    Delivery,
    Director,
    Directors,
    Instant,
    ModeDirector,
    Outer,
    Refinement,
)  # fmt: skip
from epicycle.runner.model.catalogue import Dialect
from epicycle.runner.model.graph import ModelGraph, steps
from epicycle.runner.model.text import Limits

M = TypeVar("M", Wake, Moment)
Place = tuple[tuple[int, int], ...]  # of a rank: its group and its number there, in each director from the outermost in
Layout = tuple[tuple[Place, ...], frozenset[str]]
_known: WeakKeyDictionary[ModelGraph, Layout] = WeakKeyDictionary()

# -- posts -------------------------------------------------------------------------------------------------------------


def is_posted(dialect: type[Dialect], kind: type) -> bool:
    """Whether a dialect asks for a kind of director."""
    wanted = dialect.director()
    return wanted is not None and issubclass(kind, wanted)


def layout(graph: ModelGraph, kind: type) -> Layout:
    """The place of each rank, and the actors under directors with posted ties: the same for all runs.

    In these directors, steps of equal level form a group.
    """
    if graph in _known:
        return _known[graph]
    posted = {path for path, domain in graph.domains.items() if is_posted(domain.dialect, kind)}
    order = steps(graph)
    numbers = {director: number for number, director in enumerate(graph.domains)}
    found: list[Place] = []

    def unfold(director: str, around: Place) -> None:
        group, before = 0, None
        for step in order[director]:
            group += step.level is None or step.level != before or director not in posted
            before = step.level
            if (inner := step.paths[0]) in order and inner != director:
                unfold(inner, (*around, (group, numbers[inner])))
            else:
                found.append((*around, (group, 0)))

    unfold("", ())
    actors = frozenset(path for path in graph.actors if graph.director_of(path) in posted)
    return _known.setdefault(graph, (tuple(found), actors))


class Posts:
    """Ranks with groups.

    A member of a group may be a rank, or a director with its own groups.  The director that was posted first is also
    first, and continues until nothing is left in it.
    """

    def __init__(self, places: tuple[Place, ...]) -> None:
        self._places = places
        self._heap: list[tuple[tuple[int, ...], int]] = []
        self._number = 0  # of the last post
        self._numbers: dict[int, int] = {}  # of the members of a group, the number of its first post
        self._waiting: dict[int, int] = {}  # how many are left in a director
        self._open: Place = ()  # where the last one taken out belongs

    def push(self, rank: int) -> None:
        """Post a rank."""
        self._number += 1
        place = self._places[rank]
        key: tuple[int, ...] = ()
        for group, director in place[:-1]:
            key += group, self._numbers.setdefault(director, self._number)
            self._waiting[director] = self._waiting.get(director, 0) + 1
        heapq.heappush(self._heap, ((*key, place[-1][0], self._number), rank))

    def first(self) -> int:
        """The next rank; -1 if there is none."""
        return self._heap[0][1] if self._heap else -1

    def pop(self) -> int:
        """Take the next rank out."""
        rank = heapq.heappop(self._heap)[1]
        around = self._places[rank][:-1]
        if around or self._open:
            self._leave(around)
            for _, director in around:
                self._waiting[director] -= 1
        return rank

    def settle(self) -> None:
        """Begin a tag: the work of the previous one is over."""
        self._leave(())
        if not self._heap:
            self._number = 0

    def _leave(self, around: Place) -> None:
        """Directors in which nothing is left must be posted again, except those that continue."""
        for place in self._open:
            director = place[1]
            if place not in around and not self._waiting[director]:
                del self._numbers[director], self._waiting[director]
        self._open = around


# -- composites --------------------------------------------------------------------------------------------------------


class PostedComposites(Directors):
    """Makes the borders of such composites."""

    director: PostedDirector
    boundary_ports: dict[str, Any]

    def __init__(self, graph: ModelGraph, actors: dict[str, Actor], director: PostedDirector) -> None:
        self.borders: dict[str, CompositeBoundary] = {}  # of strict composites
        super().__init__(graph, actors, director)

    def _is_ours(self, composite: str) -> bool:
        return is_posted(self.graph.domains[composite].dialect, type(self.director))

    def boundary_port(self, path: str, outside: Director | Refinement) -> BoundaryPort:
        kind = PostedPort if self._is_ours(paths.parent(path)) else BoundaryPort
        return kind(path, outside)

    def prepare(self, composite: str, outside: Director | Refinement) -> None:
        if not composite or not self._is_ours(composite):
            return
        inputs, outputs = ([self.boundary_ports[path] for path in paths] for paths in self.graph.borders(composite))
        if self.graph.is_strict(composite):
            border = CompositeBoundary(composite, self.graph.end_of(composite), self.director, outside, inputs, outputs)
            for port in (*inputs, *outputs):
                port.border = border
            self.borders[composite] = border
            if not self.graph.domains[composite].machine:  # whose parts are posted one by one
                self.director.posted[composite] = border
        if self.graph.domains[composite].machine or self.graph.refinement_of(composite) == composite:
            for port in (*inputs, *outputs):
                port.is_refired = True
            for port in outputs if self.graph.domains[composite].machine else ():
                port.holds_one = True

    def mode_director(self, composite: str, machine: StateMachine) -> ModeDirector:
        kind = PostedModeDirector if self._is_ours(composite) else ModeDirector
        return kind(composite, machine, self.director, self.of[composite])

    def refinement(self, path: str, outside: Outer, mode_director: ModeDirector) -> Refinement:
        kind = PostedRefinement if self._is_ours(path) else Refinement
        return kind(path, outside, self.director, mode_director)

    def resumption(self, composite: str) -> Callable[[], None] | None:
        border = self.borders.get(composite)
        return None if border is None else border.resume

    def start(self, before: str, path: str) -> None:
        """Post the composites that are complete."""
        around = before if self.borders else ""
        while around:
            around = around.rpartition(".")[0]
            if around in self.borders and not paths.is_within(path, around):
                self.borders[around].post()


class PostedPort(BoundaryPort):
    """A port of such a composite: with a ``border``, it lets one token through per firing of the composite.

    If it ``is_refired`` with the surroundings of the composite, one per firing of those.  One that ``holds_one`` keeps
    only the latest of the tokens that come together.
    """

    def __init__(self, path: str, director: Director | Refinement) -> None:
        super().__init__(path, director)
        self.border: CompositeBoundary | None = None
        self.is_refired = False
        self.holds_one = False
        self.requests: deque[Delivery] = deque()  # to an aspect that is a model, waiting for its activation

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

    def admit(self, place: str, onward: Receiver, told: Callable[[Receiver], Receiver]) -> tuple[Receiver, bool]:
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


class CompositeBoundary(Actor):
    """The activation that ends a firing of such a composite, and posts it for what comes next.

    In each of its firings, one token of each channel passes its ports.  The output of an actor whose firing was
    deferred from outside leaves at the next microstep, unless the composite fires at this tag for new input.
    """

    def __init__(
        self,
        composite: str,
        end: str,
        director: PostedDirector,
        outside: Director | Refinement,
        inputs: list[PostedPort],
        outputs: list[PostedPort],
    ) -> None:
        super().__init__(end)
        self.enter(outside)
        self.composite = composite
        self.before, self.behind = inputs, outputs
        self._director = director
        self._outside = outside
        ranks = [rank for each, rank in director.ranks.items() if paths.is_within(each, composite)]
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
    def activation(self) -> Activation:
        """The activation that ends a firing of the composite."""
        return self._director.activation(self, self._director.ranks[self.path])

    def note(self, time: int, microstep: int) -> None:
        heapq.heappush(self._inside, (time, microstep))
        if self._director.last.microstep and self._director.is_between(self._first, self._last):
            self.post()

    def post(self) -> None:
        """Request an activation for what comes first inside."""
        now = self._director.last
        while self._inside and self._inside[0] <= now:
            heapq.heappop(self._inside)
        self._posted = {tag for tag in self._posted if tag > now}
        if self._inside and self._inside[0] not in self._posted:
            self._posted.add(self._inside[0])
            self._director.schedule_at(self.activation, self._inside[0][0])

    def resume(self) -> None:
        """An actor inside now fires after its firing was deferred from outside."""
        self._resumed = self.tag

    def lets_pass(self, port: PostedPort) -> bool:
        """Whether waiting tokens may pass a port now."""
        now = self.tag
        if port in self.before:
            self._came_in = now
            self._outside.trigger(self)
            return True
        return self._resumed != now or self._came_in == now

    def fire(self) -> None:
        if any(port.is_waited_for for port in self.before):
            for port in (*self.before, *self.behind):
                if port.is_waited_for:
                    self._outside.trigger(port)
        else:
            self.post()


class PostedModeDirector(ModeDirector):
    """Directs the modes of a machine that fires again at a tag while tokens wait at the inputs of its composite."""

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
    activations it fires; its consecutive activations are one firing, and a later one comes even if its tokens have
    been taken.
    """

    composites = PostedComposites

    def __init__(self, order: dict[str, int], seed: int, limits: Limits, graph: ModelGraph) -> None:
        super().__init__(order, seed, limits, graph)
        found, self._takes_all = layout(graph, PostedDirector)
        self._posts = Posts(found)
        self.posted: dict[str, CompositeBoundary] = {}  # of the composites that are posted as a whole

    # -- the order ------------------------------------------------------------------------------------------------

    def enqueue(self, activation: Activation) -> None:
        activation.is_scheduled = True
        self._posts.push(activation.rank)

    def next_activation(self) -> Activation | None:
        if self._posts.first() < 0:
            return None
        activation = self._pop()
        self.rank = activation.rank
        return activation

    def _pop(self) -> Activation:
        activation = self.activations[self._posts.pop()]
        assert activation is not None
        activation.is_scheduled = False
        return activation

    def has_reason(self, activation: Activation) -> bool:
        found = super().has_reason(activation)
        while activation.actor.path in self._takes_all and (rank := self._posts.first()) >= 0:
            other = self.activations[rank]
            if other is None or other.actor is not activation.actor:
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
        """Leave out what was cancelled, and put a composite's contents behind the activation that posts all of it."""
        if instant.activation is None:
            return
        found = [(instant.activation, instant.wake), *zip(instant.activations or (), instant.wakes or (), strict=True)]
        instant.activation = instant.wake = instant.activations = instant.wakes = None
        for activation, wake in sorted(found, key=lambda entry: self._nesting(entry[0].actor)):
            if wake is None or not wake.cancelled:
                instant.add(activation, wake)

    # -- composites that are posted as a whole --------------------------------------------------------------------

    def wake_activation(self, activation: Activation, time: int) -> Wake:
        return self._note(activation, super().wake_activation(activation, time))

    def call(self, actor: Actor, tag: Tag, rank: int) -> Wake:
        return self._note(self.activation(actor, rank), super().call(actor, tag, rank))

    def schedule_at(self, activation: Activation, time: int) -> Moment:
        is_now = self.present is None and time <= self.now().time
        moment = super().schedule_at(activation, time)
        return moment if is_now else self._note(activation, moment)

    def _note(self, activation: Activation, moment: M) -> M:
        """Let the composite that an actor is in know of its activation."""
        if (border := self._around(activation.actor)) is not None:
            border.note(moment.time, moment.microstep)
        return moment

    def _around(self, actor: Actor) -> CompositeBoundary | None:
        """What posts the innermost composite around an actor that is posted as a whole."""
        path = actor.composite if isinstance(actor, CompositeBoundary) else actor.path
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
        """Whether none of the activations of these ranks is being taken."""
        return self.present is None or not first <= self.rank <= last

    def is_to_come(self, first: int, last: int) -> bool:
        """Whether an activation of these ranks is still to come at the present tag, and none of them is being taken."""
        if self.present is None or not self.is_between(first, last):
            return False
        return any(each is not None and each.is_scheduled for each in self.activations[first : last + 1])
