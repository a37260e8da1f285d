"""The closed loop of one crossing: camera, perception, tracker, adapter, planner and physics."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, RobotState
from perception import AttentionCone, AwarenessPipeline, Camera
from perception.arrays import FloatArray
from tracking import CameraView, PersonTrack, PersonTracker, SurroundView, TrackerConfig

from ..actors.behaviour import PersonOutcome
from ..actors.robot import NOVA_CARTER
from ..scenario import Scenario, ScenarioTemplate
from ..world.camera import CameraTiming
from ..world.errors import SimError
from ..world.render import RendererName
from ._command import check_planner, checked_command
from ._metrics import SafetyMeter
from ._result import CrossingFrame, CrossingResult
from ._stage import Stage
from .eyes import (
    ORACLE,
    KeypointNoise,
    MapView,
    Sighting,
    TimedEyes,
    WorkerObservations,
    make_eyes,
    pixel_timing,
)
from .faults import Fault, FaultInjection
from .planner import LocalPlanner, SamplingPlanner, StraightOn

Observer = Callable[[CrossingFrame, Stage], None]

# Within the goal tolerance the goal counts as reached at this speed or less.
_GOAL_SPEED_MPS: Final = 0.2
# Rate of the separation measurements; contacts are checked in every physics step.
_MEASURED_HZ: Final = 20.0
# Age of perception before the first image has arrived: older than any policy accepts.
_NEVER_S: Final = 1.0e6
# An image without a person is no evidence about people farther away than this.
_DETECTION_RANGE_M: Final = 10.0


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
            by a rack.
        seed: the same seed gives the same result, bit for bit.
        noise: noise of the keypoint camera; None for the default.
        pipeline: pipeline for ``"pixels"`` instead of the shipped networks; its camera must be that
            of the images.
        observer: called after every control cycle with the frame and the stage, for example to
            render.
        fault: a fault of camera, detections or odometry; frames keep the truth about the robot.
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
    injection = FaultInjection(fault, seed)
    with Stage(scenario, offsets, people_rng, renderer=renderer) as stage:
        camera_model, timing = _camera_and_timing(scenario, perception)
        eyes = make_eyes(
            perception,
            stage,
            camera_model,
            cone,
            noise if noise is not None else KeypointNoise(),
            camera_rng,
            pipeline,
            injection.T_camera_assumed,
        )
        camera = injection.eyes(TimedEyes(eyes, timing, timing_rng), camera_model)
        odometry = injection.odometry()
        tracker = _make_tracker(perception, policy, stage, camera_model)
        adapter = NavAdapter(policy, NOVA_CARTER)
        goal = np.array([scenario.robot.goal_x_m, scenario.robot.goal_y_m])
        dt_s = 1.0 / scenario.control_hz
        frames: list[CrossingFrame] = []
        newest_s = -_NEVER_S
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
            known = odometry.update(state, T_odom_camera)
            sightings = camera.look(t_s, T_odom_camera, known.T_odom_camera, truth)
            observed, newest_s, tracks = _update_tracker(tracker, sightings, newest_s)
            if newest_s != t_s:
                tracks = tracker.predict(t_s)
            constraints = adapter.update(tracks, known.state, t_s, perception_stamp_s=newest_s)
            returned = driver.plan(known.state, goal, constraints, dt_s)
            command = checked_command(driver, returned, t_s)
            stage.amr.command(*command)
            frame = CrossingFrame(
                t_s,
                state,
                T_odom_camera,
                truth,
                tuple(observation for observation, _ in observed),
                tuple(worker for _, worker in observed),
                tracks,
                constraints,
                command,
                margins,
                tuple(meter.separations_m),
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


def _update_tracker(
    tracker: PersonTracker, sightings: tuple[Sighting, ...], newest_s: float
) -> tuple[WorkerObservations, float, tuple[PersonTrack, ...]]:
    """Update the tracker with the images that have arrived.

    Returns:
        The observations of the newest image if it is newer than ``newest_s`` (else none), the
        newest stamp so far, and the tracks of the last update (none without an update).
    """
    observed: WorkerObservations = ()
    tracks: tuple[PersonTrack, ...] = ()
    for sighting in sightings:
        if sighting.stamp_s == newest_s:
            continue  # the same image again is no new evidence
        if newest_s - sighting.stamp_s > tracker.config.max_lag_s:
            continue  # too old for the tracker to go back to
        observations = tuple(observation for observation, _ in sighting.observations)
        tracks = tracker.update(observations, sighting.stamp_s, sighting.T_odom_camera)
        if sighting.stamp_s > newest_s:
            observed, newest_s = sighting.observations, sighting.stamp_s
    return observed, newest_s, tracks


def _camera_and_timing(scenario: Scenario, perception: str) -> tuple[Camera, CameraTiming]:
    spec = scenario.camera
    if perception == "pixels":
        return spec.camera(spec.picture_scale), pixel_timing(spec.timing)
    return spec.camera(), spec.timing


def _make_tracker(
    perception: str, policy: AwarenessPolicy, stage: Stage, camera: Camera
) -> PersonTracker:
    config = TrackerConfig(awareness=policy.filter)
    if perception == "truth":  # no limits of range or field of view
        return PersonTracker(config)
    if perception == ORACLE:
        return PersonTracker(config, view=MapView.of(stage.warehouse))
    views = stage.scenario.camera.flat_views(camera)
    flat = CameraView(camera, max_range_m=_DETECTION_RANGE_M)
    view = SurroundView((flat,) * len(views), tuple(each.rotation_camera_view for each in views))
    return PersonTracker(
        config, view=MapView.of(stage.warehouse, flat if len(views) == 1 else view)
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
