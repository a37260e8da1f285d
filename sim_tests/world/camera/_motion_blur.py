"""Motion blur: what moves while the shutter is open smears along its path in the image.

The picture is taken at the middle of the exposure. Every pixel's path is straight and even, from
half the exposure before to half of it after; light is averaged along it, linearly. Actors move over
the scenery as layers of their own, so that their outlines smear as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception import Camera
from perception.arrays import FloatArray, finite_array, finite_number, rigid_transform

from ..errors import SimError
from ._sensor import to_linear, to_srgb

# Smears shorter than this are not seen; longer ones are averaged from so many samples at most.
_LEAST_PX: Final = 0.05
_MOST_SAMPLES: Final = 64
# What is infinitely far does not move with the camera's translation.
_HORIZON_M: Final = 1.0e6

Floats = NDArray[np.float32]


def motion_field(
    camera: Camera,
    depth_m: FloatArray,
    T_odom_camera_open: Any,
    T_odom_camera_close: Any,
    actors: NDArray[np.int32] | None = None,
    velocities_odom_mps: Mapping[int, Any] | None = None,
    exposure_s: float = 0.0,
) -> FloatArray:
    """How far each pixel's content moves in the image during the exposure, (H, W, 2) pixels.

    Args:
        camera: without distortion, of the size of ``depth_m``.
        depth_m: (H, W) along the optical axis, infinite where there is nothing.
        T_odom_camera_open: (4, 4) pose at the start of the exposure.
        T_odom_camera_close: (4, 4) pose at its end.
        actors: (H, W) number of the actor seen in each pixel; needed with velocities.
        velocities_odom_mps: (2,) velocity on the floor of each actor that moves.
        exposure_s: how long the actors move, ≥ 0.
    """
    first = rigid_transform("T_odom_camera_open", T_odom_camera_open, SimError)
    last = rigid_transform("T_odom_camera_close", T_odom_camera_close, SimError)
    exposure = finite_number("exposure_s", exposure_s, SimError, minimum=0.0)
    height, width = depth_m.shape
    u, v = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    z = np.minimum(depth_m, _HORIZON_M)
    points = np.stack(
        [(u - camera.cx_px) / camera.fx_px * z, (v - camera.cy_px) / camera.fy_px * z, z], axis=-1
    )
    step = np.linalg.inv(last) @ first
    moved = points @ step[:3, :3].T + step[:3, 3]
    if actors is not None:
        for number, velocity in (velocities_odom_mps or {}).items():
            on_floor = finite_array(f"velocities_odom_mps[{number}]", velocity, (2,), SimError)
            shift = np.array([*on_floor.tolist(), 0.0]) * exposure
            moved[actors == number] += shift @ last[:3, :3]
    ahead = np.maximum(moved[..., 2], 1.0e-3)
    return np.stack(
        [
            moved[..., 0] / ahead * camera.fx_px + camera.cx_px - u,
            moved[..., 1] / ahead * camera.fy_px + camera.cy_px - v,
        ],
        axis=-1,
    )


def motion_blur(
    rgb: NDArray[np.uint8], field_px: FloatArray, actors: NDArray[np.int32] | None = None
) -> NDArray[np.uint8]:
    """Smear a picture (H, W, 3) along its motion field (H, W, 2).

    Args:
        rgb: sRGB.
        field_px: from :func:`motion_field`.
        actors: (H, W) number of the actor in each pixel, −1 for scenery; None is one layer.
    """
    if not np.abs(field_px).max(initial=0.0) >= _LEAST_PX:
        return np.array(rgb, dtype=np.uint8)
    light = to_linear(rgb).astype(np.float32)
    field = field_px.astype(np.float32)
    numbers = [] if actors is None else np.unique(actors[actors >= 0]).tolist()
    scenery = np.ones(rgb.shape[:2], np.float32)
    for number in numbers:
        scenery[actors == number] = 0.0
    # Where an actor stood the scenery is unknown: what is seen around it stands in.
    reach = _reach(field)
    behind = _filled(light, scenery, reach)
    out = _smeared(behind, _filled(field, scenery, reach))
    for number in numbers:
        mask = (actors == number).astype(np.float32)
        rows, columns = np.nonzero(mask)
        around = (
            slice(max(int(rows.min()) - reach, 0), int(rows.max()) + reach + 1),
            slice(max(int(columns.min()) - reach, 0), int(columns.max()) + reach + 1),
        )
        cover = mask[around]
        own = _filled(field[around], cover, reach)
        layer = np.dstack([light[around] * cover[..., None], cover])
        smeared = _smeared(layer, own)
        out[around] = smeared[..., :3] + (1.0 - smeared[..., 3:]) * out[around]
    return to_srgb(out.astype(np.float64))


def _reach(field: Floats) -> int:
    return math.ceil(0.5 * float(np.abs(field).max())) + 1


def _filled(values: Floats, known: Floats, reach: int) -> Floats:
    """Values (H, W, C) with the unknown ones replaced by the mean of the known ones around."""
    if known.all():
        return values
    size = (2 * reach + 1, 2 * reach + 1)
    weight = cv2.boxFilter(known, -1, size, borderType=cv2.BORDER_REPLICATE)
    total = cv2.boxFilter(values * known[..., None], -1, size, borderType=cv2.BORDER_REPLICATE)
    mean = np.asarray(total) / np.maximum(np.asarray(weight), 1.0e-6)[..., None]
    usable = (known == 0.0) & (np.asarray(weight) > 1.0e-6)
    return np.asarray(np.where(usable[..., None], mean, values), dtype=np.float32)


def _smeared(values: Floats, field: Floats) -> Floats:
    """Mean of ``values`` (H, W, C) along each pixel's path, two samples a pixel of the longest."""
    longest = float(np.linalg.norm(field, axis=2).max(initial=0.0))
    if longest < _LEAST_PX:
        return np.array(values, dtype=np.float32)
    samples = min(max(math.ceil(2.0 * longest), 2), _MOST_SAMPLES)
    height, width = values.shape[:2]
    u, v = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    total = np.zeros_like(values)
    for k in range(samples):
        share = np.float32((k + 0.5) / samples - 0.5)
        moved = cv2.remap(
            values,
            u - share * field[..., 0],
            v - share * field[..., 1],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        total += np.asarray(moved, dtype=np.float32)
    return np.asarray(total / samples, dtype=np.float32)
