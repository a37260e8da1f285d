"""One crossing as a Gymnasium environment, on the loop of ``run_crossing``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from inspect import signature
from pathlib import Path
from typing import Any, Final, Literal, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from awarenav.errors import MissingExtraError, not_one_of
from nav_adapter import AwarenessPolicy, NavConstraints, RobotProfile
from perception.arrays import FloatArray
from perception.installation import install_command
from tracking.config import complaints

from ..actors.robot import RobotModel
from ..conditions import Perception, refuse_unused_networks
from ..crossing import (
    Crossing,
    CrossingFrame,
    Setup,
    TopView,
    axis_names,
    camera_view,
    changed,
    contact_by,
    named_fault,
    named_policy,
)
from ..crossing.faults import Fault
from ..scenario import Scenario
from ..world.config import SimConfig
from ..world.errors import SimError
from ._policy_planner import Observation, ObservationEncoder, action_limits, command_of

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.utils import EzPickle
except ImportError as cause:
    raise MissingExtraError(
        "the environment needs Gymnasium, which is not installed; it is the extra 'gym': "
        f"{install_command('gym')}"
    ) from cause

View = Literal["top", "camera"]
_VIEWS: Final = ("top", "camera")
_NO_EPISODE: Final = "the environment has no episode: call reset first"
# The plan shows the robot's way with this margin.
_PLAN_MARGIN_M: Final = 4.0
_PICTURE_PX: Final = (640, 480)


class RewardWeights(SimConfig):
    """The weights of the reward; the reward of a step is the sum of its parts.

    Attributes:
        progress_per_m: for each metre that the goal came closer.
        goal: once, at the goal.
        time_per_s: for each second.
        over_limit_per_m: for each metre that the commanded speed exceeds the limit, summed over
            time. The speed is that of the robot's fastest point, |v| + |ω| R.
        negative_margin_per_s: for each second with a negative separation margin of a moving robot.
        contact: once for each contact with a person that the robot caused.
        bump: once for each contact with a rack, a wall or a prop.
    """

    progress_per_m: float = 1.0
    goal: float = Field(default=5.0)
    time_per_s: float = -0.2
    over_limit_per_m: float = -2.0
    negative_margin_per_s: float = -2.0
    contact: float = -20.0
    bump: float = -20.0


class CrossingEnv(gymnasium.Env[Observation, NDArray[Any]], EzPickle):
    """One crossing per episode; a step is one control cycle.

    Observations are those of :class:`ObservationEncoder`. An action is speed and yaw rate. An
    episode terminates at the goal and at a contact that the robot caused; it is truncated when the
    scenario's time is up. ``reset(seed=s)`` gives the episode of ``run_crossing(seed=s)``, bit for
    bit; without a seed the next one is drawn. ``reset(options={"scenario": name})`` chooses the
    scenario. A copy or an unpickled environment has the same arguments and no episode.

    Args:
        scenarios: names of shipped scenarios, YAML files or scenarios, one or several;
            with several each episode draws one.
        policy: a policy, the name of a preset, or a YAML file.
        perception: one of ``run_crossing``'s.
        control_hz: control cycles per second, in (0, 240]; None for the scenario's.
        people_slots: number of people in an observation.
        scan_rays: number of rays of the scan in an observation; 0 for no scan.
        normalised_actions: actions are shares of the robot's largest speed and yaw rate, float32 in
            [−1, 1]; else they are in m/s and rad/s, float64 within the robot's limits, or within
            the largest of all scenarios' robots.
        reward: weights of the reward, as an object or as a mapping; None for the defaults.
        end_at_contact: a contact that the robot caused ends the episode, and so does one with a
            rack or a wall.
        render_mode: ``"rgb_array"`` or None.
        render_view: ``"top"`` for a plan, ``"camera"`` for the robot's camera.
        robot: another robot, to which every scenario is fitted: a model, a shipped name, a YAML
            file or a profile. A holonomic one is driven by speed and yaw rate too.
        population: habits of the people, as for ``run_crossing``; None for each scenario's own.
        fault: a fault of sensors, detections or odometry, or its name; None for none.
        axes: other conditions of ``run_crossing`` that change the scenario, such as
            ``camera="surround"``.

    Raises:
        SimError: for arguments that are not valid.
        NavError: for an unknown preset or an unusable policy file.
    """

    # Gymnasium declares it for instances.
    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": ["rgb_array"],
        "render_fps": 20,
    }

    def __init__(
        self,
        scenarios: str | Scenario | Sequence[Any] = "crossing_from_left",
        policy: AwarenessPolicy | str | Path = "balanced",
        perception: str = "truth",
        control_hz: float | None = None,
        people_slots: int = 8,
        scan_rays: int = 0,
        normalised_actions: bool = True,
        reward: RewardWeights | Mapping[str, float] | None = None,
        end_at_contact: bool = True,
        render_mode: str | None = None,
        render_view: View = "top",
        robot: RobotModel | RobotProfile | str | Path | None = None,
        population: str | None = None,
        fault: Fault | str | None = None,
        **axes: str,
    ) -> None:
        given = {name: value for name, value in locals().items() if name in _ARGUMENTS}
        EzPickle.__init__(self, **given, **axes)
        if isinstance(scenarios, (str, Scenario)):
            scenarios = (scenarios,)
        own_robot = None if robot is None else RobotModel.of(robot)
        # The conditions that change the scenario, which is done once, and not in every episode.
        self._axes = {"robot": own_robot, "population": population, **axes}
        self._scenarios = tuple(self._changed(each) for each in scenarios)
        if not self._scenarios:
            raise SimError("scenarios must name at least one scenario, got none")
        if control_hz is not None and not 0.0 < control_hz <= 240.0:
            raise SimError(f"control_hz must be in (0, 240], got {control_hz!r}")
        if render_mode not in (None, "rgb_array"):
            raise SimError(f"render_mode must be 'rgb_array' or None, got {render_mode!r}")
        if render_view not in _VIEWS:
            raise SimError(not_one_of("render_view", render_view, _VIEWS))
        refuse_unused_networks(self._axes, Perception.named(perception).kind)
        self._given: dict[str, Any] = {
            "policy": named_policy(policy)[1],
            "perception": perception,
            "fault": named_fault(fault),
        }
        self._control_hz = control_hz
        self._normalised = normalised_actions
        self._weights = _weights(reward)
        self._end_at_contact = end_at_contact
        self.render_mode = render_mode
        self._render_view = render_view
        self._slots = people_slots, scan_rays
        self._encoder = ObservationEncoder(*self._slots)
        arrays = spaces.Dict(
            {
                **{
                    name: spaces.Box(low, high, dtype=np.float32)
                    for name, (low, high) in self._encoder.bounds().items()
                },
                "mask": spaces.MultiBinary(people_slots),
            }
        )
        self.observation_space = cast("spaces.Space[Observation]", arrays)
        limits = np.max([action_limits(each.robot_profile) for each in self._scenarios], axis=0)
        self.action_space = (
            spaces.Box(-1.0, 1.0, (2,), np.float32)
            if normalised_actions
            else spaces.Box(-limits, limits, dtype=np.float64)
        )
        self._crossing: Crossing | None = None
        self._situation: CrossingFrame | None = None
        self._violation_s = 0.0
        self._least_m = math.inf, math.inf
        self._last: CrossingFrame | None = None
        self._plan: TopView | None = None
        self._ended = False

    @property
    def crossing(self) -> Crossing:
        """The crossing of the present episode; raises SimError before the first reset."""
        if self._crossing is None:
            raise SimError(_NO_EPISODE)
        return self._crossing

    @property
    def situation(self) -> CrossingFrame:
        """The present control cycle before its command, with the constraints a planner gets."""
        if self._situation is None:
            raise SimError(_NO_EPISODE)
        return self._situation

    @property
    def frame(self) -> CrossingFrame | None:
        """The control cycle of the last step, as ``run_crossing`` records it; None before it."""
        return self._last

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; ``options={"scenario": …}`` chooses its scenario.

        Raises:
            SimError: for other options and an unknown scenario.
        """
        super().reset(seed=seed)
        unknown = sorted(set(options or {}) - {"scenario"})
        if unknown:
            raise SimError(f"options of reset must be 'scenario' alone, got {', '.join(unknown)}")
        drawn = int(self.np_random.integers(2**31))
        choice = int(self.np_random.integers(len(self._scenarios)))
        episode_seed = drawn if seed is None else seed
        given = (options or {}).get("scenario")
        scenario = self._scenarios[choice] if given is None else self._changed(given)
        scenario = scenario.draw(episode_seed)
        if self._control_hz is not None:
            scenario = scenario.model_copy(update={"control_hz": self._control_hz})
        self.close()
        setup = Setup.of(scenario, seed=episode_seed, **self._given)
        conditions = replace(setup.conditions, **axis_names(self._axes))
        self._crossing = Crossing(replace(setup, conditions=conditions))
        self._encoder = ObservationEncoder(*self._slots, scenario.planner_boxes_odom_m)
        self._last = None
        self._ended = False
        self._violation_s, self._least_m = 0.0, (math.inf, math.inf)
        self._sense()
        return self._observation(), self._info((0.0, 0.0), {}, "", episode_seed)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for one control cycle.

        Raises:
            SimError: for an action that is not two finite numbers, and without an episode.
        """
        crossing, before = self.crossing, self.situation
        if self._ended:
            raise SimError("the episode has ended: call reset")
        command = command_of(action, crossing.stage.amr.profile, normalised=self._normalised)
        hits, bumps = _by_robot(crossing), crossing.stage.amr.bumps
        violated_s = self._violation_s
        crossing.command(*command)
        self._last = replace(before, command=command)
        crossing.advance()
        now = self._sense()
        hits, bumps = _by_robot(crossing) - hits, crossing.stage.amr.bumps - bumps
        terminated = now.at_goal and not crossing.time_is_up
        reason = "goal" if terminated else ""
        if (hits or bumps) and self._end_at_contact:
            terminated, reason = True, "contact" if hits else "bump"
        truncated = crossing.time_is_up and not terminated
        if truncated:
            reason = "time"
        self._ended = terminated or truncated
        goal = crossing.goal_odom_m
        weights, dt_s = self._weights, crossing.dt_s
        progress_m = _distance_m(before, goal) - _distance_m(now, goal)
        parts = {
            "progress": weights.progress_per_m * progress_m,
            "goal": weights.goal * (reason == "goal"),
            "time": weights.time_per_s * dt_s,
            "over_limit": weights.over_limit_per_m
            * _over_limit_mps(before.constraints, command)
            * dt_s,
            "margin": weights.negative_margin_per_s * (self._violation_s - violated_s),
            "contact": weights.contact * hits,
            "bump": weights.bump * bumps,
        }
        info = self._info(command, parts, reason, None)
        return self._observation(), float(sum(parts.values())), terminated, truncated, info

    def render(self) -> NDArray[Any] | None:
        """Return an RGB picture (H, W, 3) of the present control cycle; None without a mode."""
        if self.render_mode is None:
            return None
        crossing = self.crossing
        command = (0.0, 0.0) if self._last is None else self._last.command
        frame = replace(self.situation, command=command)
        if self._render_view == "top":
            if self._plan is None:
                window_odom_m = crossing.scenario.robot.window_odom_m(_PLAN_MARGIN_M)
                self._plan = TopView(crossing.stage, _PICTURE_PX, window_odom_m)
            return self._plan.draw(frame, crossing.stage)
        return camera_view(frame, crossing.stage, _PICTURE_PX[0])

    def close(self) -> None:
        """End the physics world of the episode; a second call does nothing."""
        if self._crossing is not None:
            self._crossing.close()
        self._crossing, self._situation = None, None
        self._plan = None

    def _sense(self) -> CrossingFrame:
        now = self._situation = self.crossing.sense()
        if not self.crossing.time_is_up:
            margin_m, separation_m = self._least_m
            self._least_m = min(margin_m, now.margin_m), min((separation_m, *now.separations_m))
            self._violation_s += self.crossing.dt_s * (now.margin_m < 0.0)
        return now

    def _changed(self, given: Any) -> Scenario:
        """Return a scenario with the robot, the population and the like of the environment."""
        if not isinstance(given, (str, Scenario)):
            raise SimError(
                f"a scenario must be a name, a YAML file or a Scenario, got {given!r:.80}"
            )
        return changed(given, self._axes)

    def _observation(self) -> Observation:
        now = self.situation
        return self._encoder.encode(now.known_state, self.crossing.goal_odom_m, now.constraints)

    def _info(
        self, command: tuple[float, float], parts: dict[str, float], reason: str, seed: int | None
    ) -> dict[str, Any]:
        now = self.situation
        limits, (margin_m, separation_m) = now.constraints, self._least_m
        info: dict[str, Any] = {
            "t_s": now.t_s,
            "scenario": self.crossing.scenario.name,
            "command": list(command),
            "distance_to_goal_m": _distance_m(now, self.crossing.goal_odom_m),
            "margins_m": list(now.margins_m),
            "separations_m": list(now.separations_m),
            "min_margin_m": margin_m,
            "min_separation_m": separation_m,
            "violation_time_s": self._violation_s,
            "speed_limit_mps": limits.speed_limit_mps,
            "yaw_rate_limit_radps": limits.yaw_rate_limit_radps(now.known_state.speed_mps),
            "limited_by": limits.limited_by,
            "stale": limits.stale,
            "braking_suffices": limits.braking_suffices,
            "obstacles": [
                [
                    each.track_id,
                    *each.center_odom_m.tolist(),
                    *each.velocity_odom_mps.tolist(),
                    each.radius_m,
                    each.awareness_lower,
                ]
                for each in limits.obstacles
            ],
            "contact": contact_by(self.crossing.stage.contacts),
            "bumps": self.crossing.stage.amr.bumps,
            "end": reason,
            "is_success": reason == "goal"
            and not _by_robot(self.crossing)
            and not self.crossing.stage.amr.bumps,
            "reward_parts": parts,
        }
        if seed is not None:
            info["seed"] = seed
        return info


def _weights(given: RewardWeights | Mapping[str, float] | None) -> RewardWeights:
    if isinstance(given, RewardWeights):
        return given
    try:
        return RewardWeights(**(given or {}))
    except ValidationError as cause:
        raise SimError(f"reward: {complaints(cause)}") from cause
    except TypeError as cause:
        raise SimError(f"reward: {cause}") from cause


def _over_limit_mps(constraints: NavConstraints, command: tuple[float, float]) -> float:
    """Return by how much a command of speed (m/s) and yaw rate (rad/s) exceeds the limit, ≥ 0."""
    speed = abs(command[0])
    over = max(speed - constraints.speed_limit_mps, 0.0)
    fastest = constraints.fastest_point_limit_mps
    if constraints.robot is not None and fastest is not None:
        radius = constraints.robot.circumscribed_radius_m
        over = max(over, speed + abs(command[1]) * radius - fastest)
    return over


def _distance_m(now: CrossingFrame, goal_odom_m: FloatArray) -> float:
    off_m = goal_odom_m - now.robot_state.position_odom_m
    return math.sqrt(off_m.dot(off_m))


def _by_robot(crossing: Crossing) -> int:
    return sum(contact.by == "robot" for contact in crossing.stage.contacts)


# The arguments of an environment, by which it is copied and pickled.
_ARGUMENTS: Final = frozenset(signature(CrossingEnv.__init__).parameters) - {"self", "axes"}
