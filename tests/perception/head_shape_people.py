"""People whose heads have shapes of their own, to judge the covariance of PnP head poses.

People stand before a camera, turned and with their heads turned in every direction. Their heads
have shapes of their own, the estimator knows the template. Keypoints have pixel noise, and those on
the far side of a head are not seen. The figures are the NEES of the rotation (3 on average if the
covariance is right) and the share of errors within its 95 % ellipsoid.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from perception import Camera, PersonKeypoints, PnpHeadPoseEstimator
from perception.anthropometry import HEAD_TEMPLATE_M
from perception.arrays import FloatArray
from sim_tests.actors.body import load_worker, worker_names

#: Heads of the shipped workers; heads drawn dimension by dimension; the template itself.
Heads = Literal["workers", "drawn", "template"]
#: Directions of heads: all round, or within 45° of a profile.
Turned = Literal["all round", "profile"]

CAMERA: Final = Camera.from_fov(640, 480, math.radians(60.0))
#: χ² of three degrees of freedom that is exceeded in 5 %.
BOUND_95: Final = 7.815

# Forward, left and up of a body in the axes of a camera that it faces, and of a head in a body's.
_CAMERA_FROM_BODY: Final = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
_BODY_FROM_HEAD: Final = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
# Directions that nose, eyes and ears face in the head, and the angles to the camera from which on
# they are out of sight, with their spread.
_FACING: Final = np.array(
    [[0.0, 1.0, 0.0], [0.0, 0.87, -0.5], [0.0, 0.87, 0.5], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]
)
_SIGHT_DEG: Final = np.array([95.0, 95.0, 95.0, 105.0, 105.0])
_SIGHT_STD_DEG: Final = 5.0
_LIFT_STD_M: Final = 0.045


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """A person's keypoints and the rotation (3, 3) of the head in the camera frame."""

    keypoints: PersonKeypoints
    rotation_camera_head: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """NEES of the rotation of each head that got a pose, and the number of heads."""

    nees: FloatArray
    heads: int

    @property
    def mean(self) -> float:
        """Mean NEES; 3 for an exact covariance."""
        return float(self.nees.mean())

    @property
    def coverage(self) -> float:
        """Share within the 95 % ellipsoid."""
        return float((self.nees < BOUND_95).mean())


def draw_people(
    heads: Heads,
    noise_px: float,
    count: int,
    rng: np.random.Generator,
    *,
    range_m: tuple[float, float] = (1.5, 5.0),
    turned: Turned = "all round",
) -> Iterator[Sample]:
    """Yield people before :data:`CAMERA`, each of another head shape, range and direction."""
    for _ in range(count):
        yaw = rng.uniform(-math.pi, math.pi)
        if turned == "profile":
            yaw = rng.choice([-1.0, 1.0]) * math.radians(rng.uniform(45.0, 135.0))
        neck = float(np.clip(rng.normal(0.0, 0.6), -1.2, 1.2))
        body_to_camera = _CAMERA_FROM_BODY @ _turn(2, yaw - neck)
        head = _turn(2, neck) @ _turn(1, rng.normal(0.0, 0.25)) @ _turn(0, rng.normal(0.0, 0.1))
        rotation = body_to_camera @ head @ _BODY_FROM_HEAD
        depth = rng.uniform(*range_m)
        name = str(rng.choice(worker_names()))
        body = np.array(load_worker(name).keypoints_m[:17])
        hips = body[11:13].mean(axis=0)
        points = (body - hips) @ body_to_camera.T
        points[:5] = points[0] + _shape(heads, name, rng) @ rotation.T
        points += (rng.uniform(-0.35, 0.35) * depth, rng.uniform(0.1, 0.4), depth)
        pixels = CAMERA.project(points) + rng.normal(0.0, noise_px, (17, 2))
        lifted = points - points[11:13].mean(axis=0)
        lifted[:, 2] += rng.normal(0.0, _LIFT_STD_M, 17)
        scores = np.ones(17)
        scores[:5] = _in_sight(points[:5], rotation, rng)
        yield Sample(PersonKeypoints(pixels, lifted, scores, "coco"), rotation)


def calibrate(samples: list[Sample], estimator: PnpHeadPoseEstimator) -> Calibration:
    """Return the calibration of an estimator on people."""
    poses = estimator.estimate(None, CAMERA, tuple(sample.keypoints for sample in samples))
    nees = []
    for sample, pose in zip(samples, poses, strict=True):
        if pose is not None:
            error = _rotation_vector(sample.rotation_camera_head @ pose.rotation_camera_head.T)
            nees.append(float(error @ np.linalg.solve(pose.covariance[:3, :3], error)))
    return Calibration(np.array(nees), len(samples))


def _shape(heads: Heads, name: str, rng: np.random.Generator) -> FloatArray:
    """Return nose, eyes and ears (5, 3) in the head frame.

    Drawn heads are the template with size, depth, height and width of ears and eyes drawn one by
    one, with the spread of surveys of adults, and asymmetry; not with the estimator's covariance.
    """
    if heads == "template":
        return HEAD_TEMPLATE_M
    if heads == "workers":
        face = load_worker(name).keypoints_m[:5]
        return np.asarray((face - face[0]) @ _BODY_FROM_HEAD)
    shape = HEAD_TEMPLATE_M * (1.0 + rng.normal(0.0, 0.04))
    for rows, stds_m in (((1, 2), (0.003, 0.002, 0.0015)), ((3, 4), (0.005, 0.006, 0.004))):
        down, forward, out = rng.normal(0.0, stds_m)
        shape[list(rows)] += (down, forward, 0.0)
        shape[list(rows), 2] += (-out, out)
    return np.asarray(shape + rng.normal(0.0, 0.0015, (5, 3)))


def _in_sight(
    points: FloatArray, rotation: FloatArray, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Return which of the points (5, 3) of a head its own far side does not hide."""
    to_camera = -points / np.linalg.norm(points, axis=1, keepdims=True)
    limit = np.radians(_SIGHT_DEG + rng.normal(0.0, _SIGHT_STD_DEG, 5))
    return np.asarray(np.sum((_FACING @ rotation.T) * to_camera, axis=1) > np.cos(limit))


def _turn(axis: int, angle_rad: float) -> FloatArray:
    """Return the rotation about an axis of the body: 0 forward, 1 left, 2 up."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.eye(3)
    rotation[[first, second], [first, second]] = math.cos(angle_rad)
    rotation[second, first] = math.sin(angle_rad)
    rotation[first, second] = -math.sin(angle_rad)
    return rotation


def _rotation_vector(rotation: FloatArray) -> FloatArray:
    cosine = float(np.clip(0.5 * (np.trace(rotation) - 1.0), -1.0, 1.0))
    angle = math.acos(cosine)
    axis = np.array([rotation[2, 1], rotation[0, 2], rotation[1, 0]])
    axis -= np.array([rotation[1, 2], rotation[2, 0], rotation[0, 1]])
    return np.asarray(axis * (0.5 if angle < 1e-6 else angle / (2.0 * math.sin(angle))))
