"""A request to warn a person."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from perception.arrays import finite_number, set_fields

from ._errors import NavError

AlertKind = Literal["light", "voice", "horn"]


@dataclass(frozen=True, slots=True)
class Alert:
    """A request to warn a person: the kind of alert and the reason.

    Attributes:
        track_id: the person.
        kind: ``"light"``, ``"voice"`` or ``"horn"``.
        time_to_closest_s: ≥ 0, time to the closest approach at constant velocities.
        closest_gap_m: ≥ 0, gap between robot and body at the closest approach.
        reason: the reason as text.
    """

    track_id: int
    kind: AlertKind
    time_to_closest_s: float
    closest_gap_m: float
    reason: str

    def __post_init__(self) -> None:
        if self.kind not in get_args(AlertKind):
            raise NavError(
                f"kind must be one of {', '.join(get_args(AlertKind))}, got {self.kind!r}"
            )
        set_fields(
            self,
            **{
                name: finite_number(name, getattr(self, name), NavError, minimum=0.0)
                for name in ("time_to_closest_s", "closest_gap_m")
            },
        )
