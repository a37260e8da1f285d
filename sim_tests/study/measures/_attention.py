"""Attention of people in an episode, measured, and checked against the scenario's label."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ._awareness import AWARE_FROM
from ._record import EpisodeRecord
from ._trace import Trace

#: Separation within which attention matters. At 5 m a person assumed to walk at 1.6 m/s begins to
#: limit a robot of 1.5 m/s.
ATTENTION_WITHIN_M: Final = 5.0
#: Share of the time for which an attentive person is aware.
ATTENTIVE_FROM: Final = 0.8
#: A gaze within 10° of the robot gives at least this α with the default cone.
LOOKS_FROM: Final = 0.9
#: Share of the time for which the gaze of an unaware person may meet the robot by chance. In
#: ``walking_backwards`` it does for 14 %; people who glance look for 40 % and more.
UNAWARE_UP_TO: Final = 0.25
#: A person for whom attention mattered for less time is not judged.
_LEAST_TIME_S: Final = 0.5
#: Part of the episodes labelled attentive whose people were not measured to be so.
UNCONFIRMED: Final = "unconfirmed"


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredAttention:
    """The attention of P people while it mattered.

    Attention matters while a person's surface is within 5 m of the robot and the robot is in front
    of the person, in sight.

    Attributes:
        could_look_s: (P,) seconds for which it mattered.
        aware_s: (P,) seconds of these with a true α ≥ 0.5.
        looked_s: (P,) seconds of these with a gaze straight at the robot, α ≥ 0.9.
    """

    could_look_s: FloatArray
    aware_s: FloatArray
    looked_s: FloatArray

    @classmethod
    def of(cls, trace: Trace) -> MeasuredAttention:
        """Return the attention of the people of an episode."""
        matters = trace.could_look & (trace.separation_m < ATTENTION_WITHIN_M)
        steps_s = np.diff(trace.t_s)

        def seconds(condition: NDArray[np.bool_]) -> FloatArray:
            return np.asarray(steps_s @ condition[:-1].astype(np.float64))

        return cls(
            seconds(matters),
            seconds(matters & (trace.awareness >= AWARE_FROM)),
            seconds(matters & (trace.awareness >= LOOKS_FROM)),
        )

    @property
    def judged(self) -> NDArray[np.bool_]:
        """(P,) whether attention mattered long enough to be judged."""
        return np.asarray(self.could_look_s >= _LEAST_TIME_S)

    @property
    def least_aware_share(self) -> float | None:
        """Smallest share of the time for which one of the people was aware; None without any."""
        judged = self.judged
        if not judged.any():
            return None
        return float((self.aware_s[judged] / self.could_look_s[judged]).min())


def measured_part(record: EpisodeRecord) -> str:
    """Return the scenario's attention, or :data:`UNCONFIRMED`.

    An episode labelled attentive counts as such only if each of its people was aware for at least
    80 % of the time.
    """
    share = record.attentive_share
    if record.attention != "attentive" or record.error:
        return record.attention
    return "attentive" if share is not None and share >= ATTENTIVE_FROM else UNCONFIRMED
