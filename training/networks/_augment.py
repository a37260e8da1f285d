"""Random changes of images, so that networks do not overfit to this renderer."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from perception.networks.heads import OUTSIDE_GREY


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
                cv2.copyMakeBorder(patch, *pads, kind, value=(outside,) * 3), dtype=np.uint8
            )
    return patch, (origin[0] - margin_px, origin[1] - margin_px)


def warp(
    image: NDArray[np.uint8],
    out_from_image: NDArray[np.float64],
    size: tuple[int, int],
    oversampling: int = 1,
    outside: int = OUTSIDE_GREY,
) -> NDArray[np.uint8]:
    """Return an affine crop in continuous coordinates: (0, 0) is the corner of either image.

    Args:
        image: (H, W, 3).
        out_from_image: (2, 3).
        size: width and height of the result.
        oversampling: samples per pixel and side, averaged.
        outside: grey level outside the image.
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
        borderValue=(outside,) * 3,
    )
    if k > 1:
        out = cv2.resize(out, size, interpolation=cv2.INTER_AREA)
    return np.asarray(out, dtype=np.uint8)


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


def degraded(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return the image with random blur, motion blur or compression, or unchanged."""
    kind = rng.random()
    if kind < 0.15:
        return np.asarray(cv2.GaussianBlur(image, (0, 0), rng.uniform(0.4, 1.2)), dtype=np.uint8)
    if kind < 0.22:
        kernel = np.zeros((5, 5), np.float32)
        length = int(rng.integers(2, 5))
        kernel[2, 2 - length // 2 : 2 - length // 2 + length] = 1.0 / length
        kernel = kernel if rng.random() < 0.6 else kernel.T.copy()
        return np.asarray(cv2.filter2D(image, -1, kernel), dtype=np.uint8)
    if kind < 0.32:
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(30, 90))]
        return np.asarray(
            cv2.imdecode(cv2.imencode(".jpg", image, quality)[1], cv2.IMREAD_COLOR), dtype=np.uint8
        )
    return image


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
            image[y1:y2, x1:x2] = source[:, :: -1 if rng.random() < 0.5 else 1]
        else:
            image[y1:y2, x1:x2] = rng.integers(0, 256, 3)
    return image, box


def inside_of(points: NDArray[Any], box: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return flags (…) of the points (…, 2) that lie in a rectangle."""
    return np.asarray(((points >= box[:2]) & (points <= box[2:])).all(axis=-1))
