"""Episodes of a run as :class:`SocialEpisode`: an observer of the crossing, and its outcome."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ...world.errors import SimError
from ..runs import Job, free_run_of, observed_episode
from ._episode import Outcome, SocialEpisode, sides

if TYPE_CHECKING:
    from ...actors.behaviour import PersonMotion
    from ...crossing import CrossingFrame, CrossingResult, Stage
    from ...scenario import RobotTask
    from ..measures import EpisodeRecord


class EpisodeRecorder:
    """An observer of a crossing that keeps how people move; it changes nothing."""

    def __init__(self) -> None:
        self._motions: list[tuple[PersonMotion, ...]] = []
        self._task: RobotTask | None = None

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        """Record one control cycle."""
        self._task = stage.scenario.robot
        self._motions.append(stage.motions)

    def episode(
        self, result: CrossingResult, outcome: Outcome | None = None, name: str = ""
    ) -> SocialEpisode:
        """Return the recorded episode.

        Args:
            result: the crossing that was recorded.
            outcome: its outcome; None if it is not known.
            name: a text that identifies it.

        Raises:
            SimError: nothing was recorded.
        """
        if self._task is None:
            raise SimError("an episode without a control cycle cannot be measured")
        states = [frame.robot_state for frame in result.frames]
        courses = [[_course(motion) for motion in motions] for motions in self._motions]
        people = np.array(courses, dtype=np.float64).reshape(len(states), -1, 5)
        length, width = 2.0 * np.abs(result.robot.footprint_m).max(axis=0)
        return SocialEpisode(
            t_s=np.array([frame.t_s for frame in result.frames]),
            robot_m=np.array([state.position_odom_m for state in states]),
            robot_heading_rad=np.array([state.heading_odom_rad for state in states]),
            robot_mps=np.array([state.velocity_odom_mps for state in states]),
            yaw_rate_radps=np.array([state.yaw_rate_radps for state in states]),
            people_m=people[..., :2],
            people_heading_rad=people[..., 2],
            people_mps=people[..., 3:],
            robot_size_m=(float(length), float(width)),
            robot_radius_m=result.robot.circumscribed_radius_m,
            goal_m=np.array([self._task.goal_x_m, self._task.goal_y_m]),
            goal_tolerance_m=self._task.goal_tolerance_m,
            walls_m=sides(result.obstacle_boxes_odom_m),
            boxes_m=result.obstacle_boxes_odom_m,
            outcome=outcome or Outcome(),
            name=name,
        )


def _course(motion: PersonMotion) -> tuple[float, ...]:
    """Return position, heading and velocity of a person in odom; NaN for one who is away."""
    if motion.away:
        return (math.nan,) * 5
    return (*motion.position_odom_m, motion.heading_odom_rad, *motion.velocity_odom_mps)


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
    return recorder.episode(result, outcome, job.conditions.text), record
