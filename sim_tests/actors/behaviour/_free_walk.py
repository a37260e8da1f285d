"""The walks of the same people with the same seed, had the robot not been there."""

from __future__ import annotations

import bisect
from collections.abc import Sequence
from typing import Any, Final, Generic, Protocol, TypeVar

from ._route import RouteFollower
from ._spec import PersonSpec
from ._surroundings import ALONE, MovingBody, Surroundings

# Somebody as far along a route as this is level with another.
_LEVEL_M: Final = 0.1
# Who has not arrived without the robot this long after they did with it, never does.
_LONGEST_S: Final = 120.0


class Walker(Protocol):
    """A person as far as a free walk goes: see :class:`Person`."""

    spec: PersonSpec
    task: RouteFollower

    @property
    def arrived(self) -> bool: ...
    @property
    def moving_body(self) -> MovingBody | None: ...
    def twin(self) -> Any: ...
    def advance(self, t_s: float, around: Surroundings) -> None: ...


WalkerT = TypeVar("WalkerT", bound=Walker)


class FreeWalks(Generic[WalkerT]):
    """The free walks of some people among each other, computed as far as they are asked for.

    Args:
        people: everybody in the hall, new. Those who set off as the robot comes set off at the
            same time without it.
        tick_s: time between two decisions of a person.
    """

    def __init__(self, people: Sequence[WalkerT], tick_s: float) -> None:
        self._people, self._tick_s = people, tick_s
        self._twins: list[WalkerT] = []
        self._bodies: list[MovingBody | None] = []
        self._ticks = 0
        self._along_m: list[list[float]] = [[] for _ in people]  # at each tick since the start

    def of(self, person: WalkerT, now_s: float) -> tuple[WalkerT, float]:
        """Return somebody as they would be at the end of their walk, and how late they are.

        The walk ends now for a person who is still on the way, and at its end for one who has
        arrived. They are late by the time, at least 0, that it took them longer to come so far.
        """
        index = self._people.index(person)
        if not self._twins:
            self._twins = [each.twin() for each in self._people]
            self._bodies = [None] * len(self._twins)
        twin = self._twins[index]
        until_s = now_s + _LONGEST_S if person.arrived else now_s
        while self._ticks * self._tick_s <= until_s + 1e-9:
            if person.arrived and twin.arrived:
                break
            self._step()
        # A pause of the free walk at this place counts as taken, because it may not be over.
        along = self._along_m[index]
        level = bisect.bisect_right(along, person.task.along_m + _LEVEL_M)
        started_s = person.task.started_s
        elapsed_s = now_s - (now_s if started_s is None else started_s)
        return twin, max(elapsed_s - level * self._tick_s, 0.0)

    def _step(self) -> None:
        """Let everybody take their next decision."""
        t_s, bodies = self._ticks * self._tick_s, self._bodies
        self._ticks += 1
        for index, (twin, person) in enumerate(zip(self._twins, self._people, strict=True)):
            started_s, waits = person.task.started_s, twin.spec.sets_off_within_m is not None
            if waits and started_s is not None and t_s >= started_s - 1e-9:
                twin.task.go(t_s)
            others = tuple(each for each in (*bodies[:index], *bodies[index + 1 :]) if each)
            twin.advance(t_s, Surroundings(None, others, ALONE.sees_robot))
            if twin.task.started_s is not None and t_s > twin.task.started_s + 1e-9:
                self._along_m[index].append(twin.task.along_m)
        self._bodies = [twin.moving_body for twin in self._twins]
