"""Faults of the camera, of the people detected in its images, and of odometry."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np
from pydantic import Field

from perception import PersonObservation
from perception.arrays import FloatArray, ImageRgb

from ...world.camera import CameraTiming
from .._messages import NOBODY, Change, Delivery, OdometryReading, Sighting, WorkerObservations
from ._sensor_fault import (
    Appearances,
    Appearing,
    ImageFault,
    OdometryFault,
    Onset,
    Outage,
    PictureFault,
    SensorFault,
    Start,
)

_GHOST_RANGE_M: Final = (1.0, 8.0)
_GHOST_CHEST_HEIGHT_M: Final = 1.3
_GHOST_NOISE_M: Final = 0.05
_GHOST_STD_M: Final = 0.1
_GHOST_AWARENESS_STD: Final = 0.1


class BlackCamera(Onset, PictureFault):
    """Pictures that are black from a time on, while their stamps go on.

    The robot takes no such picture for a view, so no image arrives.
    """

    key: ClassVar[str] = "black_camera"

    def begin(self, start: Start) -> Change[ImageRgb]:
        """Return the change of pictures in one episode."""
        begins_s = self.begins_s(float(start.rng(3).random()))

        def change(taken: Delivery[ImageRgb]) -> Delivery[ImageRgb]:
            if taken.taken_s < begins_s:
                return taken
            return replace(taken, message=np.zeros_like(taken.message))

        return change


class Misses(ImageFault):
    """Observations of people that are lost, each independently.

    Attributes:
        miss_rate: share of the observations that are lost.
    """

    miss_rate: float = Field(ge=0.0, le=1.0)

    def begin(self, start: Start) -> Change[Sighting]:
        """Return the change of images in one episode."""
        rng = start.rng(0, 0, 0)

        def change(image: Delivery[Sighting]) -> Delivery[Sighting]:
            observations = image.message.observations
            draws = rng.random(len(observations)).tolist()
            kept = zip(observations, draws, strict=True)
            return _with(image, (each for each, draw in kept if draw >= self.miss_rate))

        return change


class Bursts(ImageFault):
    """Periods in which a person is not detected, independent for each person.

    Attributes:
        for_s: mean duration, exponentially distributed; 0 for none.
        every_s: mean time between two of them, exponentially distributed.
    """

    key: ClassVar[str] = "bursts"
    for_s: float = Field(default=0.0, ge=0.0, le=600.0)
    every_s: float = Field(default=3.0, gt=0.0, le=3600.0)

    def begin(self, start: Start) -> Change[Sighting]:
        """Return the change of images in one episode."""
        # Seeded by index, so that the bursts of a person do not depend on the others.
        seed = int(start.rng(0, 0, 1).integers(2**63))
        people: dict[int, _PersonBursts] = {}

        def change(image: Delivery[Sighting]) -> Delivery[Sighting]:
            kept = []
            for observation, worker in image.message.observations:
                if worker not in people:
                    people[worker] = _PersonBursts(self, np.random.default_rng([seed, worker + 1]))
                if not people[worker].hide(image.taken_s):
                    kept.append((observation, worker))
            return _with(image, kept)

        return change


class _PersonBursts:
    """Alternating times in and out of a burst, both exponentially distributed."""

    def __init__(self, bursts: Bursts, rng: np.random.Generator) -> None:
        self._rng = rng
        self._mean_s = {True: bursts.for_s, False: bursts.every_s}
        # Start in the stationary distribution; exponential times have no memory.
        self._hidden = bool(rng.random() < bursts.for_s / (bursts.for_s + bursts.every_s))
        self._until_s = float(rng.exponential(self._mean_s[self._hidden]))

    def hide(self, t_s: float) -> bool:
        """Return whether the person is hidden at ``t_s``, which grows from call to call."""
        while self._until_s <= t_s:
            self._hidden = not self._hidden
            self._until_s += float(self._rng.exponential(self._mean_s[self._hidden]))
        return self._hidden


class WrongAwareness(ImageFault):
    """Observed α that is too high, too low, or less certain than it is said to be.

    Attributes:
        awareness_bias: added to every observed α; the sum is clipped to [0, 1].
        awareness_std_factor: factor on the standard deviation of every observed α; below 1 is
            over-confident.
    """

    awareness_bias: float = Field(default=0.0, ge=-1.0, le=1.0)
    awareness_std_factor: float = Field(default=1.0, ge=0.0, le=100.0)

    def begin(self, start: Start) -> Change[Sighting]:
        """Return the change of images in one episode."""

        def change(image: Delivery[Sighting]) -> Delivery[Sighting]:
            rows = image.message.observations
            return _with(image, ((self._biased(each), worker) for each, worker in rows))

        return change

    def _biased(self, observation: PersonObservation) -> PersonObservation:
        alpha, std = observation.awareness, observation.awareness_std
        if alpha is None or std is None:
            return observation
        return replace(
            observation,
            awareness=min(max(alpha + self.awareness_bias, 0.0), 1.0),
            awareness_std=std * self.awareness_std_factor,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Ghost:
    position_odom_m: FloatArray
    awareness: float | None


class Ghosts(Appearing, ImageFault):
    """False detections of people.

    A ghost stands where it appeared in the camera's view, 1 m to 8 m away. Half of them have a
    face, with an α uniformly distributed in [0, 1]; the others give no evidence of awareness.
    """

    key: ClassVar[str] = "ghosts"
    for_s: float = Field(default=0.5, gt=0.0, le=600.0)

    def begin(self, start: Start) -> Change[Sighting]:
        """Return the change of images in one episode."""
        half_fov_rad = math.atan(0.5 * start.camera.width_px / start.camera.fx_px)
        rng = start.rng(0, 0, 2)
        ghosts: Appearances[_Ghost] = Appearances(self, rng)

        def change(image: Delivery[Sighting]) -> Delivery[Sighting]:
            t_s, T = image.taken_s, image.T_odom_sensor
            present = ghosts.at(t_s, lambda since_s: self._new(since_s, T, half_fov_rad, rng))
            seen = (_seen_ghost(each, t_s, T, half_fov_rad, rng) for each in present)
            false = ((each, NOBODY) for each in seen if each is not None)
            return _with(image, (*image.message.observations, *false))

        return change

    def _new(
        self, t_s: float, T_odom_camera: FloatArray, half_fov_rad: float, rng: np.random.Generator
    ) -> tuple[float, _Ghost]:
        """Return the time until which a new ghost stays, and the ghost."""
        distance, bearing, life, alpha = rng.random(4).tolist()
        nearest_m, farthest_m = _GHOST_RANGE_M
        distance_m = nearest_m + distance * (farthest_m - nearest_m)
        angle = (2.0 * bearing - 1.0) * half_fov_rad
        ahead, right = T_odom_camera[:2, 2], T_odom_camera[:2, 0]
        position = T_odom_camera[:3, 3].copy()
        position[:2] += distance_m * (math.cos(angle) * ahead + math.sin(angle) * right)
        position[2] = _GHOST_CHEST_HEIGHT_M
        ghost = _Ghost(position, 2.0 * alpha if alpha < 0.5 else None)
        return t_s - self.for_s * math.log1p(-life), ghost


def _seen_ghost(
    ghost: _Ghost,
    stamp_s: float,
    T_odom_camera: FloatArray,
    half_fov_rad: float,
    rng: np.random.Generator,
) -> PersonObservation | None:
    """Return the observation of a ghost; None outside the field of view."""
    noise = rng.normal(0.0, _GHOST_NOISE_M, 3)
    position = (ghost.position_odom_m - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3] + noise
    if position[2] <= 0.3 or abs(math.atan2(position[0], position[2])) > half_fov_rad:
        return None
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=position,
        position_covariance_m2=_GHOST_STD_M**2 * np.eye(3),
        gaze_camera=None,
        awareness=ghost.awareness,
        awareness_std=None if ghost.awareness is None else _GHOST_AWARENESS_STD,
        score=0.5,
    )


class FrozenCamera(Outage, ImageFault):
    """A camera that delivers its last image again and again.

    With fresh stamps people seem to stand still in the image, and so to move with the robot.
    """

    key: ClassVar[str] = "frozen_camera"

    def begin(self, start: Start) -> Change[Sighting]:
        """Return the change of images in one episode."""
        return self.frozen(float(start.rng(0, 2).random()), _image_restamped)


def _image_restamped(last: Sighting, image: Sighting) -> Sighting:
    rows = ((replace(each, stamp_s=image.stamp_s), worker) for each, worker in last.observations)
    return replace(image, observations=tuple(rows))


class LateImages(ImageFault):
    """Images that arrive late or not at all, as :class:`CameraTiming` describes it.

    Attributes:
        drop_rate: share of the images that never arrive.
        latency_s: delay of every image.
        latency_jitter_s: largest additional delay, uniformly distributed.
    """

    drop_rate: float = Field(default=0.0, ge=0.0, le=1.0)
    latency_s: float = Field(default=0.0, ge=0.0, le=10.0)
    latency_jitter_s: float = Field(default=0.0, ge=0.0, le=10.0)

    def begin(self, start: Start) -> Change[Sighting]:
        """Return the change of images in one episode."""
        rng = start.rng(0, 1)
        timing = CameraTiming(**self.model_dump())

        def change(image: Delivery[Sighting]) -> Delivery[Sighting] | None:
            arrives_s = timing.delivery_s(image.arrives_s, rng)
            return None if arrives_s is None else replace(image, arrives_s=arrives_s)

        return change


def _with(
    image: Delivery[Sighting], observations: Iterable[tuple[PersonObservation, int]]
) -> Delivery[Sighting]:
    rows: WorkerObservations = tuple(observations)
    return replace(image, message=replace(image.message, observations=rows))


class LateOdometry(OdometryFault):
    """Pose and speed of the robot that are known late, with their true stamps.

    Images are placed with the newest known pose.

    Attributes:
        odometry_delay_s: age of the newest message.
    """

    odometry_delay_s: float = Field(ge=0.0, le=10.0)

    def begin(self, start: Start) -> Change[OdometryReading]:
        """Return the change of odometry in one episode."""
        return lambda taken: replace(taken, arrives_s=taken.arrives_s + self.odometry_delay_s)


class LostOdometry(Outage, OdometryFault):
    """Odometry that fails for a while: pose and speed stay at the last known ones."""

    key: ClassVar[str] = "lost_odometry"

    def begin(self, start: Start) -> Change[OdometryReading]:
        """Return the change of odometry in one episode."""
        return self.frozen(float(start.rng(1).random()), _odometry_restamped)


def _odometry_restamped(last: OdometryReading, taken: OdometryReading) -> OdometryReading:
    return replace(last, state=replace(last.state, stamp_s=taken.state.stamp_s))


class WrongMounting(OdometryFault):
    """A camera that does not look where the robot assumes it to look.

    Attributes:
        pitch_error_deg: the robot assumes that its camera looks this much higher than it does.
        yaw_error_deg: the same to the left.
    """

    pitch_error_deg: float = Field(default=0.0, ge=-45.0, le=45.0)
    yaw_error_deg: float = Field(default=0.0, ge=-180.0, le=180.0)

    def begin(self, start: Start) -> Change[OdometryReading]:
        """Return the change of odometry in one episode."""
        # About the optical axes x (positive looks up) and y (negative looks left).
        pitch, yaw = math.radians(self.pitch_error_deg), -math.radians(self.yaw_error_deg)
        cos_p, sin_p, cos_y, sin_y = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos_p, -sin_p], [0.0, sin_p, cos_p]])
        about_y = np.array([[cos_y, 0.0, sin_y], [0.0, 1.0, 0.0], [-sin_y, 0.0, cos_y]])
        T_camera_assumed = np.eye(4)
        T_camera_assumed[:3, :3] = about_y @ about_x

        def change(taken: Delivery[OdometryReading]) -> Delivery[OdometryReading]:
            reading = taken.message
            T_odom_camera = reading.T_odom_camera @ T_camera_assumed
            return replace(taken, message=OdometryReading(reading.state, T_odom_camera))

        return change


#: In the order in which they act, from the lens to the tracker.
CAMERA_FAULTS: Final[tuple[type[SensorFault], ...]] = (
    BlackCamera,
    Misses,
    Bursts,
    WrongAwareness,
    Ghosts,
    FrozenCamera,
    LateImages,
    LateOdometry,
    LostOdometry,
    WrongMounting,
)
