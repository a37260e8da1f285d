"""The closed loop of one crossing: camera, perception, tracker, adapter, planner and physics."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Final

import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, RobotState
from perception import AttentionCone, AwarenessPipeline
from perception.arrays import FloatArray

from ..actors.behaviour import PersonOutcome
from ..actors.robot import NOVA_CARTER
from ..scenario import Scenario, ScenarioTemplate
from ..world.errors import SimError
from ..world.render import RendererName
from ._command import check_planner, checked_command
from ._metrics import SafetyMeter
from ._result import CrossingFrame, CrossingResult
from ._sensing import Sensing
from ._stage import Stage
from .eyes import KeypointNoise, Perception
from .faults import Fault
from .planner import LocalPlanner, SamplingPlanner, StraightOn

Observer = Callable[[CrossingFrame, Stage], None]

# Within the goal tolerance the goal counts as reached at this speed or less.
_GOAL_SPEED_MPS: Final = 0.2
# Rate of the separation measurements; contacts are checked in every physics step.
_MEASURED_HZ: Final = 20.0


def run_crossing(
    scenario: Scenario | str,
    *,
    policy: AwarenessPolicy | str | Path,
    planner: LocalPlanner | None = None,
    perception: str = "truth",
    seed: int = 0,
    noise: KeypointNoise | None = None,
    pipeline: AwarenessPipeline | None = None,
    observer: Observer | None = None,
    fault: Fault | None = None,
    renderer: RendererName = "auto",
) -> CrossingResult:
    """Run one crossing in PyBullet and measure it.

    Args:
        scenario: a scenario, or the name of a shipped one, drawn by the seed.
        policy: a policy, the name of a preset, or a YAML file.
        planner: the local planner; None for the reference :class:`SamplingPlanner`, or for
            :class:`StraightOn` where the scenario drives straight ahead.
        perception: ``"truth"``; ``"keypoints"``: true keypoints with noise through the pipeline;
            ``"pixels"``: rendered images through the shipped networks, at 10 images a second where
            the scenario gives no rate; or ``"oracle"``: the truth about everybody who is not hidden
            by a rack. ``"keypoints+scanner"`` and ``"pixels+scanner"`` add the scenario's laser
            scanners, and ``"scanner"`` has them alone.
        seed: the same seed gives the same result, bit for bit, but for the times of ``plan_s``.
        noise: noise of the keypoint camera; None for the default.
        pipeline: pipeline for ``"pixels"`` instead of the shipped networks; its camera must be that
            of the images.
        observer: called after every control cycle with the frame and the stage, for example to
            render.
        fault: a fault of sensors, detections or odometry; frames keep the truth about the robot.
        renderer: renderer of the images: ``"tiny"``, ``"gl"``, or ``"auto"`` for the fastest
            available. Their pixels are nearly, but not exactly, the same.

    Raises:
        SimError: unknown scenario or perception, a planner without ``plan``, or a command that is
            not two finite numbers.
        NavError: unknown preset or unusable policy file.
        PerceptionError: for ``"pixels"``, when the shipped networks cannot be loaded.
    """
    if isinstance(scenario, str):
        scenario = ScenarioTemplate.shipped(scenario).for_seed(seed)
    policy_name, policy = _resolve_policy(policy)
    driver = check_planner(planner) if planner is not None else _default_planner(scenario)
    jitter_rng, camera_rng, timing_rng, people_rng = np.random.default_rng(seed).spawn(4)
    jitter = scenario.start_jitter_s
    offsets = jitter_rng.uniform(-jitter, jitter, len(scenario.workers))
    cone = AttentionCone()
    meter = SafetyMeter(NOVA_CARTER)
    senses = Perception.named(perception)
    with Stage(scenario, offsets, people_rng, renderer=renderer) as stage:
        sensing = Sensing(
            stage,
            senses,
            policy,
            cone,
            seed,
            noise=noise if noise is not None else KeypointNoise(),
            camera_rng=camera_rng,
            timing_rng=timing_rng,
            pipeline=pipeline,
            fault=fault,
        )
        adapter = NavAdapter(policy, NOVA_CARTER)
        goal = np.array([scenario.robot.goal_x_m, scenario.robot.goal_y_m])
        dt_s = 1.0 / scenario.control_hz
        frames: list[CrossingFrame] = []
        reached_s: float | None = None
        ticks_per_measurement = max(round(scenario.control_hz / _MEASURED_HZ), 1)
        margins: tuple[float, ...] = ()
        for tick in range(round(scenario.duration_s * scenario.control_hz)):
            t_s = tick * dt_s
            if tick % ticks_per_measurement == 0:
                margins = stage.measure(meter, ticks_per_measurement * dt_s)
            T_odom_camera = stage.amr.T_odom_camera
            truth = stage.truth(cone, T_odom_camera)
            state = stage.amr.state(t_s)
            sensed = sensing.step(t_s, truth)
            constraints = adapter.update(
                sensed.tracks, sensed.state, t_s, perception_stamp_s=sensed.stamp_s
            )
            asked_s = perf_counter()
            returned = driver.plan(sensed.state, goal, constraints, dt_s)
            plan_s = perf_counter() - asked_s
            command = checked_command(driver, returned, t_s)
            stage.amr.command(*command)
            frame = CrossingFrame(
                t_s,
                state,
                T_odom_camera,
                truth,
                tuple(observation for observation, _ in sensed.observed),
                tuple(worker for _, worker in sensed.observed),
                sensed.tracks,
                constraints,
                command,
                margins,
                tuple(meter.separations_m),
                sensed.scan_points_odom_m,
                plan_s,
            )
            frames.append(frame)
            if observer is not None:
                observer(frame, stage)
            if _at_goal(scenario, state, goal):
                reached_s = t_s
                break
            stage.advance(t_s + dt_s, meter)
        return _result(
            scenario,
            seed,
            policy_name,
            type(driver).__name__,
            perception,
            meter,
            frames,
            reached_s,
            stage.outcomes,
        )


def _default_planner(scenario: Scenario) -> LocalPlanner:
    straight = scenario.robot.straight_on_speed_mps
    if straight is not None:
        return StraightOn(straight)
    return SamplingPlanner(NOVA_CARTER, scenario.planner_boxes_odom_m)


def _resolve_policy(policy: AwarenessPolicy | str | Path) -> tuple[str, AwarenessPolicy]:
    """Return name and policy, from a policy, a preset's name or a file."""
    if isinstance(policy, AwarenessPolicy):
        return "custom", policy
    path = Path(policy)
    if path.suffix in (".yaml", ".yml"):
        return path.stem, AwarenessPolicy.from_yaml(path)
    if not isinstance(policy, str):
        raise SimError(f"policy must be a preset's name or a .yaml file, got {policy}")
    return policy, AwarenessPolicy.preset(policy)


def _at_goal(scenario: Scenario, state: RobotState, goal: FloatArray) -> bool:
    if scenario.robot.straight_on_speed_mps is not None:
        return False
    distance = float(np.linalg.norm(goal - state.position_odom_m))
    tolerance = scenario.robot.goal_tolerance_m
    return distance <= tolerance and abs(state.speed_mps) <= _GOAL_SPEED_MPS


def _result(
    scenario: Scenario,
    seed: int,
    policy: str,
    planner: str,
    perception: str,
    meter: SafetyMeter,
    frames: list[CrossingFrame],
    reached_s: float | None,
    people: tuple[PersonOutcome, ...],
) -> CrossingResult:
    causes = {contact.by for contact in meter.contacts}
    by = "robot" if "robot" in causes else "person" if causes else ""
    return CrossingResult(
        scenario=scenario.name,
        seed=seed,
        policy=policy,
        planner=planner,
        perception=perception,
        success=reached_s is not None and by != "robot",
        contact=bool(causes),
        contact_by=by,
        contacts=tuple(meter.contacts),
        min_separation_m=meter.min_separation_m,
        time_to_goal_s=reached_s,
        max_speed_within_2m_mps=meter.max_speed_near_mps,
        min_margin_m=meter.min_margin_m,
        violation_time_s=meter.violation_time_s,
        duration_s=frames[-1].t_s,
        frames=tuple(frames),
        people=people,
        scripted=len(scenario.workers),
    )
