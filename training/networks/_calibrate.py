"""Limb scale of the pose network: one number, measured on held-out people."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from perception import Camera, OnnxPoseEstimator, PersonDetection
from perception.anthropometry import MEAN_STATURE_M
from perception.body import place_bodies
from perception.layouts import LEFT_HIP, RIGHT_HIP

from ._samples import ImageSample, picture
from ._shard_file import read_shards

# Least visible keypoints of a person who counts.
_MIN_KEYPOINTS: Final = 12
# Median absolute deviation of a normal distribution with unit variance.
_MAD_OF_A_NORMAL: Final = 0.6745


def limb_scale(
    estimator_of: Any, folder: Path, statures_m: Any, rounds: int = 3
) -> tuple[float, float]:
    """Return the limb scale for which the median range from the body is right, and its noise.

    A network's keypoints depend on the labels' definitions, and depths that are estimated too small
    make limbs look shorter and people farther away. One number corrects both on average.

    Args:
        estimator_of: returns the :class:`OnnxPoseEstimator` for a scale.
        folder: folder of shards with people who were not used for training.
        statures_m: statures of these people, which differ from the average adult's.
        rounds: rounds of the fixed-point iteration, which the skeleton's metric scale damps.

    Returns:
        The scale, and the relative standard deviation of ranges beyond that of statures.
    """
    frames = [frame for shard in read_shards(folder) for frame in shard.frames]
    scale, taller = 1.0, np.log(np.mean(statures_m) / MEAN_STATURE_M)
    for _ in range(rounds):
        errors = np.array(list(_range_errors(estimator_of(scale), frames)))
        middle = float(np.median(errors))
        scale *= float(np.exp(-middle - taller))
    spread = float(np.median(np.abs(errors - middle))) / _MAD_OF_A_NORMAL
    known = float(np.std(statures_m) / np.mean(statures_m))
    return scale, float(np.sqrt(max(spread**2 - known**2, 0.0)))


def _range_errors(estimator: OnnxPoseEstimator, frames: list[ImageSample]) -> Iterator[float]:
    """Yield logarithms of estimated over true range of the middle of the hips."""
    for frame in frames:
        people = [p for p in frame.people if p.visible.sum() >= _MIN_KEYPOINTS]
        if not people:
            continue
        image = picture(frame.png)
        height, width = image.shape[:2]
        camera = Camera(width, height, *[frame.focal_px] * 2, width / 2.0, height / 2.0)
        detections = tuple(PersonDetection(person.box_xyxy_px, 1.0) for person in people)
        bodies = place_bodies(camera, estimator.estimate(image, detections), 1.0)
        for person, body in zip(people, bodies, strict=True):
            hips = person.keypoints_root_m[[LEFT_HIP, RIGHT_HIP]].mean(axis=0)
            true = person.head_keypoints_camera_m[0] - person.keypoints_root_m[0] + hips
            if body is not None:
                yield float(np.log(body.hips_camera_m[2] / true[2]))
