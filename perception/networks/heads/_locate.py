"""Position and size of heads in the image, from the body keypoints that are seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ... import layouts as kp
from ..._stages import PersonKeypoints
from ...anthropometry import HEAD_CENTRE_HEAD_M, HEAD_TEMPLATE_M, LIMBS, NECK_TO_NOSE_UP_M
from ...arrays import FloatArray
from ...body import metric_scales

# Distance of each head keypoint and the neck below the head's centre, along the upright body.
_BELOW_CENTRE_M: Final = np.append(
    HEAD_TEMPLATE_M[:, 0] - HEAD_CENTRE_HEAD_M[0], NECK_TO_NOSE_UP_M - HEAD_CENTRE_HEAD_M[0]
)
# Weights: one over the squared distance by which each may lie off to the side, since the yaw of the
# head is not known yet.
_WEIGHT: Final = 1.0 / np.array([0.07, 0.06, 0.06, 0.05, 0.05, 0.12]) ** 2
# Limbs whose length varies little between adults.
_WELL_KNOWN_LIMBS: Final = tuple(limb for limb in LIMBS if limb.relative_std <= 0.10)
# Largest distance between two keypoints of the head: ear to ear.
_HEAD_SPAN_M: Final = 0.156
_MIN_BODY_POINTS: Final = 4
# Row of the neck after the five keypoints of the head; it replaces the left shoulder.
_NECK: Final = kp.LEFT_SHOULDER
_TRUNK: Final = [kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER, kp.LEFT_HIP, kp.RIGHT_HIP]
_IMAGE_UP: Final = np.array([0.0, -1.0])


def locate_heads(
    people: Sequence[PersonKeypoints], min_score: float
) -> tuple[tuple[FloatArray, float] | None, ...]:
    """Estimate the centre of each head and the pixels per metre there.

    The centre is a weighted mean of what each seen head keypoint says; the unknown yaw of the head
    limits its accuracy. The neck counts too, with a lower weight. The estimate is accurate to about
    a sixth of a head crop; the network's second pass centres the crop better.

    Returns:
        Centre (2,) in pixels and pixels per metre of each person; None if neither head nor
        shoulders are seen, or the scale is unknown.
    """
    if not people:
        return ()
    scales = metric_scales(tuple(people), min_score)
    pixels = np.array([person.keypoints_px[kp.BODY] for person in people])
    seen = np.array([person.scores[kp.BODY] for person in people]) >= min_score
    fitted = _weak_perspective(people, pixels, seen).tolist()
    px_per_m = [
        fit / scale.factor
        if person.lifted and scale is not None and fit > 0.0
        else _px_per_m_of_limbs(body_px, body_seen)
        for person, scale, fit, body_px, body_seen in zip(
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
    up = _body_up(pixels, seen, points[:, _NECK])
    above = (weight @ _BELOW_CENTRE_M * sizes)[:, None] * up
    centre = ((weight[:, None] @ points)[:, 0] + above) / total
    return tuple(
        None if size is None or not any_seen else (place, size)
        for place, size, any_seen in zip(centre, px_per_m, known.any(axis=1).tolist(), strict=True)
    )


def _body_up(pixels: FloatArray, seen: NDArray[np.bool_], neck: FloatArray) -> FloatArray:
    """Return unit vectors (N, 2) from hips to neck in the image; image up for unseen trunks."""
    trunk = neck - 0.5 * (pixels[:, kp.LEFT_HIP] + pixels[:, kp.RIGHT_HIP])
    length = np.sqrt((trunk * trunk).sum(axis=1))
    known = seen[:, _TRUNK].all(axis=1) & (length > 1.0)
    return np.where(known[:, None], trunk / np.maximum(length, 1.0)[:, None], _IMAGE_UP)


def _weak_perspective(
    people: Sequence[PersonKeypoints], pixels: FloatArray, seen: NDArray[np.bool_]
) -> FloatArray:
    """Return (N,) pixels per unit of the skeletons; 0 for too few points or no extent."""
    body = np.array([person.keypoints_root_m[kp.BODY, :2] for person in people])
    count = seen.sum(axis=1)
    mask = seen[:, :, None]
    # It is enough to subtract the mean from one factor of the sums.
    mean = (body * mask).sum(axis=1) / np.maximum(count, 1)[:, None]
    body = np.where(mask, body - mean[:, None], 0.0)
    extent = (body * body).sum(axis=(1, 2))
    fit = (body * pixels).sum(axis=(1, 2)) / np.maximum(extent, 1e-12)
    return np.where((count >= _MIN_BODY_POINTS) & (extent > 0.01), fit, 0.0)


def _px_per_m_of_limbs(pixels: FloatArray, seen: NDArray[np.bool_]) -> float | None:
    """Return the largest pixels per metre of all seen limbs: a limb never looks too long."""
    sizes = [
        float(np.hypot(*(_mean(pixels, limb.end) - _mean(pixels, limb.start)))) / limb.length_m
        for limb in _WELL_KNOWN_LIMBS
        if seen[[*limb.start, *limb.end]].all()
    ]
    head = pixels[kp.HEAD][seen[kp.HEAD]]
    if not sizes and len(head) > 1:
        apart = head[:, None] - head[None]
        sizes = [float(np.hypot(apart[..., 0], apart[..., 1]).max()) / _HEAD_SPAN_M]
    return max(sizes) if sizes and max(sizes) > 0.0 else None


def _mean(pixels: FloatArray, rows: tuple[int, ...]) -> FloatArray:
    return np.asarray(pixels[list(rows)].mean(axis=0))
