"""One closed-loop crossing: camera to awareness to track to constraints to planner to wheels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile, RobotState
from perception import AttentionCone, AwarenessPipeline, Camera, PersonObservation
from perception.arrays import FloatArray
from tracking import CameraView, PersonTrack, PersonTracker, SurroundView, TrackerConfig

from ..actors.behaviour import PersonOutcome
from ..actors.robot import NOVA_CARTER
from ..scenario import Scenario, ScenarioTemplate
from ..world.camera import CameraTiming
from ..world.errors import SimError
from ..world.render import RendererName
from ._metrics import ContactEvent, SafetyMeter
from ._stage import Stage, TrueView
from .eyes import ORACLE, KeypointNoise, MapView, Sighting, TimedEyes, make_eyes, pixel_timing
from .faults import Fault, FaultInjection
from .planner import LocalPlanner, SamplingPlanner

_CLOSE_ENOUGH_TO_STOP_MPS: Final = 0.2
# Separation is measured this often; contacts are looked for in every physics step.
_MEASURED_HZ: Final = 20.0
# Before the first frame has arrived, perception is this old: older than any policy allows.
_NEVER_S: Final = 1.0e6
# Nobody farther away is missed when a frame does not show them.
_SEEN_WITHIN_M: Final = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class CrossingFrame:
    """All that was seen, thought and commanded in one control cycle.

    ``observed_workers[i]`` is the worker that ``observations[i]`` shows, −1 for none of them;
    ``margins_m`` and ``separations_m`` hold each worker's separation margin and the distance
    between its surface and the robot's (a lower bound with centres more than 4 m apart), as last
    measured, which is in every frame up to 20 a second.
    """

    t_s: float
    robot_state: RobotState
    T_odom_camera: FloatArray
    truth: tuple[TrueView, ...]
    observations: tuple[PersonObservation, ...]
    observed_workers: tuple[int, ...]
    tracks: tuple[PersonTrack, ...]
    constraints: NavConstraints
    command: tuple[float, float]
    margins_m: tuple[float, ...]
    separations_m: tuple[float, ...] = ()

    def observation_of(self, worker: int) -> PersonObservation | None:
        """What was seen of a worker in this frame, or None."""
        for observation, index in zip(self.observations, self.observed_workers, strict=True):
            if index == worker:
                return observation
        return None


@dataclass(frozen=True, slots=True, eq=False)
class CrossingResult:
    """The outcome of one crossing.

    Attributes:
        scenario: its name.
        seed: of the episode's random generator.
        policy: name of the policy.
        planner: name of the planner's class.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        success: the goal was reached and the robot touched nobody by its own motion.
        contact: robot and a person touched.
        contact_by: ``"robot"`` if any contact was the robot moving into a person, ``"person"`` if
            only people walked into it, else empty.
        contacts: every contact.
        min_separation_m: smallest distance between the surfaces of robot and person.
        time_to_goal_s: None when the goal was not reached.
        max_speed_within_2m_mps: the robot's highest speed with a person's surface within 2 m.
        min_margin_m: smallest separation margin S − S_p at a moving robot.
        violation_time_s: how long the margin was negative at a moving robot.
        duration_s: simulated time.
        frames: one a control cycle.
        people: what became of those who react: ``people[i]`` is person ``i`` of the scenario, and
            number ``scripted + i`` of everybody.
        scripted: how many follow a script; they come first wherever all are listed.
        robot: what drove.
    """

    scenario: str
    seed: int
    policy: str
    planner: str
    perception: str
    success: bool
    contact: bool
    contact_by: str
    contacts: tuple[ContactEvent, ...]
    min_separation_m: float
    time_to_goal_s: float | None
    max_speed_within_2m_mps: float
    min_margin_m: float
    violation_time_s: float
    duration_s: float
    frames: tuple[CrossingFrame, ...]
    people: tuple[PersonOutcome, ...] = ()
    scripted: int = 0
    robot: RobotProfile = NOVA_CARTER


class StraightOn:
    """Drives straight ahead at one speed whatever happens: the robot of the paper's encounter.

    Args:
        speed_mps: > 0.
    """

    def __init__(self, speed_mps: float) -> None:
        self._speed_mps = speed_mps

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return the same speed and no turn."""
        return self._speed_mps, 0.0


Observer = Callable[[CrossingFrame, Stage], None]


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
        planner: the local planner; default the reference :class:`SamplingPlanner` (a scenario that
            drives straight on needs none).
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``: the rendered camera through the
            shipped networks, at 10 frames a second where the scenario names no rate; ``"oracle"``
            is the truth about everybody whom no rack hides from the robot.
        seed: the same seed gives the same result, bit for bit.
        noise: of the keypoint camera.
        pipeline: what pixels go through instead of the shipped networks; it has the camera of the
            pictures.
        observer: called after every control cycle with the frame and the stage, e.g. to render.
        fault: what is wrong with camera and odometry; frames keep the truth about the robot.
        renderer: what draws pictures: ``"tiny"``, ``"gl"``, or ``"auto"`` for the
            quickest that works here. Two of them draw nearly, not exactly, the same pixels.

    Raises:
        SimError: unknown scenario or perception, or an invalid command from the planner.
        NavError: unknown preset or unusable policy file.
        PerceptionError: for pixels, when the shipped networks cannot be loaded.
    """
    if isinstance(scenario, str):
        scenario = ScenarioTemplate.shipped(scenario).for_seed(seed)
    policy_name, policy = _resolve(policy)
    jitter_rng, camera_rng, timing_rng, people_rng = np.random.default_rng(seed).spawn(4)
    jitter = scenario.start_jitter_s
    offsets = jitter_rng.uniform(-jitter, jitter, len(scenario.workers))
    cone = AttentionCone()
    meter = SafetyMeter(NOVA_CARTER)
    injection = FaultInjection(fault, seed)
    with Stage(scenario, offsets, people_rng, renderer=renderer) as stage:
        driver = planner if planner is not None else _default_planner(scenario, stage)
        camera_model, timing = _camera(scenario, perception)
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
        tracker = _tracker(perception, policy, stage, camera_model)
        adapter = NavAdapter(policy, NOVA_CARTER)
        goal = np.array([scenario.robot.goal_x_m, scenario.robot.goal_y_m])
        dt_s = 1.0 / scenario.control_hz
        frames: list[CrossingFrame] = []
        seen_s = -_NEVER_S
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
            known = odometry.known(state, T_odom_camera)
            arrived = camera.look(t_s, T_odom_camera, known.T_odom_camera, truth)
            seen, seen_s, tracks = _take_in(tracker, arrived, seen_s)
            if seen_s != t_s:
                tracks = tracker.predict(t_s)
            constraints = adapter.update(tracks, known.state, t_s, perception_stamp_s=seen_s)
            command = driver.plan(known.state, goal, constraints, dt_s)
            stage.amr.command(*command)
            frame = CrossingFrame(
                t_s,
                state,
                T_odom_camera,
                truth,
                tuple(observation for observation, _ in seen),
                tuple(index for _, index in seen),
                tracks,
                constraints,
                command,
                margins,
                tuple(meter.separations_m),
            )
            frames.append(frame)
            if observer is not None:
                observer(frame, stage)
            if _arrived(scenario, state, goal):
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


def _take_in(
    tracker: PersonTracker, sightings: tuple[Sighting, ...], seen_s: float
) -> tuple[tuple[tuple[PersonObservation, int], ...], float, tuple[PersonTrack, ...]]:
    """Give frames to the tracker.

    Returns:
        What the newest of them shows if it is newer than ``seen_s``, the newest stamp of all, and
        the tracks if there were frames.
    """
    seen: tuple[tuple[PersonObservation, int], ...] = ()
    tracks: tuple[PersonTrack, ...] = ()
    for sighting in sightings:
        if sighting.stamp_s == seen_s:
            continue  # the same picture again is no new evidence
        if seen_s - sighting.stamp_s > tracker.config.max_lag_s:
            continue  # too old for the tracker to go back to
        observations = tuple(observation for observation, _ in sighting.seen)
        tracks = tracker.update(observations, sighting.stamp_s, sighting.T_odom_camera)
        if sighting.stamp_s > seen_s:
            seen, seen_s = sighting.seen, sighting.stamp_s
    return seen, seen_s, tracks


def _camera(scenario: Scenario, perception: str) -> tuple[Camera, CameraTiming]:
    spec = scenario.camera
    if perception == "pixels":
        return spec.camera(spec.picture_scale), pixel_timing(spec.timing)
    return spec.camera(), spec.timing


def _tracker(
    perception: str, policy: AwarenessPolicy, stage: Stage, camera: Camera
) -> PersonTracker:
    config = TrackerConfig(awareness=policy.filter)
    if perception == "truth":  # which sees all around
        return PersonTracker(config)
    if perception == ORACLE:
        return PersonTracker(config, view=MapView.of(stage.warehouse))
    views = stage.scenario.camera.flat_views(camera)
    flat = CameraView(camera, max_range_m=_SEEN_WITHIN_M)
    view = SurroundView((flat,) * len(views), tuple(each.rotation_camera_view for each in views))
    return PersonTracker(
        config, view=MapView.of(stage.warehouse, flat if len(views) == 1 else view)
    )


def _default_planner(scenario: Scenario, stage: Stage) -> LocalPlanner:
    straight = scenario.robot.straight_on_speed_mps
    if straight is not None:
        return StraightOn(straight)
    return SamplingPlanner(NOVA_CARTER, scenario.planner_boxes_odom_m)


def _resolve(policy: AwarenessPolicy | str | Path) -> tuple[str, AwarenessPolicy]:
    """The name and the policy itself, from a policy, a preset's name or a file."""
    if isinstance(policy, AwarenessPolicy):
        return "custom", policy
    path = Path(policy)
    if path.suffix in (".yaml", ".yml"):
        return path.stem, AwarenessPolicy.from_yaml(path)
    if not isinstance(policy, str):
        raise SimError(f"policy must be a preset's name or a .yaml file, got {policy}")
    return policy, AwarenessPolicy.preset(policy)


def _arrived(scenario: Scenario, state: RobotState, goal: FloatArray) -> bool:
    if scenario.robot.straight_on_speed_mps is not None:
        return False
    distance = float(np.linalg.norm(goal - state.position_odom_m))
    tolerance = scenario.robot.goal_tolerance_m
    return distance <= tolerance and abs(state.speed_mps) <= _CLOSE_ENOUGH_TO_STOP_MPS


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
