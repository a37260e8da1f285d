"""The true course of an episode as arrays over time, from which its metrics are computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from nav_adapter.rigid import Motion
from perception.arrays import FloatArray

from ...world.errors import SimError

if TYPE_CHECKING:
    from ...crossing import CrossingResult


#: Somebody who has looked at the robot within this time counts as looking.
LOOKING_WITHIN_S: Final = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """The true course of an episode: N instants, P people.

    People who are away at an instant have NaN for place and velocity, and are infinitely far.

    Attributes:
        t_s: (N,) increasing.
        robot_odom_m: (N, 2) positions of the base origin.
        heading_odom_rad: (N,) headings of the robot.
        velocity_base_mps: (N, 2) velocity of the base origin, forward and to the left.
        yaw_rate_radps: (N,) of the robot.
        people_odom_m: (N, P, 2) positions of the centre lines.
        people_odom_mps: (N, P, 2) velocities.
        awareness: (N, P) true α.
        separation_m: (N, P) distances between the surfaces; a lower bound where the centres are
            more than 4 m apart.
        could_look: (N, P) whether the robot was in front of the person and in sight.
        since_look_s: (N, P) times since people last looked at the robot, infinite before.
        has_noticed: (N, P) whether a look of theirs has taken the robot in.
    """

    t_s: FloatArray
    robot_odom_m: FloatArray
    heading_odom_rad: FloatArray
    velocity_base_mps: FloatArray
    yaw_rate_radps: FloatArray
    people_odom_m: FloatArray
    people_odom_mps: FloatArray
    awareness: FloatArray
    separation_m: FloatArray
    could_look: NDArray[np.bool_]
    since_look_s: FloatArray
    has_noticed: NDArray[np.bool_]

    @classmethod
    def of(cls, result: CrossingResult) -> Trace:
        """Return the trace of a crossing.

        Raises:
            SimError: the crossing has no frames, or the number of people changes.
        """
        frames = result.frames
        if not frames:
            raise SimError("an episode without frames cannot be measured")
        people = len(frames[0].truth)
        if any(
            len(frame.truth) != people or len(frame.separations_m) != people for frame in frames
        ):
            raise SimError(
                f"every frame must hold the truth and the separation of all {people} people"
            )
        count = len(frames)
        course = np.array([Motion.of(frame.robot_state) for frame in frames])

        def of_people(name: str, size: tuple[int, ...]) -> FloatArray:
            rows = [[getattr(view, name) for view in frame.truth] for frame in frames]
            return np.array(rows, dtype=np.float64).reshape(count, people, *size)

        here = np.where(of_people("away", (1,)), np.nan, 1.0)
        return cls(
            t_s=np.array([frame.t_s for frame in frames]),
            robot_odom_m=course[:, :2],
            heading_odom_rad=course[:, 2],
            velocity_base_mps=course[:, 3:5],
            yaw_rate_radps=course[:, 5],
            people_odom_m=here * of_people("position_odom_m", (2,)),
            people_odom_mps=here * of_people("velocity_odom_mps", (2,)),
            awareness=of_people("awareness", ()),
            separation_m=np.array([frame.separations_m for frame in frames]).reshape(count, people),
            could_look=of_people("could_look", ()).astype(np.bool_),
            since_look_s=of_people("since_look_s", ()),
            has_noticed=of_people("noticed", ()).astype(np.bool_),
        )

    @property
    def people(self) -> int:
        """Number of people."""
        return int(self.separation_m.shape[1])

    @property
    def anybody(self) -> bool:
        """True if somebody was there at some instant."""
        return bool(np.isfinite(self.separation_m).any())

    @property
    def travel_mps(self) -> FloatArray:
        """The (N,) speeds of the base origin in its direction of travel, at least 0."""
        travel: FloatArray = np.hypot(*self.velocity_base_mps.T)
        return travel

    @property
    def looks(self) -> NDArray[np.bool_]:
        """(N, P) whether people look at the robot."""
        looks: NDArray[np.bool_] = self.since_look_s <= 0.0
        return looks

    @property
    def looking(self) -> NDArray[np.bool_]:
        """(N, P) whether people look at the robot, or did within the last second."""
        looking: NDArray[np.bool_] = self.since_look_s <= LOOKING_WITHIN_S + 1e-9
        return looking

    @property
    def noticed(self) -> dict[str, NDArray[np.bool_]]:
        """People by what they have noticed of the robot, (N, P) each; everybody is in one.

        That is what they took in by the simulator, not the way in which a head faces.
        """
        has, looking = self.has_noticed, self.looking
        return {"never": ~has, "past": has & ~looking, "looking": has & looking}

    def to_base(self, vectors_odom: FloatArray) -> FloatArray:
        """Return (N, P, 2) vectors in the axes of the base frame at their instant."""
        cos = np.cos(self.heading_odom_rad)[:, None]
        sin = np.sin(self.heading_odom_rad)[:, None]
        x, y = vectors_odom[..., 0], vectors_odom[..., 1]
        return np.stack([cos * x + sin * y, cos * y - sin * x], axis=-1)

    def time_with(self, condition: NDArray[np.bool_]) -> float:
        """Return the seconds during which a condition (N,) held.

        Each instant stands for the time to the next one.
        """
        return float(np.diff(self.t_s) @ condition[:-1].astype(np.float64))
