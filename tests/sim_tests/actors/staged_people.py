"""A fast stage: a robot that drives straight ahead among people, without perception or planner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from perception import AttentionCone
from sim_tests import Scenario
from sim_tests.actors.behaviour import PersonMotion, PersonOutcome
from sim_tests.crossing import ContactEvent, Stage

DT_S = 0.05


@dataclass(frozen=True)
class StageRun:
    """The recorded run of a stage with P people at T times."""

    times_s: np.ndarray
    people: np.ndarray  # (T, P, 4) x, y, vx, vy
    angles: np.ndarray  # (T, P, 5) heading, yaw and pitch of head and of eyes
    robot: np.ndarray  # (T, 2)
    awareness: np.ndarray  # (T, P); 0 unless it was asked for
    outcomes: tuple[PersonOutcome, ...]
    contacts: tuple[ContactEvent, ...]
    min_separation_m: float

    @property
    def places(self) -> np.ndarray:
        """(T, P, 2) places of the people."""
        return self.people[:, :, :2]

    @property
    def speeds(self) -> np.ndarray:
        """(T, P) speeds of the people."""
        return np.hypot(self.people[:, :, 2], self.people[:, :, 3])

    @property
    def off_robot_deg(self) -> np.ndarray:
        """(T, P) how far the heads point past the robot's base."""
        offset = self.robot[:, None] - self.places
        off = self.angles[..., :2].sum(axis=2) - np.arctan2(offset[..., 1], offset[..., 0])
        return np.abs(np.degrees(np.angle(np.exp(1j * off))))

    def crossing(self, person: int = 0) -> tuple[float, float]:
        """Return the time of crossing y = 0 upwards, and x ahead of the robot's centre then."""
        y = self.people[:, person, 1]
        at = int(np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))[0])
        return float(self.times_s[at]), float(self.people[at, person, 0] - self.robot[at, 0])


def run_stage(
    people: list[dict[str, Any]],
    *,
    robot_mps: float = 0.8,
    seconds: float = 12.0,
    seed: int = 0,
    layout: str = "open",
    robot: dict[str, float] | None = None,
    asks_at_s: tuple[float, ...] | None = None,
    asks: int = 0,
    **scenario: Any,
) -> StageRun:
    """Run a stage with a robot that drives straight ahead.

    With ``asks_at_s`` it asks a person by voice at these times, and true awareness is recorded.
    """
    task = {"goal_x_m": 12.0, **(robot or {})}
    case = Scenario.model_validate(
        {
            "name": "film",
            "duration_s": seconds,
            "layout": layout,
            "robot": task,
            "people": people,
            **scenario,
        }
    )
    cone = AttentionCone()
    times, rows, angles, places, awareness = [], [], [], [], []
    nearest_m = np.inf
    with Stage(case, np.random.default_rng(seed)) as stage:
        stage.amr.command(robot_mps, 0.0)
        for tick in range(round(seconds / DT_S)):
            nearest_m = min(nearest_m, *(each.separation_m for each in stage.observe()))
            motions = stage.motions
            times.append(stage.t_s)
            rows.append([[*m.position_odom_m, *m.velocity_odom_mps] for m in motions])
            angles.append([_angles(motion) for motion in motions])
            places.append(stage.amr.T_odom_base[:2, 3].copy())
            awareness.append([0.0] * len(motions))
            if asks_at_s is not None:
                views = stage.truth(cone, stage.amr.T_odom_camera)
                awareness[-1] = [view.awareness for view in views]
                if any(abs(stage.t_s - t_s) < 0.5 * DT_S for t_s in asks_at_s):
                    stage.request("voice", motions[asks].position_odom_m)
            stage.advance((tick + 1) * DT_S)
        outcomes = stage.outcomes
    return StageRun(
        np.array(times),
        np.array(rows),
        np.array(angles),
        np.array(places),
        np.array(awareness),
        outcomes,
        tuple(stage.contacts),
        nearest_m,
    )


def _angles(motion: PersonMotion) -> tuple[float, ...]:
    head = motion.heading_odom_rad, motion.head_yaw_rad, motion.head_pitch_rad
    return (*head, motion.eye_yaw_rad, motion.eye_pitch_rad)


def crosser(reaction: str | None, **fields: Any) -> dict[str, Any]:
    """Return a person who crosses the robot's line at x = 5 m; without a reaction unaware."""
    person: dict[str, Any] = {
        "name": "crosser",
        "route": [{"x_m": 5.0, "y_m": -4.0}, {"x_m": 5.0, "y_m": 4.0}],
        "start_s": 2.4,
        "glances": {"watches": True, "notices_within_m": 12.0 if reaction else 0.0},
    }
    if reaction:
        person["reactions"] = {reaction: 1.0}
    return {**person, **fields}
