"""Motion blur: things that move while the shutter is open smear along their path in the image.

An image is rendered for the middle of the exposure. Each pixel's path is straight and at constant
speed, from half the exposure before to half of it after; linear light is averaged along it. Each
actor is a layer over the scenery, so its outline smears as well.
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

# Shorter smears are left out; longer ones are averaged from at most this number of samples.
_MIN_SMEAR_PX: Final = 0.05
_MAX_SAMPLES: Final = 64
# Stands for an infinite depth, which a translation of the camera does not move in the image.
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
    """Return the motion (H, W, 2) of each pixel's content during the exposure, in pixels.

    Args:
        camera: without distortion, of the size of ``depth_m``.
        depth_m: (H, W) along the optical axis, infinite where there is nothing.
        T_odom_camera_open: (4, 4) pose at the start of the exposure.
        T_odom_camera_close: (4, 4) pose at its end.
        actors: (H, W) number of the actor in each pixel; needed with velocities.
        velocities_odom_mps: (2,) velocity on the floor of each actor that moves, by its number.
        exposure_s: the time during which the actors move, ≥ 0.
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
    T_close_open = np.linalg.inv(last) @ first
    moved = points @ T_close_open[:3, :3].T + T_close_open[:3, 3]
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
    """Return an image smeared along its motion field.

    Args:
        rgb: (H, W, 3) sRGB.
        field_px: (H, W, 2) from :func:`motion_field`.
        actors: (H, W) number of the actor in each pixel, −1 for scenery; None treats the image as
            one layer.
    """
    if not np.abs(field_px).max(initial=0.0) >= _MIN_SMEAR_PX:
        return np.array(rgb, dtype=np.uint8)
    light = to_linear(rgb).astype(np.float32)
    field = field_px.astype(np.float32)
    numbers = [] if actors is None else np.unique(actors[actors >= 0]).tolist()
    scenery = np.ones(rgb.shape[:2], np.float32)
    for number in numbers:
        scenery[actors == number] = 0.0
    # The scenery behind an actor is unknown; it is filled in from the scenery around the actor.
    reach = math.ceil(0.5 * float(np.abs(field).max())) + 1
    behind = _filled(light, scenery, reach)
    out = _smeared(behind, _filled(field, scenery, reach))
    for number in numbers:
        mask = (actors == number).astype(np.float32)
        rows, columns = np.nonzero(mask)
        around = (
            slice(max(int(rows.min()) - reach, 0), int(rows.max()) + reach + 1),
            slice(max(int(columns.min()) - reach, 0), int(columns.max()) + reach + 1),
        )
        coverage = mask[around]
        actor_field = _filled(field[around], coverage, reach)
        layer = np.dstack([light[around] * coverage[..., None], coverage])
        smeared = _smeared(layer, actor_field)
        out[around] = smeared[..., :3] + (1.0 - smeared[..., 3:]) * out[around]
    return to_srgb(out.astype(np.float64))


def _filled(values: Floats, known: Floats, reach: int) -> Floats:
    """Return values (H, W, C), the unknown ones set to the mean of known ones within ``reach``."""
    if known.all():
        return values
    size = (2 * reach + 1, 2 * reach + 1)
    weight = cv2.boxFilter(known, -1, size, borderType=cv2.BORDER_REPLICATE)
    total = cv2.boxFilter(values * known[..., None], -1, size, borderType=cv2.BORDER_REPLICATE)
    mean = np.asarray(total) / np.maximum(np.asarray(weight), 1.0e-6)[..., None]
    usable = (known == 0.0) & (np.asarray(weight) > 1.0e-6)
    return np.asarray(np.where(usable[..., None], mean, values), dtype=np.float32)


def _smeared(values: Floats, field: Floats) -> Floats:
    """Return the mean of ``values`` (H, W, C) along each pixel's path.

    The number of samples is two per pixel of the longest path.
    """
    longest = float(np.linalg.norm(field, axis=2).max(initial=0.0))
    if longest < _MIN_SMEAR_PX:
        return np.array(values, dtype=np.float32)
    samples = min(max(math.ceil(2.0 * longest), 2), _MAX_SAMPLES)
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
