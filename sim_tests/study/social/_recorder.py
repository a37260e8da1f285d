"""Episodes of a run as :class:`SocialEpisode`: an observer of the crossing, and its outcome."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from perception.arrays import FloatArray

from ...world.errors import SimError
from ..runs import Job, describe, free_run_of, job_key, observed_episode
from ._episode import Outcome, SocialEpisode, sides

if TYPE_CHECKING:
    from ...crossing import CrossingFrame, CrossingResult, Stage
    from ..measures import EpisodeRecord


class EpisodeRecorder:
    """An observer of a crossing that keeps what the measures need; it changes nothing."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._robot: list[tuple[float, ...]] = []
        self._people: list[list[tuple[float, ...]]] = []
        self._boxes: FloatArray = np.zeros((0, 4))
        self._goal: tuple[float, float] = (0.0, 0.0)
        self._tolerance_m = 0.0

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        """Record one control cycle."""
        if not self._times:
            task = stage.scenario.robot
            self._goal, self._tolerance_m = (task.goal_x_m, task.goal_y_m), task.goal_tolerance_m
            self._boxes = stage.warehouse.obstacle_boxes_odom
        state = frame.robot_state
        self._times.append(frame.t_s)
        self._robot.append(
            (*state.position_odom_m.tolist(), state.heading_odom_rad, *_velocity(frame))
        )
        self._people.append(
            [
                (
                    *each.position_odom_m.tolist(),
                    each.heading_odom_rad,
                    *each.velocity_odom_mps.tolist(),
                )
                if not each.away
                else (math.nan,) * 5
                for each in stage.motions
            ]
        )

    def episode(
        self, result: CrossingResult, outcome: Outcome | None = None, name: str = ""
    ) -> SocialEpisode:
        """Return the recorded episode.

        Args:
            result: the crossing that was recorded, for the size of its robot.
            outcome: its outcome; None if it is not known.
            name: a text that identifies it.

        Raises:
            SimError: nothing was recorded.
        """
        if not self._times:
            raise SimError("an episode without a control cycle cannot be measured")
        count = len(self._times)
        robot = np.array(self._robot)
        people = np.array(self._people, dtype=np.float64).reshape(count, -1, 5)
        corners = np.abs(result.robot.footprint_m)
        return SocialEpisode(
            t_s=np.array(self._times),
            robot_m=robot[:, :2],
            robot_heading_rad=robot[:, 2],
            robot_mps=robot[:, 3:5],
            yaw_rate_radps=robot[:, 5],
            people_m=people[..., :2],
            people_heading_rad=people[..., 2],
            people_mps=people[..., 3:],
            robot_size_m=(2.0 * float(corners[:, 0].max()), 2.0 * float(corners[:, 1].max())),
            robot_radius_m=result.robot.circumscribed_radius_m,
            goal_m=np.array(self._goal),
            goal_tolerance_m=self._tolerance_m,
            walls_m=sides(self._boxes),
            boxes_m=self._boxes,
            outcome=outcome or Outcome(),
            name=name,
        )


def episode_of(job: Job) -> tuple[SocialEpisode, EpisodeRecord]:
    """Run the episode of a job again; return its course and its row in the table.

    Raises:
        SimError: the job cannot be read, or its planner fails.
    """
    recorder = EpisodeRecorder()
    result, record = observed_episode(job, recorder)
    free = free_run_of(job)
    outcome = Outcome(
        success=record.success,
        time_to_goal_s=result.time_to_goal_s,
        reference_time_s=free.time_s,
        reference_length_m=free.length_m,
        human_delay_s=record.human_delay_s,
    )
    return recorder.episode(result, outcome, describe(job_key(job))), record


def _velocity(frame: CrossingFrame) -> tuple[float, float, float]:
    """Return the robot's velocity in odom, and its yaw rate."""
    state = frame.robot_state
    return *state.velocity_odom_mps, state.yaw_rate_radps
