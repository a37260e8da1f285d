"""Episodes of random walks and of a straight drive, for tests of the measures that others use."""

from __future__ import annotations

import numpy as np

from sim_tests.study.social import SocialEpisode

WALLS_M = np.array([[-4.0, -4.0, 8.0, -4.0], [8.0, -4.0, 8.0, 4.0], [2.0, 1.5, 3.0, 2.5]])


def random_episode(seed, *, people=4, count=90, absent=True):
    """Return an episode with uneven times; two people walk together, the last is there at times."""
    rng = np.random.default_rng(seed)
    t_s = np.cumsum(rng.uniform(0.03, 0.12, count))
    heading = np.cumsum(rng.normal(0.0, 0.15, count)) + rng.uniform(-3.0, 3.0)
    robot_mps = rng.normal((0.8, 0.1), 0.6, (count, 2))
    people_mps = rng.normal(0.0, 0.3, (count, people, 2)) + rng.normal(0.0, 0.7, (people, 2))
    steps = np.diff(t_s, prepend=t_s[0])
    robot_m = np.cumsum(steps[:, None] * robot_mps, axis=0)
    starts = rng.uniform(-1.5, 4.0, (people, 2))
    people_m = starts + np.cumsum(steps[:, None, None] * people_mps, axis=0)
    if people > 1:
        people_m[:, 1] = people_m[:, 0] + [0.7, 0.4]
        people_mps[:, 1] = people_mps[:, 0]
    if people > 2 and absent:
        people_m[count // 3 : count // 2, people - 1] = np.nan
    return SocialEpisode(
        t_s=t_s,
        robot_m=robot_m,
        robot_heading_rad=heading,
        robot_mps=robot_mps,
        yaw_rate_radps=rng.normal(0.0, 0.5, count),
        people_m=people_m,
        people_heading_rad=np.cumsum(rng.normal(0.0, 0.2, (count, people)), axis=0),
        people_mps=people_mps,
        robot_size_m=(0.7, 0.5),
        robot_radius_m=0.43,
        person_radius_m=0.27,
        goal_m=np.array([6.0, 1.0]),
        goal_tolerance_m=0.3,
        walls_m=WALLS_M,
        success=bool(seed % 3),
        time_to_goal_s=7.5,
        reference_time_s=5.0,
        reference_length_m=0.8 * 6.0,
        human_delay_s=-0.25,
        name=f"random {seed}",
    )


def straight_episode(t_s, speed_mps=1.0, *, standing_m=(), **values):
    """Return an episode of a robot that drives along x, past people who stand at these places."""
    t_s = np.asarray(t_s, dtype=float)
    count, people = len(t_s), len(standing_m)
    nothing = np.zeros(count)
    values = {
        "robot_size_m": (0.6, 0.6),
        "robot_radius_m": 0.3,
        "goal_m": np.array([10.0, 0.0]),
        **values,
    }
    return SocialEpisode(
        t_s=t_s,
        robot_m=np.stack([speed_mps * t_s, nothing], axis=1),
        robot_heading_rad=nothing,
        robot_mps=np.stack([nothing + speed_mps, nothing], axis=1),
        yaw_rate_radps=nothing,
        people_m=np.tile(np.reshape(standing_m, (1, people, 2)), (count, 1, 1)),
        people_heading_rad=np.zeros((count, people)),
        people_mps=np.zeros((count, people, 2)),
        **values,
    )
