"""Where in the picture the head of a person is, from whichever keypoints a pose model gives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ... import layouts as kp
from ..._keypoints import PersonKeypoints
from ..._metric_scale import metric_scales
from ...anthropometry import HEAD_CENTRE_HEAD_M, HEAD_TEMPLATE_M, LIMBS, NECK_TO_NOSE_UP_M
from ...arrays import FloatArray

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
# Its place after the five keypoints of the head, where the left shoulder stands otherwise.
_NECK: Final = kp.LEFT_SHOULDER
_TRUNK: Final = [kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER, kp.LEFT_HIP, kp.RIGHT_HIP]
_PICTURE_UP: Final = np.array([0.0, -1.0])


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
    if not people:
        return ()
    scales = metric_scales(people, min_score)
    pixels = np.array([person.keypoints_px[:_BODY] for person in people])
    seen = np.array([person.scores[:_BODY] for person in people]) >= min_score
    fitted = _weak_perspective(people, pixels, seen).tolist()
    px_per_m = [
        fit / scale.factor
        if person.lifted and scale is not None and fit > 0.0
        else _from_limbs(limbs_px, there)
        for person, scale, fit, limbs_px, there in zip(
            people, scales, fitted, pixels, seen, strict=True
        )
    ]
    sizes = np.array([0.0 if size is None else size for size in px_per_m])
    # Nose, eyes and ears, then the neck.
    points, known = pixels[:, : _NECK + 1].copy(), seen[:, : _NECK + 1].copy()
    points[:, _NECK] = 0.5 * (pixels[:, kp.LEFT_SHOULDER] + pixels[:, kp.RIGHT_SHOULDER])
    known[:, _NECK] &= seen[:, kp.RIGHT_SHOULDER]
    weight = known * _WEIGHT
    total = np.maximum(weight.sum(axis=1), 1e-9)[:, None]
    above = (weight @ _BELOW_CENTRE_M * sizes)[:, None] * _up(pixels, seen, points[:, _NECK])
    centre = ((weight[:, None] @ points)[:, 0] + above) / total
    return tuple(
        None if size is None or not there else (place, size)
        for place, size, there in zip(centre, px_per_m, known.any(axis=1).tolist(), strict=True)
    )


def _up(pixels: FloatArray, seen: NDArray[np.bool_], neck: FloatArray) -> FloatArray:
    """(N, 2) unit vectors up the bodies in the picture, its own up where the trunk is not seen."""
    trunk = neck - 0.5 * (pixels[:, kp.LEFT_HIP] + pixels[:, kp.RIGHT_HIP])
    length = np.sqrt((trunk * trunk).sum(axis=1))
    known = seen[:, _TRUNK].all(axis=1) & (length > 1.0)
    return np.where(known[:, None], trunk / np.maximum(length, 1.0)[:, None], _PICTURE_UP)


def _weak_perspective(
    people: Sequence[PersonKeypoints], pixels: FloatArray, seen: NDArray[np.bool_]
) -> FloatArray:
    """(N,) pixels per unit of the skeletons; 0 where too few points or no extent tell it."""
    body = np.array([person.keypoints_root_m[:_BODY, :2] for person in people])
    count = seen.sum(axis=1)
    mask = seen[:, :, None]
    # The mean of either side drops out of the sums where it is taken off one of them.
    mean = (body * mask).sum(axis=1) / np.maximum(count, 1)[:, None]
    body = np.where(mask, body - mean[:, None], 0.0)
    extent = (body * body).sum(axis=(1, 2))
    fit = (body * pixels).sum(axis=(1, 2)) / np.maximum(extent, 1e-12)
    return np.where((count >= _MIN_BODY_POINTS) & (extent > 0.01), fit, 0.0)


def _from_limbs(pixels: FloatArray, seen: NDArray[np.bool_]) -> float | None:
    """Pixels a metre from the limb that looks longest, since none looks longer than it is."""
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
