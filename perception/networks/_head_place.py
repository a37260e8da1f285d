"""Where in the picture the head of a person is, from whichever keypoints a pose model gives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .. import layouts as kp
from .._head_pose import HEAD_CENTRE_HEAD_M
from .._keypoints import PersonKeypoints
from .._metric_scale import MetricScale, metric_scales
from ..anthropometry import (
    HEAD_TEMPLATE_M,
    LIMBS,
    NECK_TO_NOSE_UP_M,
)
from ..arrays import FloatArray

_BODY: Final = 17
_HEAD: Final = slice(0, 5)
# How far below the head's centre each head keypoint and the neck lie, along the upright body.
_BELOW_CENTRE_M: Final = np.append(
    HEAD_TEMPLATE_M[:, 0] - HEAD_CENTRE_HEAD_M[0], NECK_TO_NOSE_UP_M - HEAD_CENTRE_HEAD_M[0]
)
# How far off sideways each of them may be, since the head's yaw is not known yet.
_WEIGHT: Final = 1.0 / np.array([0.07, 0.06, 0.06, 0.05, 0.05, 0.12]) ** 2
_SINGLE_LIMBS: Final = tuple(limb for limb in LIMBS if limb.relative_std <= 0.10)
# The largest distance that two of the head's keypoints can have.
_HEAD_SPAN_M: Final = 0.156
_MIN_BODY_POINTS: Final = 4


def locate_heads(
    people: Sequence[PersonKeypoints], min_score: float
) -> tuple[tuple[FloatArray, float] | None, ...]:
    """Guess where the centre of each head is and how many pixels a metre measures there.

    Ears, eyes and nose each say where the centre is, to within what the unknown yaw leaves open;
    so does the neck, more roughly. The guess is good to about a sixth of a head crop; the network
    then centres it better.

    Returns:
        Of each person the centre (2,) in pixels and pixels a metre, or None where neither head nor
        shoulders are seen or nothing tells the size.
    """
    scales = metric_scales(people, min_score)
    return tuple(
        _locate(person, scale, min_score) for person, scale in zip(people, scales, strict=True)
    )


def _locate(
    person: PersonKeypoints, scale: MetricScale | None, min_score: float
) -> tuple[FloatArray, float] | None:
    pixels, seen = person.keypoints_px[:_BODY], person.scores[:_BODY] >= min_score
    px_per_m = _pixels_per_metre(person, pixels, seen, scale)
    shoulders = bool(seen[kp.LEFT_SHOULDER] and seen[kp.RIGHT_SHOULDER])
    known = np.append(seen[_HEAD], shoulders)
    if px_per_m is None or not known.any():
        return None
    neck = 0.5 * (pixels[kp.LEFT_SHOULDER] + pixels[kp.RIGHT_SHOULDER])
    points = np.vstack([pixels[_HEAD], neck])[known]
    up = _up(pixels, seen, neck, shoulders)
    centres = points + px_per_m * _BELOW_CENTRE_M[known, None] * up
    weight = _WEIGHT[known]
    return np.asarray(weight @ centres / weight.sum()), px_per_m


def _up(
    pixels: FloatArray, seen: NDArray[np.bool_], neck: FloatArray, shoulders: bool
) -> FloatArray:
    """(2,) unit vector up the body in the picture; the picture's own up where hips are not seen."""
    if shoulders and seen[kp.LEFT_HIP] and seen[kp.RIGHT_HIP]:
        trunk = neck - 0.5 * (pixels[kp.LEFT_HIP] + pixels[kp.RIGHT_HIP])
        length = float(np.hypot(*trunk))
        if length > 1.0:
            return np.asarray(trunk / length)
    return np.array([0.0, -1.0])


def _pixels_per_metre(
    person: PersonKeypoints,
    pixels: FloatArray,
    seen: NDArray[np.bool_],
    scale: MetricScale | None,
) -> float | None:
    """Scale of the picture at the person: weak perspective for a lifted skeleton, else limbs."""
    if person.lifted and scale is not None and np.count_nonzero(seen) >= _MIN_BODY_POINTS:
        body = scale.factor * person.keypoints_root_m[:_BODY, :2][seen]
        image = pixels[seen]
        # The mean of either side drops out of the sums where it is taken off one of them.
        body = body - body.sum(axis=0) / len(body)
        extent = float(np.einsum("ni,ni->", body, body))
        if extent > 0.01:
            fitted = float(np.einsum("ni,ni->", body, image)) / extent
            if fitted > 0.0:
                return fitted
    # A limb looks shorter than it is, never longer: the one that looks longest counts.
    sizes = [
        float(np.hypot(*(_middle(pixels, limb.end) - _middle(pixels, limb.start)))) / limb.length_m
        for limb in _SINGLE_LIMBS
        if seen[[*limb.start, *limb.end]].all()
    ]
    head = pixels[_HEAD][seen[_HEAD]]
    if not sizes and len(head) > 1:
        apart = head[:, None] - head[None]
        sizes = [float(np.hypot(apart[..., 0], apart[..., 1]).max()) / _HEAD_SPAN_M]
    return max(sizes) if sizes and max(sizes) > 0.0 else None


def _middle(pixels: FloatArray, rows: tuple[int, ...]) -> FloatArray:
    return np.asarray(pixels[list(rows)].mean(axis=0))
