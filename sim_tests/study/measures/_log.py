"""The log of one episode as its measures read it, and :func:`measure`, which makes its row."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ...crossing import STANDING_SPEED_MPS, ContactEvent, CrossingResult
from ._awareness import Requests, nearest_person, track_awareness
from ._conflict import Outline
from ._driving import path_length_m, peak_deceleration_and_jerk
from ._metrics import COLUMNS
from ._record import EpisodeRecord
from ._step_out import FASTER_STEP_OUT, StepOutImpacts, is_unaware, since_look_of, step_out_impacts
from ._trace import Trace


def measure(
    result: CrossingResult,
    *,
    time_without_people_s: float | None = None,
    length_without_people_m: float | None = None,
    **conditions: Any,
) -> EpisodeRecord:
    """Return the row of a crossing: every measure, as docs/simulation.md defines them.

    Numbers are rounded to the six decimals that files keep, so that a record read from a file is
    equal.

    Args:
        result: the crossing.
        time_without_people_s: time to goal of the same task without people; None if that run did
            not reach the goal or was not made.
        length_without_people_m: driven length of the same task without people.
        conditions: columns that the log does not tell, such as ``scenario_version``, ``attention``
            and ``fault``; or that take the place of those of the result.

    Raises:
        SimError: a result without frames, or with frames that do not hold all people.
    """
    log = Log(result, time_without_people_s, length_without_people_m)
    values = {
        "scenario": result.scenario,
        "seed": result.seed,
        "policy": result.policy,
        "planner": result.planner,
        "perception": result.perception,
        **{name: each.of(log) for name, each in COLUMNS.items() if each.of is not None},
    }
    return EpisodeRecord(**{**values, **conditions}).rounded()


class Log:
    """The log of one episode; what several measures need of it is computed once.

    Args:
        result: the crossing.
        time_without_people_s: time to goal of the same task without people; None if not known.
        length_without_people_m: driven length of the same task without people; None if not known.

    Attributes:
        result: as given.
        trace: the true course as arrays.
        contacts: all contacts.
        time_without_people_s: as given.
        length_without_people_m: as given.

    Raises:
        SimError: a result without frames, or with frames that do not hold all people.
    """

    def __init__(
        self,
        result: CrossingResult,
        time_without_people_s: float | None = None,
        length_without_people_m: float | None = None,
    ) -> None:
        self.result = result
        self.trace = Trace.of(result)
        self.contacts = result.contacts
        self.time_without_people_s = time_without_people_s
        self.length_without_people_m = length_without_people_m

    @cached_property
    def nearest_m(self) -> FloatArray:
        """(N,) smallest separation at each instant; infinite without people."""
        nearest_m: FloatArray = self.trace.separation_m.min(axis=1, initial=np.inf)
        return nearest_m

    @cached_property
    def margins_m(self) -> FloatArray:
        """(N, P) separation margins."""
        margins_m = np.array([frame.margins_m for frame in self.result.frames], dtype=np.float64)
        return margins_m.reshape(self.trace.separation_m.shape)

    @property
    def moves(self) -> NDArray[np.bool_]:
        """(N,) whether the robot moves."""
        moves: NDArray[np.bool_] = self.trace.travel_mps > STANDING_SPEED_MPS
        return moves

    @cached_property
    def unaware(self) -> NDArray[np.bool_]:
        """(N, P) whether people have not looked at the robot for 1 s, or never."""
        return is_unaware(since_look_of(self.trace))

    @property
    def contacts_by_robot(self) -> list[ContactEvent]:
        """Contacts that the robot caused."""
        return [each for each in self.contacts if each.by == "robot"]

    @property
    def moving_contacts(self) -> list[ContactEvent]:
        """Contacts with a moving robot, by any cause."""
        return [each for each in self.contacts if each.robot_speed_mps > STANDING_SPEED_MPS]

    @property
    def moving_contacts_unaware(self) -> list[ContactEvent]:
        """Contacts of a moving robot with people who had not looked for 1 s, or never."""
        t_s = self.trace.t_s
        return [
            each
            for each in self.moving_contacts
            if self.unaware[max(int(np.searchsorted(t_s, each.t_s, "right")) - 1, 0), each.worker]
        ]

    def fastest_mps(self, contacts: Iterable[ContactEvent]) -> float | None:
        """Return the robot's highest speed at some contacts; None for none."""
        return max((each.robot_speed_mps for each in contacts), default=None)

    @cached_property
    def path_length_m(self) -> float:
        """Length of the driven path."""
        return path_length_m(self.trace.robot_odom_m)

    @cached_property
    def peak_deceleration_and_jerk(self) -> tuple[float | None, float | None]:
        """Highest deceleration (m/s²) and largest jerk (m/s³) of the velocity in the base frame."""
        return peak_deceleration_and_jerk(self.trace.t_s, self.trace.velocity_base_mps)

    @cached_property
    def outline(self) -> Outline:
        """Convex hull of the robot's footprint."""
        return Outline(self.result.robot.footprint_m)

    @cached_property
    def step_out(self) -> StepOutImpacts:
        """Step-out impacts of people who start as recorded."""
        return step_out_impacts(self.result)

    @cached_property
    def step_out_stress(self) -> StepOutImpacts:
        """Step-out impacts of people who start faster than recorded."""
        return step_out_impacts(self.result, FASTER_STEP_OUT)

    @cached_property
    def requests(self) -> Requests:
        """Requests for attention."""
        return Requests.of(self.result, self.trace)

    @cached_property
    def tracked_awareness(self) -> tuple[FloatArray, FloatArray]:
        """(N, P) α of each person's track, and its lower bound; NaN without a track."""
        return track_awareness(self.result, self.trace)

    @cached_property
    def nearest_person(self) -> tuple[int, int] | None:
        """Instant and person of the closest approach; None if nobody came near."""
        return nearest_person(self.trace.separation_m)
