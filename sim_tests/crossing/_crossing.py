"""The closed loop of one crossing: camera, perception, tracker, adapter, planner and physics."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Final

import numpy as np

from nav_adapter import AwarenessPolicy, NavConstraints, RobotProfile, RobotState
from perception import AttentionCone, AwarenessPipeline
from perception.arrays import FloatArray

from ..actors.behaviour import RequestMeans
from ..actors.robot import RobotModel
from ..scenario import Scenario
from ..world.render import RendererName
from ._assembly import Setup
from ._command import checked_command
from ._result import CrossingFrame, CrossingResult
from ._separations import margins_m, moves
from ._stage import Stage
from .faults import Fault
from .planner import LocalPlanner, SeatedPlanner, import_planner, seeded_generators
from .sensors import KeypointNoise

Observer = Callable[[CrossingFrame, Stage], None]

# Within the goal tolerance the goal counts as reached at this speed or less.
_GOAL_SPEED_MPS: Final = 0.2


class Crossing(AbstractContextManager["Crossing"]):
    """The closed loop of one crossing, one control cycle at a time; a context manager.

    Each cycle is :meth:`sense`, :meth:`command` and :meth:`advance`, in this order.
    :func:`run_crossing` lets a planner give the commands.

    Args:
        setup: the episode. The same setup and commands give the same cycles, bit for bit.

    Attributes:
        scenario: that of the episode.
        robot: profile of the robot.
        stage: hall, robot and people.
        goal_odom_m: (2,) goal.
        dt_s: length of a control cycle.

    Raises:
        SimError: a perception with scanners and a scenario without any.
        PerceptionError: for ``"pixels"``, when the shipped networks cannot be loaded.
    """

    def __init__(self, setup: Setup) -> None:
        self.scenario = scenario = setup.scenario
        self.robot = scenario.robot_profile
        self._cone = AttentionCone()
        self.stage, self._sensing, self._adapter = setup.assembled()
        self.goal_odom_m = np.array([scenario.robot.goal_x_m, scenario.robot.goal_y_m])
        self.dt_s = 1.0 / scenario.control_hz
        self._ticks = round(scenario.duration_s * scenario.control_hz)
        self._tick = 0

    def close(self) -> None:
        """End the physics world; a second call does nothing."""
        self.stage.close()

    def __exit__(self, *exception: object) -> None:
        self.close()

    @property
    def t_s(self) -> float:
        """Simulated time of the present control cycle."""
        return self._tick * self.dt_s

    @property
    def time_is_up(self) -> bool:
        """True once all control cycles of the scenario have run."""
        return self._tick >= self._ticks

    def sense(self, seat: SeatedPlanner | None = None) -> CrossingFrame:
        """Observe the separations, take images and scans, update the constraints.

        The frame has no command yet, and the constraints that a seated planner is told. Call it
        once per control cycle.
        """
        t_s, sensing = self.t_s, self._sensing
        approaches = self.stage.observe()
        robot_moves = moves(self.stage.amr.motion, self.robot)
        T_odom_camera = self.stage.amr.T_odom_camera
        truth = self.stage.truth(self._cone, T_odom_camera)
        state = self.stage.amr.state(t_s)
        sensing.step(t_s, truth)
        tracks = sensing.tracks
        constraints = self._adapter.update(
            tracks,
            sensing.state,
            t_s,
            perception_stamp_s=sensing.stamp_s,
            seen_stamp_s=sensing.seen_stamp_s,
        )
        if seat is not None:
            constraints, tracks = seat.told(constraints, tracks)
        self._ask(constraints)
        observed = sensing.observed
        return CrossingFrame(
            t_s=t_s,
            robot_state=state,
            known_state=sensing.state,
            T_odom_camera=T_odom_camera,
            truth=truth,
            observations=tuple(observation for observation, _ in observed),
            observed_workers=tuple(worker for _, worker in observed),
            tracks=tracks,
            constraints=constraints,
            approaches=approaches,
            margins_m=tuple(margins_m(approaches, self.robot, moves=robot_moves)),
            robot_moves=robot_moves,
            at_goal=_at_goal(self.scenario, state, self.goal_odom_m),
            scan_points_odom_m=sensing.scan_points_odom_m,
        )

    def _ask(self, constraints: NavConstraints) -> None:
        """Let the people hear the robot's requests for attention; warnings do not reach them."""
        places = {track.id: track.position_odom_m for track in self._sensing.tracks}
        for alert in constraints.alerts:
            if alert.kind == "attention" and alert.track_id in places:
                means: RequestMeans = "light" if alert.means == "light" else "voice"
                self.stage.request(means, places[alert.track_id])

    def command(self, speed_mps: float, yaw_rate_radps: float, lateral_mps: float = 0.0) -> None:
        """Give the robot a command; it holds until the next one.

        ``lateral_mps`` is the speed to the left, for a robot that can move sideways.
        """
        self.stage.amr.command(speed_mps, yaw_rate_radps, lateral_mps)

    def advance(self) -> None:
        """Run robot, people and physics up to the next control cycle."""
        self.stage.advance(self.t_s + self.dt_s)
        self._tick += 1


def run_crossing(
    scenario: Scenario | str,
    *,
    policy: AwarenessPolicy | str | Path = "balanced",
    planner: LocalPlanner | str | None = None,
    perception: str = "truth",
    seed: int = 0,
    robot: RobotModel | RobotProfile | str | Path | None = None,
    noise: KeypointNoise | None = None,
    pipeline: AwarenessPipeline | None = None,
    observer: Observer | None = None,
    fault: Fault | str | None = None,
    renderer: RendererName = "auto",
    population: str | None = None,
    **axes: str,
) -> CrossingResult:
    """Run one crossing in PyBullet and return its log.

    Args:
        scenario: a scenario, a shipped name or a YAML file; it is drawn by the seed.
        policy: a policy, the name of a preset, or a YAML file; see :func:`named_policy`.
        planner: the local planner, or its name as for :func:`make_planner`; None for the reference
            :class:`ReferencePlanner`, or for :class:`StraightOn` where the scenario drives straight
            ahead.
        perception: ``"truth"``; ``"keypoints"``: true keypoints with noise through the pipeline;
            ``"pixels"``: rendered images through the shipped networks, at 10 images a second where
            the scenario gives no rate; or ``"oracle"``: the truth about everybody who is not hidden
            by a rack. ``"keypoints+scanner"`` and ``"pixels+scanner"`` add the scenario's laser
            scanners, and ``"scanner"`` has them alone.
        seed: the same seed gives the same result, bit for bit, but for the times of ``plan_s``.
        robot: a robot model, a shipped name, a YAML file, or a profile; the scenario is fitted to
            it by :meth:`Scenario.with_robot`. None for the scenario's own.
        noise: noise of the keypoint camera; None for the default.
        pipeline: pipeline for ``"pixels"`` instead of the shipped networks; its camera must be that
            of the images.
        observer: called after every control cycle with the frame and the stage, for example to
            render.
        fault: a fault of sensors, detections or odometry, or its name; frames keep the truth about
            the robot.
        renderer: renderer of the images: ``"tiny"``, ``"gl"``, or ``"auto"`` for the fastest
            available. Their pixels are nearly, but not exactly, the same.
        population: habits of the people, such as ``"recorded"``, ``"answers=0.3"``, or both; None
            for the scenario's own. See :meth:`Scenario.with_population`.
        axes: other fields of :class:`~sim_tests.conditions.Conditions` that change the scenario,
            such as ``camera="surround"``.

    Raises:
        SimError: unknown scenario, robot, population or perception, a planner without ``plan``, or
            a command that is not two finite numbers (three for a robot that can move sideways).
        NavError: unknown preset or unusable policy file.
        PerceptionError: for ``"pixels"``, when the shipped networks cannot be loaded.
    """
    setup = Setup.of(
        scenario,
        policy=policy,
        planner=planner,
        perception=perception,
        seed=seed,
        fault=fault,
        noise=noise,
        pipeline=pipeline,
        renderer=renderer,
        robot=robot,
        population=population,
        **axes,
    )
    return drive(setup, observer)


def drive(setup: Setup, observer: Observer | None = None) -> CrossingResult:
    """Let the planner of an episode drive; return the log.

    A planner that is given by its name is new, and the global random generators of ``random`` and
    ``numpy`` have the seed of the episode while it drives.

    Raises:
        SimError: a planner that cannot be made, or a command that is not finite numbers.
    """
    if not isinstance(setup.planner, str):
        return _driven(setup, observer)
    if setup.planner:
        import_planner(setup.planner)  # before seeding: a module may draw where it begins
    with seeded_generators(setup.conditions.seed):
        return _driven(setup, observer)


def _driven(setup: Setup, observer: Observer | None) -> CrossingResult:
    driver = setup.driver()
    frames: list[CrossingFrame] = []
    reached_s: float | None = None
    with Crossing(setup) as crossing, ExitStack() as seat:
        clocked = driver if isinstance(driver, SeatedPlanner) else None
        if clocked is not None:
            seat.enter_context(clocked.seated(crossing.stage))
        while not crossing.time_is_up:
            now = crossing.sense(clocked)
            asked_s = process_time()
            returned = driver.plan(
                now.known_state, crossing.goal_odom_m, now.constraints, crossing.dt_s
            )
            plan_s = process_time() - asked_s
            speed, yaw_rate, lateral = checked_command(
                driver, returned, now.t_s, sideways=crossing.robot.drive == "holonomic"
            )
            crossing.command(speed, yaw_rate, lateral)
            frames.append(
                replace(
                    now,
                    command=(speed, yaw_rate),
                    lateral_command_mps=lateral,
                    plan_s=plan_s,
                    late_s=None if clocked is None else clocked.late_s,
                )
            )
            if observer is not None:
                observer(frames[-1], crossing.stage)
            if now.at_goal:
                reached_s = now.t_s
                break
            crossing.advance()
        conditions, stage = setup.conditions, crossing.stage
        return CrossingResult(
            scenario=conditions.scenario,
            seed=conditions.seed,
            policy=conditions.policy,
            planner=conditions.planner,
            perception=conditions.perception,
            contacts=tuple(stage.contacts),
            time_to_goal_s=reached_s,
            frames=tuple(frames),
            people=stage.outcomes,
            robot=crossing.robot,
            obstacle_boxes_odom_m=setup.scenario.layout.obstacle_boxes_odom,
            bumps=stage.amr.bumps,
        )


def _at_goal(scenario: Scenario, state: RobotState, goal: FloatArray) -> bool:
    if scenario.robot.straight_on_speed_mps is not None:
        return False
    if state.travel_mps > _GOAL_SPEED_MPS:
        return False
    return math.dist(goal, state.position_odom_m) <= scenario.robot.goal_tolerance_m
