"""A camera ahead and a laser scanner all around, on one robot, for the tests of fusion."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from tracking_scenes import FloatArray, camera_at, nearest, observe

from perception import Camera, PersonObservation
from tracking import (
    AwarenessFilterConfig,
    CameraView,
    PersonTrack,
    PersonTracker,
    ScannerView,
    SensorConfig,
    TrackerConfig,
)

LASER = "laser"
CAMERA_STD_M = (0.25, 0.06)  # along the ray and across it
LASER_STD_M = 0.05
MEMORY_S = 4.0
REMEMBERS = TrackerConfig(awareness=AwarenessFilterConfig(noticed_memory_s=MEMORY_S))

Event = tuple[float, list[PersonObservation], FloatArray, str]


def sensors(**changes: object) -> dict[str, SensorConfig]:
    return {LASER: SensorConfig(**{"view": ScannerView(), **changes})}


def both(config: TrackerConfig | None = None, **changes: object) -> PersonTracker:
    """Return a tracker with a camera of 120° ahead and a scanner."""
    camera = Camera.from_fov(640, 480, math.radians(120.0))
    return PersonTracker(config, view=CameraView(camera), sensors=sensors(**changes))


def laser_at(x_m: float = 0.0, y_m: float = 0.0, yaw_rad: float = 0.0) -> FloatArray:
    """Return T_odom_laser: x forward, y left, 0.2 m up."""
    T = np.eye(4)
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:3, 3] = x_m, y_m, 0.2
    return T


def seen_by_camera(
    place_m: Sequence[float] | FloatArray,
    stamp_s: float,
    *,
    T: FloatArray | None = None,
    ratio: float = 1.0,
    noise_m: FloatArray | None = None,
    awareness: float | None = None,
) -> PersonObservation:
    """Return what the camera says about a person whom it puts ``ratio`` times too far away."""
    T = camera_at() if T is None else T
    origin = T[:2, 3]
    offset = (np.asarray(place_m, dtype=float) - origin) * ratio
    ray = offset / np.linalg.norm(offset)
    across = np.array([-ray[1], ray[0]])
    along_m, across_m = CAMERA_STD_M
    covariance = along_m**2 * np.outer(ray, ray) + across_m**2 * np.outer(across, across)
    if noise_m is not None:
        offset = offset + ray * along_m * noise_m[0] + across * across_m * noise_m[1]
    return observe(
        origin + offset,
        stamp_s,
        T_odom_camera=T,
        covariance_odom_m2=covariance,
        awareness=awareness,
    )


def seen_by_laser(
    place_m: Sequence[float] | FloatArray,
    stamp_s: float,
    *,
    T: FloatArray | None = None,
    noise_m: FloatArray | None = None,
) -> PersonObservation:
    T = laser_at() if T is None else T
    place = np.asarray(place_m, dtype=float)
    if noise_m is not None:
        place = place + LASER_STD_M * noise_m
    return observe(place, stamp_s, T_odom_camera=T, covariance_odom_m2=LASER_STD_M**2)


@dataclass
class Rig:
    """Two sensors that observe people whose places are functions of time.

    ``faces`` gives α of each person at a time, or None for no usable face.
    """

    people: Sequence[Callable[[float], Sequence[float]]]
    faces: Callable[[int, float], float | None] = lambda _person, _now: None
    ratios: Sequence[float] | None = None
    camera_s: float = 0.1
    laser_s: float = 0.04
    camera_latency_s: float = 0.0
    laser_latency_s: float = 0.0
    yaw_error_rad: float = 0.0
    detection: tuple[float, float] = (0.9, 0.95)
    camera_sees: Callable[[FloatArray], bool] = lambda p: bool(abs(math.atan2(p[1], p[0])) < 1.0)
    laser_sees: Callable[[int, float], bool] = lambda _person, _now: True
    seed: int = 0

    def events(self, duration_s: float) -> list[Event]:
        """Return all frames in the order in which they arrive."""
        rng = np.random.default_rng(self.seed)
        arriving: list[tuple[float, Event]] = []
        for now in np.arange(0.0, duration_s, self.camera_s).tolist():
            people = []
            for index, place in enumerate(self.people):
                p = np.asarray(place(now), dtype=float)
                if rng.uniform() < self.detection[0] and self.camera_sees(p):
                    ratio = 1.0 if self.ratios is None else self.ratios[index]
                    people.append(
                        seen_by_camera(
                            p,
                            now,
                            ratio=ratio,
                            noise_m=rng.normal(size=2),
                            awareness=self.faces(index, now),
                        )
                    )
            arriving.append((now + self.camera_latency_s, (now, people, camera_at(), "camera")))
        true, assumed = laser_at(), laser_at(yaw_rad=self.yaw_error_rad)
        turn = assumed[:2, :2] @ true[:2, :2].T
        for now in np.arange(0.007, duration_s, self.laser_s).tolist():
            people = [
                seen_by_laser(turn @ np.asarray(place(now)), now, noise_m=rng.normal(size=2))
                for index, place in enumerate(self.people)
                if rng.uniform() < self.detection[1] and self.laser_sees(index, now)
            ]
            arriving.append((now + self.laser_latency_s, (now, people, laser_at(), LASER)))
        return [event for _, event in sorted(arriving, key=lambda one: one[0])]


def play(tracker: PersonTracker, events: Sequence[Event]) -> tuple[PersonTrack, ...]:
    tracks: tuple[PersonTrack, ...] = ()
    for stamp_s, people, T, sensor in events:
        tracks = tracker.update(people, stamp_s, T, sensor=sensor)
    return tracks


class Scene:
    """A robot with camera and scanner before one person; time goes on with :meth:`run`."""

    def __init__(self, tracker: PersonTracker | None = None, *, seed: int = 0) -> None:
        self.tracker = both(REMEMBERS) if tracker is None else tracker
        self.rng = np.random.default_rng(seed)
        self.tick = 0
        self.place: FloatArray = np.array([3.0, 0.5])
        self.tracks: tuple[PersonTrack, ...] = ()

    @property
    def now(self) -> float:
        return 0.02 * self.tick

    def run(
        self,
        duration_s: float,
        *,
        alpha: float | None = None,
        camera: bool = True,
        laser: bool = True,
        velocity: tuple[float, float] = (0.0, 0.0),
        others: tuple[tuple[float, float], ...] = (),
        until: Callable[[PersonTrack], bool] | None = None,
    ) -> PersonTrack:
        """Advance; the camera sees the person or not, with α or without a usable face."""
        for _ in range(round(duration_s / 0.02)):
            self.tick += 1
            self.place = self.place + 0.02 * np.asarray(velocity)
            noise = 0.7 * self.rng.normal(size=(2, 2))
            if self.tick % 5 == 0:
                seen = [seen_by_camera(self.place, self.now, noise_m=noise[0], awareness=alpha)]
                self.tracks = self.tracker.update(seen if camera else [], self.now, camera_at())
            if self.tick % 2 == 0:
                places = [self.place + 0.05 * noise[1], *others]
                scan = [seen_by_laser(place, self.now) for place in places]
                self.tracks = self.tracker.update(
                    scan if laser else scan[1:], self.now, laser_at(), sensor=LASER
                )
            if until is not None and until(self.track):
                break
        return self.track

    @property
    def track(self) -> PersonTrack:
        return nearest(self.tracks, self.place)
