"""Random changes of images, so that networks do not overfit to this renderer.

Images are (H, W, 3), or (H, W, 4) with the foreground as their alpha, which is 255 outside the
image: what lies there is never replaced by a background.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from perception.networks.heads import OUTSIDE_GREY

from ._degradation import Degradation, degrade, rolling_shutter


def with_surroundings(
    patch: NDArray[np.uint8],
    origin: tuple[int, int],
    size: tuple[int, int],
    margin_px: int,
    outside: int = OUTSIDE_GREY,
) -> tuple[NDArray[np.uint8], tuple[int, int]]:
    """Return a patch with a margin: ``outside`` where the image ends, else its repeated edge."""
    height, width = patch.shape[:2]
    ends = (
        (origin[1] <= 0, origin[1] + height >= size[1]),
        (origin[0] <= 0, origin[0] + width >= size[0]),
    )
    for axis, sides in enumerate(ends):
        for side, is_end in enumerate(sides):
            pads = [0, 0, 0, 0]
            pads[2 * axis + side] = margin_px
            kind = cv2.BORDER_CONSTANT if is_end else cv2.BORDER_REPLICATE
            patch = np.asarray(
                cv2.copyMakeBorder(patch, *pads, kind, value=_outside(outside)), dtype=np.uint8
            )
    return patch, (origin[0] - margin_px, origin[1] - margin_px)


def warp(
    image: NDArray[np.uint8],
    out_from_image: NDArray[np.float64],
    size: tuple[int, int],
    oversampling: int = 1,
    outside: int | None = OUTSIDE_GREY,
) -> NDArray[np.uint8]:
    """Return an affine crop in continuous coordinates: (0, 0) is the corner of either image.

    Args:
        image: (H, W, 3) or (H, W, 4).
        out_from_image: (2, 3).
        size: width and height of the result.
        oversampling: samples per pixel and side, averaged.
        outside: grey level outside the image; None repeats its edge.
    """
    k = oversampling
    matrix = out_from_image * k
    # OpenCV's integer coordinates are pixel centres.
    matrix[:, 2] += 0.5 * matrix[:, :2].sum(axis=1) - 0.5
    out = cv2.warpAffine(
        image,
        matrix,
        (size[0] * k, size[1] * k),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE if outside is None else cv2.BORDER_CONSTANT,
        borderValue=_outside(outside or 0),
    )
    if k > 1:
        out = cv2.resize(out, size, interpolation=cv2.INTER_AREA)
    return np.asarray(out, dtype=np.uint8)


def _outside(grey: int) -> tuple[int, int, int, int]:
    return grey, grey, grey, 255


def similarity(
    centre: NDArray[np.float64],
    scale: float,
    angle_rad: float,
    size: tuple[int, int],
    *,
    flip: bool,
) -> NDArray[np.float64]:
    """Return the matrix (2, 3) that moves ``centre`` to the middle of the result.

    It also scales, turns and mirrors.
    """
    c, s = scale * np.cos(angle_rad), scale * np.sin(angle_rad)
    turn = np.array([[c, -s], [s, c]])
    if flip:
        turn = np.diag([-1.0, 1.0]) @ turn
    middle = 0.5 * np.array(size, dtype=np.float64)
    return np.column_stack([turn, middle - turn @ centre])


def photographed_layers(
    layers: NDArray[np.uint8],
    degradation: Degradation,
    rng: np.random.Generator,
    background: NDArray[np.uint8] | None,
    scale: float = 1.0,
) -> NDArray[np.uint8]:
    """Return the picture (H, W, 3) that a camera takes of a foreground before a background.

    Args:
        layers: (H, W, 4).
        degradation: effects of the camera.
        rng: random generator.
        background: (h, w, 3) of any size, a random part of which fills the picture; None keeps the
            rendered one.
        scale: see :func:`._degradation.degrade`.
    """
    rgb = layers[..., :3]
    if background is not None:
        rgb = before_background(layers, random_part(background, layers.shape[:2], rng), rng)
    return degrade(np.ascontiguousarray(rgb), degradation, rng, scale)


def before_background(
    layers: NDArray[np.uint8], background: NDArray[np.uint8], rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return the foreground of ``layers`` (H, W, 4) before another background (H, W, 3).

    The foreground gets a light of its own. Its rim, half a pixel of which shows the old
    background, is left out.
    """
    light = np.float32(np.exp(rng.normal(0.0, 0.3))) * np.exp(rng.normal(0.0, 0.06, 3))
    front = layers[..., :3].astype(np.float32) * light.astype(np.float32)
    alpha = layers[..., 3:].astype(np.float32)
    alpha = np.clip((alpha - 128.0) / 127.0, 0.0, 1.0)
    out = background + (front - background) * alpha
    return np.asarray(np.clip(out, 0.0, 255.0), dtype=np.uint8)


def random_part(
    image: NDArray[np.uint8], size_hw: tuple[int, ...], rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return a random part of an image, often mirrored, enlarged or reduced to (H, W)."""
    height, width = image.shape[:2]
    share = rng.uniform(0.35, 1.0)
    h = max(4, int(share * height * rng.uniform(0.7, 1.0)))
    w = max(4, int(share * width * rng.uniform(0.7, 1.0)))
    y, x = int(rng.integers(0, height - h + 1)), int(rng.integers(0, width - w + 1))
    part = image[y : y + h, x : x + w]
    if rng.random() < 0.5:
        part = part[:, ::-1]
    if rng.random() < 0.15:
        part = part[::-1]
    return np.asarray(
        cv2.resize(part, (size_hw[1], size_hw[0]), interpolation=cv2.INTER_LINEAR), dtype=np.uint8
    )


def reduced(
    image: NDArray[np.uint8], factor: float
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return an image with at most ``factor`` of its pixels along a side, and the factors (x, y).

    A factor of 1 or more leaves it as it is. Continuous coordinates scale by the factors exactly.
    """
    if factor >= 1.0:
        return image, np.ones(2)
    height, width = image.shape[:2]
    size = max(1, round(width * factor)), max(1, round(height * factor))
    small = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return small, np.array([size[0] / width, size[1] / height])


def composed(outer: NDArray[np.float64], inner: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the affine map (2, 3) that applies ``inner`` first and then ``outer``."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], moved(inner[:, 2], outer)])


def sheared(
    image: NDArray[np.uint8], shear: float, middle_row: float
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return an image under a rolling shutter, its edges repeated, and the map (2, 3) of points."""
    matrix = rolling_shutter(shear, middle_row)
    return warp(image, matrix, (image.shape[1], image.shape[0]), outside=None), matrix


def emptied_outside(
    image: NDArray[np.uint8], inside: NDArray[np.float64], grey: int = OUTSIDE_GREY
) -> NDArray[np.uint8]:
    """Return an image with grey outside a polygon (K, 2), where the camera's picture ends.

    What lies there was added after the camera, so it has no noise and no light.
    """
    mask = np.zeros(image.shape[:2], np.uint8)
    # OpenCV's polygons include the pixels on their edge.
    corners = np.round(inside - 0.5 + 0.49 * np.sign(inside.mean(axis=0) - inside))
    cv2.fillConvexPoly(mask, corners.astype(np.int32), (1,))
    if mask.all():
        return image
    out = image.copy()
    out[mask == 0] = grey
    return out


def moved(points: NDArray[Any], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (…, 2) under an affine map (2, 3)."""
    return np.asarray(points @ matrix[:, :2].T + matrix[:, 2])


def box_around(points: NDArray[Any]) -> NDArray[np.float64]:
    """Return the boxes (…, 4) around groups of points (…, K, 2)."""
    return np.concatenate([points.min(axis=-2), points.max(axis=-2)], axis=-1)


def within_rectangle(
    outline: NDArray[np.float64], low: NDArray[Any], high: NDArray[Any]
) -> NDArray[np.float64] | None:
    """Return the part of a convex outline (K, 2) in a rectangle as a polygon; None for no part."""
    if (outline >= low).all() and (outline <= high).all():
        return outline
    (x1, y1), (x2, y2) = low, high
    rectangle = np.array([[x1, y1], [x2, y1], [x2, y2], [x1, y2]], dtype=np.float32)
    hull = cv2.convexHull(outline.astype(np.float32))
    area, part = cv2.intersectConvexConvex(hull, rectangle)
    if area <= 0.0 or part is None:
        return None
    return np.asarray(part, dtype=np.float64).reshape(-1, 2)


def covered(
    image: NDArray[np.uint8], rng: np.random.Generator, other: NDArray[np.uint8]
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return the image with a hidden rectangle, and the rectangle (4,): x1, y1, x2, y2."""
    height, width = image.shape[:2]
    w, h = rng.uniform(0.12, 0.6) * width, rng.uniform(0.12, 0.6) * height
    x, y = rng.uniform(-0.5 * w, width - 0.5 * w), rng.uniform(-0.5 * h, height - 0.5 * h)
    box = np.array([x, y, x + w, y + h])
    x1, y1 = np.maximum(box[:2].round().astype(int), 0).tolist()
    x2, y2 = np.minimum(box[2:].round().astype(int), [width, height]).tolist()
    if x2 > x1 and y2 > y1:
        image = image.copy()
        if rng.random() < 0.6:
            source = cv2.resize(other, (x2 - x1, y2 - y1), interpolation=cv2.INTER_AREA)
            image[y1:y2, x1:x2, :3] = source[:, :: -1 if rng.random() < 0.5 else 1]
        else:
            image[y1:y2, x1:x2, :3] = rng.integers(0, 256, 3)
        image[y1:y2, x1:x2, 3:] = 255  # part of the foreground
    return image, box


def inside_of(points: NDArray[Any], box: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return flags (…) of the points (…, 2) that lie in a rectangle."""
    return np.asarray(((points >= box[:2]) & (points <= box[2:])).all(axis=-1))
