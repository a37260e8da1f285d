"""Depth images: their check, and the depth of each person's chest in them."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import layouts as kp
from ._camera import Camera
from ._stages import PersonDetection, PersonKeypoints
from .arrays import FloatArray, finite_number
from .errors import DepthImageError

#: Longest time between a picture and its depth image. A walking person moves 8 cm in it, no more
#: than a depth image is uncertain by.
MOST_APART_S: Final = 0.05
# Depths outside these limits are holes; sensors report them so, or as 0, NaN or infinity.
_LEAST_M, _MOST_M = 0.15, 100.0
# Metres read as millimetres, and millimetres read as metres, give medians beyond these.
_LEAST_MEDIAN_MM: Final = 100.0
_MOST_MEDIAN_M: Final = 100.0
# The chest is sampled on a strip about the line from the neck to the hips: shares of its length
# from the neck (below lies what people carry), and half its width as a share of the length. It is
# narrower than a chest seen from the side, so that the two images need not fit to the pixel.
_ALONG: Final = np.linspace(0.10, 0.60, 13)
_ACROSS: Final = np.linspace(-0.15, 0.15, 7)
# The same strip in the box of a person whose trunk is not seen.
_BOX_NECK, _BOX_HIPS = 0.17, 0.50
# Surfaces this near to each other belong to one body. So much of what was measured on the strip,
# and at least so many samples, must be one surface.
_SURFACE_M: Final = 0.30
_SURFACE_SHARE: Final = 0.6
_FEWEST: Final = 8
#: An adult's centre line lies this far behind the chest's surface: half the chest's depth from in
#: front (Drillis and Contini; with clothes). From the side it is up to half its breadth.
BEHIND_M: Final = 0.12
_BEHIND_STD_M: Final = 0.05
# Half the width of a limb, and how far apart the pixels of the two images may be at least.
_LIMB_M, _LEAST_REACH_PX = 0.04, 2.0
_AROUND: Final = np.stack(np.meshgrid((-1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)), axis=-1).reshape(-1, 2)
# Error of a depth camera as a share of the depth; that of stereo grows to this at about 4 m.
_RELATIVE_STD: Final = 0.015


def checked_depth(
    depth_m: Any, shape: tuple[int, int], stamp_s: float, depth_stamp_s: Any
) -> FloatArray:
    """Return a depth image in metres, (H, W) float64 with NaN in its holes.

    Args:
        depth_m: (H, W) along the optical axis: floating-point metres, or uint16 millimetres.
        shape: height and width of the image that it is aligned with.
        stamp_s: time of that image.
        depth_stamp_s: time of the depth image; None for the same.

    Raises:
        DepthImageError: for another type, shape, unit or time; the message says what was given.
    """
    if not isinstance(depth_m, np.ndarray):
        raise DepthImageError(
            f"depth_m must be an array of shape {shape}, got {type(depth_m).__name__}"
        )
    in_mm = depth_m.dtype == np.uint16
    if depth_m.shape != shape or not (in_mm or depth_m.dtype.kind == "f"):
        raise DepthImageError(
            f"depth_m must be of the image's shape {shape}, in metres (floating point) or in "
            f"millimetres (uint16), got {depth_m.dtype} of shape {depth_m.shape}"
        )
    if depth_stamp_s is not None:
        apart_s = finite_number("depth_stamp_s", depth_stamp_s, DepthImageError) - stamp_s
        if abs(apart_s) > MOST_APART_S:
            raise DepthImageError(
                f"the depth image must be of the image's time to {MOST_APART_S:g} s, got one "
                f"{apart_s:+.3f} s from it"
            )
    depth = depth_m.astype(np.float64)
    measured = depth[np.isfinite(depth) & (depth > 0.0)]
    if measured.size:
        median = float(np.median(measured))
        if in_mm and median < _LEAST_MEDIAN_MM:
            raise DepthImageError(
                f"depth_m of type uint16 must be in millimetres; its median is {median:g}, which "
                "looks like another unit"
            )
        if not in_mm and median > _MOST_MEDIAN_M:
            raise DepthImageError(
                f"depth_m of floating point must be in metres; its median is {median:g}, which "
                "looks like millimetres"
            )
    if in_mm:
        depth *= 1e-3
    with np.errstate(invalid="ignore"):
        depth[~((depth >= _LEAST_M) & (depth <= _MOST_M))] = np.nan
    return depth


class Chest(NamedTuple):
    """A surface on the upper trunk of a person in a depth image.

    Attributes:
        range_m: distance of the centre line behind it, along the person's ray.
        std_m: its standard deviation.
        keypoint_share: share of the seen keypoints with a depth that lie on the same body; None
            without any. Those of a person behind something lie farther away than it.
    """

    range_m: float
    std_m: float
    keypoint_share: float | None


def find_chest(
    camera: Camera,
    depth_m: FloatArray,
    direction: FloatArray,
    trunk_px: FloatArray,
    joints_px: FloatArray,
    ahead_m: FloatArray,
) -> Chest | None:
    """Return the largest surface on a person's upper trunk.

    Depths count as points, measured along the person's ray: at the side of a wide picture the depth
    along the optical axis differs by the width of a body between its two sides.

    Args:
        camera: camera of both images.
        depth_m: (H, W) of :func:`checked_depth`.
        direction: (3,) unit vector to the person's centre line at chest height.
        trunk_px: (2, 2) neck and middle of the hips.
        joints_px: (K, 2) the seen keypoints.
        ahead_m: (K,) how far each lies beyond the chest, along the ray.

    Returns:
        None where the depth image has too many holes, or several surfaces and none of them large.
    """
    down = trunk_px[1] - trunk_px[0]
    aside = np.array([-down[1], down[0]])
    strip_px = (trunk_px[0] + _ALONG[:, None, None] * down + _ACROSS[:, None] * aside).reshape(
        -1, 2
    )
    along_m, inside = _ranges(camera, depth_m, direction, strip_px)
    found = np.sort(along_m[np.isfinite(along_m)])
    if len(found) < _FEWEST:
        return None
    # The window of this length that holds the most samples.
    counts = np.searchsorted(found, found + _SURFACE_M, side="right") - np.arange(len(found))
    first = int(counts.argmax())
    count = int(counts[first])
    if count < max(_FEWEST, _SURFACE_SHARE * len(found)):
        return None
    surface_m = float(np.median(found[first : first + count]))
    # The side of a body that the border cuts is as far away as its centre line.
    side_m = BEHIND_M * (1.0 - float(inside.mean()))
    std_m = math.hypot(_BEHIND_STD_M, _RELATIVE_STD * surface_m, side_m)
    # A keypoint lies on the body if any pixel about it does: limbs are thin.
    reach_px = max(_LEAST_REACH_PX, _LIMB_M * camera.fx_px / surface_m)
    around_px = joints_px[:, None] + reach_px * _AROUND
    ranges_m, _ = _ranges(camera, depth_m, direction, around_px.reshape(-1, 2))
    off_m = np.abs(ranges_m.reshape(-1, len(_AROUND)) - ahead_m[:, None] - surface_m)
    off_m = off_m[np.isfinite(off_m).any(axis=1)]
    share = float((np.nanmin(off_m, axis=1) < _SURFACE_M).mean()) if len(off_m) else None
    return Chest(surface_m + BEHIND_M, std_m, share)


def _ranges(
    camera: Camera, depth_m: FloatArray, direction: FloatArray, pixels_px: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return (N,) how far pixels lie along a direction, NaN in holes, and (N,) which are inside."""
    height, width = depth_m.shape
    columns, rows = np.rint(pixels_px).astype(np.int64).T
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    depth = np.where(inside, depth_m[rows * inside, columns * inside], np.nan)
    rays = camera.normalise(np.stack([columns, rows], axis=1) * inside[:, None], nearest=True)
    return depth * (rays @ direction[:2] + direction[2]), inside


def trunk_in_image(
    detection: PersonDetection,
    person: PersonKeypoints,
    trunk_px: FloatArray | None,
    min_score: float,
) -> FloatArray:
    """Return the neck and the middle of the hips (2, 2) in pixels.

    ``trunk_px`` has them as the placed body does, for ends that are not seen; None without one.
    """
    ends = []
    for end, rows in enumerate((kp.SHOULDERS, kp.HIPS)):
        seen = person.scores[rows] >= min_score
        if seen.any():
            ends.append(person.keypoints_px[rows][seen].mean(axis=0))
        elif trunk_px is not None:
            ends.append(trunk_px[end])
    if len(ends) == 2:
        return np.array(ends)
    left, top, right, bottom = detection.box_xyxy_px.tolist()
    middle, height = 0.5 * (left + right), bottom - top
    return np.array([[middle, top + _BOX_NECK * height], [middle, top + _BOX_HIPS * height]])
