"""A request to warn a person or to ask for their attention, and the answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from perception.arrays import finite_number, set_fields

from ._errors import NavError

__all__ = ["Alert", "AlertKind", "AlertMeans", "Answer"]

AlertMeans = Literal["light", "voice", "horn"]
AlertKind = Literal["light", "voice", "horn", "attention"]


@dataclass(frozen=True, slots=True)
class Alert:
    """A request to the robot to warn a person, or to ask them to look at it.

    Attributes:
        track_id: the person.
        kind: ``"light"``, ``"voice"`` or ``"horn"`` for a warning of a collision, ``"attention"``
            for a request to look at the robot.
        time_to_closest_s: ≥ 0, time to the closest approach at constant velocities; 0 for people
            who move away.
        closest_gap_m: ≥ 0, gap between robot and body at the closest approach.
        reason: the reason as text.
        means: ``"light"``, ``"voice"`` or ``"horn"``: what to use. It is the kind of a warning, and
            must be given with ``"attention"``.
        wins_s: ≥ 0, time that the robot would win if the person looked; 0 for a warning.
    """

    track_id: int
    kind: AlertKind
    time_to_closest_s: float
    closest_gap_m: float
    reason: str
    means: AlertMeans | None = None
    wins_s: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in get_args(AlertKind):
            raise NavError(
                f"kind must be one of {', '.join(get_args(AlertKind))}, got {self.kind!r}"
            )
        means = self.kind if self.means is None else self.means
        if means not in get_args(AlertMeans) or self.kind not in (means, "attention"):
            wanted = ", ".join(get_args(AlertMeans)) if self.kind == "attention" else self.kind
            raise NavError(f"means must be {wanted} with kind {self.kind!r}, got {self.means!r}")
        set_fields(
            self,
            means=means,
            **{
                name: finite_number(name, getattr(self, name), NavError, minimum=0.0)
                for name in ("time_to_closest_s", "closest_gap_m", "wins_s")
            },
        )


@dataclass(frozen=True, slots=True)
class Answer:
    """A look, as perception has measured it, of a person who had been asked for attention.

    Attributes:
        track_id: the person.
        after_s: ≥ 0, time from the request to the picture that showed it.
    """

    track_id: int
    after_s: float

    def __post_init__(self) -> None:
        set_fields(self, after_s=finite_number("after_s", self.after_s, NavError, minimum=0.0))
