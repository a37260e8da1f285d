"""Requests for attention and their answers, as drawings show them for a while."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from nav_adapter import Alert
from nav_adapter.alerts import Answer
from perception.arrays import FloatArray

from ._result import CrossingFrame

#: Time for which a request or an answer is shown.
SHOWN_S: Final = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class ShownRequest:
    """A request to a person or its answer, as a drawing shows it.

    Attributes:
        track_id: the person.
        text: ``"asks by voice: wins 2.1 s"`` or ``"looked after 0.9 s"``.
        answered: whether it is an answer.
        place_odom_m: (2,) place of the person now; None if the robot no longer has one.
    """

    track_id: int
    text: str
    answered: bool
    place_odom_m: FloatArray | None


class RequestMemory:
    """The requests and answers of the last 2 s, one per person: the latest.

    Each is in one control cycle only, so :meth:`take` must get every cycle, drawn or not. A cycle
    that it gets again changes nothing.
    """

    def __init__(self) -> None:
        self._latest: dict[int, tuple[float, Alert | Answer]] = {}

    def take(self, frame: CrossingFrame) -> None:
        """Remember the requests and answers of a control cycle."""
        limit = frame.constraints
        asked = [each for each in limit.alerts if each.kind == "attention"]
        events: tuple[Alert | Answer, ...] = (*asked, *limit.answers)
        for each in events:
            self._latest[each.track_id] = (frame.t_s, each)

    def shown(self, frame: CrossingFrame) -> tuple[ShownRequest, ...]:
        """Return what is shown at the time of a control cycle, the oldest first."""
        places = {each.id: each.position_odom_m for each in frame.tracks}
        places.update((each.track_id, each.center_odom_m) for each in frame.constraints.obstacles)
        return tuple(
            ShownRequest(who, _text(event), isinstance(event, Answer), places.get(who))
            for who, (t_s, event) in sorted(self._latest.items(), key=lambda item: item[1][0])
            if frame.t_s - t_s <= SHOWN_S
        )


def _text(event: Alert | Answer) -> str:
    if isinstance(event, Answer):
        return f"looked after {event.after_s:.1f} s"
    return f"asks by {event.means}: wins {event.wins_s:.1f} s"
