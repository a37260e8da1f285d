"""Random looks of a worker: clothes of any pattern, skin and hair of other tones.

A texture is changed by the part of the body that its texels lie on. Faces keep their features:
their colours are changed, and a weak pattern is laid over them. Clothes get a pattern of their own
under the folds that were painted on them.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_tests.actors.body import JOINTS, load_worker

from ._textures import random_texture

Image = NDArray[np.uint8]

#: Parts of a body, as in :func:`parts_of_texture`.
HEAD, HANDS, UPPER, LOWER, FEET = range(5)
_PART_OF_JOINT: Final = {
    "neck": HEAD,
    "left_eye": HEAD,
    "right_eye": HEAD,
    "left_wrist": HANDS,
    "right_wrist": HANDS,
    "left_ankle": FEET,
    "right_ankle": FEET,
    "left_hip": LOWER,
    "right_hip": LOWER,
    "left_knee": LOWER,
    "right_knee": LOWER,
}
# Chance that a part of the clothes gets a pattern.
_PATTERN_SHARE: Final = 0.75
_PATTERN_PX: Final = 256
# Range of the mean level of head and hands.
_SKIN_MEANS: Final = (58.0, 190.0)


def random_look(look: str, rng: np.random.Generator) -> tuple[Image, ...]:
    """Return a texture for each level of detail of a worker, finest first."""
    asset = load_worker(look)
    # The same patterns and tones on every level.
    patterns = {
        part: random_texture(rng, (_PATTERN_PX, _PATTERN_PX)) if rng.random() < share else None
        for part, share in ((UPPER, _PATTERN_SHARE), (LOWER, _PATTERN_SHARE), (FEET, 0.5))
    }
    if rng.random() < 0.15:  # overalls
        patterns[LOWER] = patterns[UPPER]
    skin = _tone(rng)
    makeup = random_texture(rng, (_PATTERN_PX, _PATTERN_PX)) if rng.random() < 0.5 else None
    strength = float(rng.uniform(0.03, 0.16))
    textures = []
    for level, mesh in enumerate(asset.levels):
        parts = parts_of_texture(look, level)
        rgb = mesh.texture_rgb.astype(np.float32)
        naked = (parts == HEAD) | (parts == HANDS)
        toned = _toned(rgb, naked, *skin)
        if makeup is not None:
            toned *= 1.0 + strength * (_enlarged(makeup, rgb.shape) / 127.5 - 1.0)
        out = np.where(naked[..., None], toned, rgb)
        light = cv2.GaussianBlur(rgb.mean(axis=2), (0, 0), max(1.0, 0.012 * len(rgb)))
        folds = np.clip((rgb.mean(axis=2) + 12.0) / (light + 12.0), 0.5, 1.4)[..., None]
        for part, pattern in patterns.items():
            if pattern is not None:
                drawn = _enlarged(pattern, rgb.shape) * folds
                out = np.where((parts == part)[..., None], drawn, out)
        textures.append(np.asarray(np.clip(out, 0.0, 255.0), dtype=np.uint8))
    return tuple(textures)


@lru_cache(maxsize=256)
def parts_of_texture(look: str, level: int) -> NDArray[np.uint8]:
    """Return the part of the body (H, W) that each texel lies on."""
    mesh = load_worker(look).levels[level]
    height, width = mesh.texture_rgb.shape[:2]
    of_joint = np.array([_PART_OF_JOINT.get(name, UPPER) for name in JOINTS], dtype=np.uint8)
    # The joint farthest from the trunk that a triangle follows; the pelvis follows none.
    follows = mesh.weights[mesh.triangles].mean(axis=1) > 0.5
    last = len(JOINTS) - 1 - np.argmax(follows[:, ::-1], axis=1)
    part = np.where(follows.any(axis=1), of_joint[last], LOWER)
    # The first row of a texture lies at v = 1.
    uv = mesh.uv[mesh.triangles] * [1.0, -1.0] + [0.0, 1.0]
    corners = np.round(uv * [width, height] - 0.5).astype(np.int32)
    out = np.full((height, width), 255, np.uint8)
    for triangle, number in zip(corners, part.tolist(), strict=True):
        cv2.fillConvexPoly(out, triangle, number)
    # The margins between the pieces belong to the nearest one, as their colours do.
    _, labels = cv2.distanceTransformWithLabels(
        (out == 255).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    values = np.zeros(int(labels.max()) + 1, np.uint8)
    known = out != 255
    values[labels[known]] = out[known]
    return np.asarray(values[labels], dtype=np.uint8)


def _tone(rng: np.random.Generator) -> tuple[float, NDArray[np.float32]]:
    """Return an exponent and factors (3,) on red, green and blue."""
    gamma = float(np.exp(rng.normal(0.0, 0.25)))
    factors = np.exp(rng.normal(0.0, 0.08, 3) + rng.normal(0.0, 0.18))
    return gamma, np.asarray(factors, dtype=np.float32)


def _toned(
    rgb: NDArray[np.float32],
    naked: NDArray[np.bool_],
    gamma: float,
    factors: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Return other tones, but none so dark or light that a face loses its features."""
    out = 255.0 * (rgb / 255.0) ** gamma * factors
    mean = float(out[naked].mean()) if naked.any() else _SKIN_MEANS[0]
    return np.asarray(out * (float(np.clip(mean, *_SKIN_MEANS)) / max(mean, 1.0)), np.float32)


def _enlarged(pattern: Image, shape: tuple[int, ...]) -> NDArray[np.float32]:
    resized = cv2.resize(pattern, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
    return np.asarray(resized, dtype=np.float32)
