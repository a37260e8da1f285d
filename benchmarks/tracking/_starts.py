"""Delays until a start is noticed of somebody who stood: simulated legs, detector and tracker.

A robot with two diagonal scanners stands, or drives at 0.5 to 1.2 m/s. Somebody stands 0.75 to 5 m
away and sets off at 1, 2 or 3 m/s² up to 1 to 1.6 m/s, two in five straight towards the robot. The
floor is empty but for them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from nav_adapter import max_speed_mps
from nav_adapter.policies import StandingPeople
from perception import PersonObservation
from perception.arrays import FloatArray
from perception.laser import (
    LegDetector,
    LegDetectorConfig,
    RobotMotion,
    merge_candidates,
    scan_points,
)
from sim_tests.actors.body import OnlineFootsteps, Worker, worker_names
from sim_tests.actors.robot import Amr, AmrLook
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraTiming
from sim_tests.world.hall import LAYOUTS
from sim_tests.world.scanner import DIAGONAL_SCANNERS, ScanScene, SimulatedScanner
from tracking import PersonTrack, PersonTracker, SensorConfig, TrackerConfig

RATES_HZ = (40.0, 25.0)
_NAMES = ("front", "rear")
_SETTLED_S = 1.5
_AFTER_S = 0.6
_NEAR_M = 0.7
_CLEAR_M = 0.65
_CHEST_M = 1.3
_ACCELERATION_MPS2 = 2.0
_WALKER_MPS = 1.6
_ROBOT = {"deceleration_mps2": 1.0, "reaction_time_s": 0.3, "clearance_m": 0.1}
_DISTANCES_M = (1.0, 1.5, 2.0, 3.0)


@dataclass(frozen=True, slots=True)
class StartFigures:
    """Figures of many starts.

    Attributes:
        standing_s: (N,) delays, √(2 moved_m / 2 m/s²) + moved_age_s, in frames in which the person
            stands; infinite where the tracker says nothing.
        short: frames after a start in which the person was faster, or farther, than this allows.
        moving: frames after a start.
        shown_s: (M,) time for which the velocity of the track still shows the person as standing.
        shown_m: (M,) their way in that time.
        noticed_s: (M,) time after which the delay exceeds 0.25 s or there is none.
        noticed_m: (M,) their way in that time.
    """

    standing_s: FloatArray
    short: int
    moving: int
    shown_s: FloatArray
    shown_m: FloatArray
    noticed_s: FloatArray
    noticed_m: FloatArray


@dataclass(frozen=True, slots=True)
class _Start:
    """One drawn situation; the robot is at the origin when the person sets off."""

    robot_mps: float
    turn_radps: float
    start_s: float
    acceleration_mps2: float
    top_mps: float
    place_m: FloatArray
    direction: FloatArray
    heading_rad: float

    def robot(self, stamp_s: float) -> RobotMotion:
        since_s, T = stamp_s - self.start_s, np.eye(4)
        yaw = self.turn_radps * since_s
        turning = abs(self.turn_radps) > 0.0
        x = self.robot_mps * (math.sin(yaw) / self.turn_radps if turning else since_s)
        y = self.robot_mps * (1.0 - math.cos(yaw)) / self.turn_radps if turning else 0.0
        T[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
        T[:2, 3] = x, y
        return RobotMotion(stamp_s, T, np.array([self.robot_mps, 0.0]), self.turn_radps)

    def walked(self, stamp_s: float) -> tuple[float, float, float]:
        """Return way, speed and acceleration."""
        since_s = max(stamp_s - self.start_s, 0.0)
        speeding_s = min(since_s, self.top_mps / self.acceleration_mps2)
        speed = self.acceleration_mps2 * speeding_s
        speeding = 0.0 < since_s < self.top_mps / self.acceleration_mps2
        way = 0.5 * speed * speeding_s + speed * (since_s - speeding_s)
        return way, speed, self.acceleration_mps2 if speeding else 0.0


def measure_starts(
    count: int, rate_hz: float, seed: int, *, noise_m: float = 0.015, merged: bool = False
) -> StartFigures:
    """Simulate ``count`` starts.

    Args:
        count: number of starts.
        rate_hz: of each of the two scanners.
        seed: of everything that is drawn.
        noise_m: standard deviation of a range.
        merged: one sensor whose frames hold the merged people of both scanners, not two sensors.
    """
    frames: list[tuple[float, float, float, float]] = []
    shown, noticed = [], []
    short = moving = 0
    for start, tracks in _episodes(count, rate_hz, seed, noise_m, merged):
        last_shown = first_noticed = None
        for stamp_s, track in tracks:
            since_s = stamp_s - start.start_s
            way_m, speed_mps, _ = start.walked(stamp_s)
            delay_s = _delay_s(track)
            if since_s <= 0.0:
                frames.append((delay_s, 0.0, 0.0, 0.0))
                continue
            moving += 1
            a = max(start.acceleration_mps2, _ACCELERATION_MPS2)
            needed_s = max(speed_mps / a, math.sqrt(2.0 * way_m / a))
            short += _delay_s(track, a) < needed_s
            if _shows_standing(track):
                last_shown = since_s, way_m
            if first_noticed is None and delay_s > StandingPeople().start_delay_s:
                first_noticed = since_s, way_m
        if last_shown is not None and first_noticed is not None:
            shown.append(last_shown)
            noticed.append(first_noticed)
    late, soon = np.array(shown).reshape(-1, 2), np.array(noticed).reshape(-1, 2)
    standing = np.array([frame[0] for frame in frames])
    return StartFigures(standing, short, moving, late[:, 0], late[:, 1], soon[:, 0], soon[:, 1])


def _delay_s(track: PersonTrack | None, acceleration_mps2: float = _ACCELERATION_MPS2) -> float:
    if track is None:
        return math.inf
    return track.moved_age_s + math.sqrt(2.0 * track.moved_m / acceleration_mps2)


def _shows_standing(track: PersonTrack | None) -> bool:
    if track is None:
        return False
    variance = float(np.linalg.eigvalsh(track.covariance_odom[2:, 2:])[-1])
    return StandingPeople().is_standing(float(np.hypot(*track.velocity_odom_mps)), variance)


def _episodes(
    count: int, rate_hz: float, seed: int, noise_m: float, merged: bool
) -> Iterator[tuple[_Start, list[tuple[float, PersonTrack | None]]]]:
    """Yield each start with the person's track in every frame."""
    rng = np.random.default_rng([seed, round(rate_hz), 83])
    with Warehouse(LAYOUTS["open"](), variant=0) as warehouse:
        people = [Worker(warehouse, look=name) for name in worker_names()]
        amr, pose = Amr(warehouse), [np.eye(4)]
        warehouse.add_actor(AmrLook(lambda: (pose[0], 0.0, 0.0)))
        scene = ScanScene(None, 0, warehouse.actors)
        changes = {"noise_std_m": noise_m, "timing": CameraTiming(rate_hz=rate_hz)}
        specs = [spec.model_copy(update=changes) for spec in DIAGONAL_SCANNERS]
        mountings = [spec.scanner(amr.profile.footprint_m) for spec in specs]
        for number in range(count):
            person, start = people[number % len(people)], _drawn(rng)
            scanners = [SimulatedScanner(scene, spec, rng) for spec in specs]
            detector = LegDetector(LegDetectorConfig(range_noise_m=noise_m))
            sensors = {name: SensorConfig(alignment_std_rad=0.0) for name in _NAMES}
            tracker = PersonTracker(TrackerConfig(standing_window_s=1.0), sensors=sensors)
            feet = OnlineFootsteps(person.gait, *start.place_m.tolist(), start.heading_rad)
            found: list[tuple[float, PersonTrack | None]] = []
            step_s = 0.5 / rate_hz
            waiting = []
            for tick in range(round((start.start_s + _AFTER_S) / step_s)):
                stamp_s, scanner = tick * step_s, tick % 2
                way_m, speed, speeding = start.walked(stamp_s)
                place = start.place_m + way_m * start.direction
                vx, vy = (speed * start.direction).tolist()
                ax, ay = (speeding * start.direction).tolist()
                body = (*place.tolist(), start.heading_rad)
                gait = feet.step(step_s if tick else 0.0, body, (vx, vy, 0.0), (ax, ay))
                person.place(place, start.heading_rad, feet=gait)
                motion = start.robot(stamp_s)
                pose[0] = motion.T_odom_base
                scan = scanners[scanner].scan(motion)
                seen = detector.detect(scan_points(scan, mountings[scanner], motion), scanner)
                name = _NAMES[scanner]
                if merged:
                    waiting.append(seen)
                    if scanner == 0:
                        continue
                    seen, name = merge_candidates(waiting), _NAMES[0]
                    waiting = []
                observed = [
                    _observation(one.position_odom_m, one.covariance_m2, one.score, stamp_s)
                    for one in seen
                ]
                tracks = tracker.update(observed, stamp_s, np.eye(4), sensor=name)
                if stamp_s >= _SETTLED_S:
                    found.append((stamp_s, _track_of(tracks, place)))
            person.place((warehouse.layout.x_min_m - 5.0 - number % len(people), 0.0), 0.0)
            yield start, found


def _drawn(rng: np.random.Generator) -> _Start:
    while True:
        robot_mps = float(rng.choice([0.0, 0.5, 0.8, 1.2]))
        turn = float(rng.choice([0.0, 0.0, 0.3, -0.3])) if robot_mps else 0.0
        distance, bearing = float(rng.uniform(0.75, 5.0)), float(rng.uniform(-math.pi, math.pi))
        place = distance * np.array([math.cos(bearing), math.sin(bearing)])
        towards = bearing + math.pi + float(rng.choice([0.0, 0.0, 0.5, -0.5, 1.5]))
        heading = towards if rng.random() < 0.8 else float(rng.uniform(-math.pi, math.pi))
        start = _Start(
            robot_mps,
            turn,
            float(rng.uniform(2.0, 3.5)),
            float(rng.choice([1.0, 2.0, 3.0])),
            float(rng.uniform(1.0, 1.6)),
            place,
            np.array([math.cos(towards), math.sin(towards)]),
            heading,
        )
        way = [start.robot(t).T_odom_base[:2, 3] for t in np.linspace(0.0, start.start_s, 40)]
        if np.linalg.norm(np.array(way) - place, axis=1).min() > _CLEAR_M:
            return start


def _track_of(tracks: tuple[PersonTrack, ...], place_m: FloatArray) -> PersonTrack | None:
    """Return the confirmed track near a place that says the least motion: the worst for safety."""
    near = [
        track
        for track in tracks
        if track.status == "confirmed" and np.linalg.norm(track.position_odom_m - place_m) < _NEAR_M
    ]
    return min(near, key=lambda track: track.moved_m, default=None)


def _observation(
    place_m: FloatArray, covariance_m2: FloatArray, score: float, stamp_s: float
) -> PersonObservation:
    covariance = np.diag([0.0, 0.0, 0.04])
    covariance[:2, :2] = covariance_m2
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=np.append(place_m, _CHEST_M),
        position_covariance_m2=covariance,
        gaze_camera=None,
        awareness=None,
        awareness_std=None,
        score=score,
        box_xyxy_px=None,
    )


def start_lines(name: str, figures: StartFigures) -> list[str]:
    """Return the figures as lines of text."""
    known = np.isfinite(figures.standing_s)
    finite = np.where(known, figures.standing_s, 9.0)
    quantiles = np.percentile(finite, [10, 50, 75, 90])
    told = " ".join(f"{one:6.3f}" if one < 9.0 else "   inf" for one in quantiles)
    return [
        f"{name:24s}{told}  {known.mean():6.1%}{figures.short:5d} of {figures.moving}",
        f"{'  velocity shows standing':24s} for {_spread(figures.shown_s, 's')} and "
        f"{_spread(figures.shown_m, 'm')}",
        f"{'  bound above 0.25 s':24s} after {_spread(figures.noticed_s, 's')} and "
        f"{_spread(figures.noticed_m, 'm')}",
    ]


def _spread(values: FloatArray, unit: str) -> str:
    middle, most = np.percentile(values, 50), values.max()
    return f"{middle:.2f} {unit} in the median, {most:.2f} {unit} at most"


def worth_lines() -> list[str]:
    """Return what a delay is worth at 2 m/s², for a robot of 1 m/s² and 0.3 s."""
    lines = [f"{'delay':>8s}{'saved':>9s}" + "".join(f"{f'{d:g} m':>9s}" for d in _DISTANCES_M)]
    for delay_s in (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, math.inf):
        saved_m = max(0.5 * _WALKER_MPS**2 / _ACCELERATION_MPS2 - _WALKER_MPS * delay_s, 0.0)
        limits = max_speed_mps(
            np.array(_DISTANCES_M),
            _WALKER_MPS,
            **_ROBOT,
            human_acceleration_mps2=_ACCELERATION_MPS2,
            start_delay_s=delay_s,
        )
        cells = "".join(f"{one:9.2f}" for one in limits)
        lines.append(f"{delay_s:6.2f} s{saved_m:7.2f} m{cells}")
    return lines
