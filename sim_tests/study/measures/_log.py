"""The log of one episode as its measures read it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nav_adapter.rigid import Motion
from perception.arrays import FloatArray

from ...crossing import STANDING_SPEED_MPS, ContactEvent, CrossingResult
from ._awareness import Requests, nearest_person, track_awareness
from ._conflict import Outline
from ._driving import path_length_m, peak_deceleration_and_jerk
from ._inevitable import stoppable_mps
from ._step_out import FASTER_STEP_OUT, StepOutImpacts, step_out_impacts
from ._trace import Trace


class Log:
    """The log of one episode; what several measures need of it is computed once.

    Attributes:
        trace: the true course as arrays.
        contacts: all contacts.

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

    @cached_property
    def nearest_point_mps(self) -> FloatArray:
        """(N, P) speeds of the point of the robot that is nearest to each person."""
        speeds_mps = [
            [each.robot_speed_mps for each in frame.approaches] for frame in self.result.frames
        ]
        return np.array(speeds_mps, dtype=np.float64).reshape(self.trace.separation_m.shape)

    @cached_property
    def fastest_point_mps(self) -> FloatArray:
        """(N,) bound of the speed of all points of the robot."""
        radius_m = self.result.robot.circumscribed_radius_m
        motions = (Motion.of(frame.robot_state) for frame in self.result.frames)
        return np.array([motion.fastest_mps(radius_m) for motion in motions])

    @property
    def moves(self) -> NDArray[np.bool_]:
        """(N,) whether the robot moves: it drives, or turns on the spot."""
        moves: NDArray[np.bool_] = self.fastest_point_mps > STANDING_SPEED_MPS
        return moves

    @property
    def contacts_by_robot(self) -> list[ContactEvent]:
        """Contacts that the robot caused."""
        return [each for each in self.contacts if each.by == "robot"]

    @property
    def moving_contacts(self) -> list[ContactEvent]:
        """Contacts with a moving robot, by any cause."""
        return [each for each in self.contacts if each.robot_speed_mps > STANDING_SPEED_MPS]

    def moving_contacts_of(self, noticed: str) -> list[ContactEvent]:
        """Contacts of a moving robot with people of one of :data:`CONTACT_PEOPLE`."""
        t_s, asked = self.trace.t_s, {"asked": self.requests.noticed_when_asked}
        people = (self.trace.noticed | asked)[noticed]
        return [
            each
            for each in self.moving_contacts
            if people[max(int(np.searchsorted(t_s, each.t_s, "right")) - 1, 0), each.worker]
        ]

    @property
    def stoppable_mps(self) -> list[float]:
        """The speeds from which a robot could have stopped before each moving contact."""
        of = self.result, self.trace, self.outline
        return [stoppable_mps(*of, each) for each in self.moving_contacts]

    def min_margin_of(self, noticed: str) -> float | None:
        """Smallest margin at a moving robot to people of one of :attr:`Trace.noticed`."""
        counts = self.trace.noticed[noticed] & self.moves[:, None]
        return float(self.margins_m[counts].min()) if counts.any() else None

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
    def step_out(self) -> Mapping[str, StepOutImpacts]:
        """Step-out impacts of people who start as recorded."""
        return step_out_impacts(self.result, trace=self.trace)

    @cached_property
    def step_out_stress(self) -> Mapping[str, StepOutImpacts]:
        """Step-out impacts of people who start faster than recorded."""
        return step_out_impacts(self.result, FASTER_STEP_OUT, trace=self.trace)

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
