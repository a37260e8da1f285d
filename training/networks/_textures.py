"""Random procedural textures and backgrounds; no photograph is used.

A network that has seen people before one kind of hall only finds people in furniture. Backgrounds
that have nothing in common but the absence of people teach it what does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Image = NDArray[np.uint8]

_PALETTE: Final = (2, 6)
# Size of the stored backgrounds.
_BACKGROUND_HW: Final = (300, 384)
# Colours of wood, concrete, plants, skin and sky, in which real scenery is richer than in others.
_NATURAL: Final = np.array(
    [
        (150, 110, 72), (96, 66, 40), (190, 160, 120), (128, 128, 124), (84, 84, 88),
        (66, 92, 44), (110, 132, 76), (206, 166, 140), (120, 80, 60), (150, 180, 214),
        (232, 230, 224), (36, 34, 36), (178, 44, 38), (40, 70, 130), (222, 190, 60),
    ],
    dtype=np.float32,
)  # fmt: skip


def random_texture(rng: np.random.Generator, size_hw: tuple[int, int]) -> Image:
    """Return a random pattern (H, W, 3): noise, stripes, checks, cells, gradients, or two of them.

    Args:
        rng: random generator.
        size_hw: height and width in pixels.
    """
    out = _coloured(_KINDS[int(rng.integers(len(_KINDS)))](rng, size_hw), rng)
    if rng.random() < 0.4:
        other = _coloured(_KINDS[int(rng.integers(len(_KINDS)))](rng, size_hw), rng)
        mask = _noise(rng, size_hw)[..., None]
        if rng.random() < 0.5:
            mask = (mask > 0.5).astype(np.float32)
        out = out + (other - out) * mask
    if rng.random() < 0.5:
        out = out + rng.uniform(3.0, 14.0) * rng.standard_normal((*size_hw, 1), dtype=np.float32)
    return np.asarray(np.clip(out, 0.0, 255.0), dtype=np.uint8)


def random_background(rng: np.random.Generator, size_hw: tuple[int, int]) -> Image:
    """Return a random picture (H, W, 3) without people.

    A room of three planes or a single texture, with shapes on it: boxes, ellipses, polygons, poles,
    limbs without a body, lines, and light that falls off.

    Args:
        rng: random generator.
        size_hw: height and width in pixels.
    """
    height, width = size_hw
    out = _room(rng, size_hw) if rng.random() < 0.6 else random_texture(rng, size_hw)
    # Many small things or a few large ones.
    count = int(np.exp(rng.uniform(np.log(2.0), np.log(45.0))))
    largest = rng.uniform(0.15, 0.9) / math.sqrt(1.0 + 0.12 * count)
    for _ in range(count):
        _draw_thing(out, rng, largest * math.hypot(height, width))
    if rng.random() < 0.7:
        light = _gradient(rng, size_hw) if rng.random() < 0.5 else _noise(rng, size_hw, 3.0)
        strength = rng.uniform(0.2, 0.8)
        shaded = out.astype(np.float32) * (1.0 - strength * light[..., None])
        out = np.asarray(np.clip(shaded, 0, 255), dtype=np.uint8)
    # From night to snow.
    levels = 255.0 * (np.arange(256) / 255.0) ** float(np.exp(rng.uniform(-1.4, 0.7)))
    out = np.asarray(levels.astype(np.uint8)[out], dtype=np.uint8)
    if rng.random() < 0.8:  # real scenery has less colour
        grey = out.mean(axis=2, keepdims=True)
        out = np.asarray(grey + (out - grey) * rng.uniform(0.15, 1.0), dtype=np.uint8)
    if rng.random() < 0.5:
        out = np.asarray(cv2.GaussianBlur(out, (0, 0), rng.uniform(0.4, 2.5)), dtype=np.uint8)
    return out


class Backgrounds:
    """Random pictures without people; every training step takes random parts of them.

    Args:
        count: number of pictures, ≥ 1.
        seed: of all of them.
    """

    def __init__(self, count: int, seed: int) -> None:
        if count < 1:
            raise ValueError(f"count must be at least 1, got {count}")
        self._pictures = [
            random_background(np.random.default_rng([seed, 51, number]), _BACKGROUND_HW)
            for number in range(count)
        ]

    def random(self, rng: np.random.Generator) -> NDArray[np.uint8]:
        """Return one of the pictures."""
        return self._pictures[int(rng.integers(len(self._pictures)))]

    def sometimes(self, rng: np.random.Generator, share: float) -> NDArray[np.uint8] | None:
        """Return one of the pictures with this probability, else None."""
        return self.random(rng) if rng.random() < share else None


def _noise(
    rng: np.random.Generator, size_hw: tuple[int, int], roughness: float | None = None
) -> Floats:
    """Return multi-scale noise in [0, 1]; a higher roughness means larger shapes."""
    height, width = size_hw
    falloff = float(rng.uniform(0.35, 1.0)) if roughness is None else 1.0 / roughness
    out = np.zeros(size_hw, np.float32)
    weight, cells = 1.0, int(rng.integers(2, 5))
    # A direction in which the noise is stretched, as wood and cloth are.
    stretch = np.exp(rng.normal(0.0, 0.7))
    while cells < max(height, width) and weight > 0.03:
        rows = max(2, round(cells * height / width * stretch))
        grid = rng.random((min(rows, height), min(max(2, cells), width)), dtype=np.float32)
        out += weight * np.asarray(
            cv2.resize(grid, (width, height), interpolation=cv2.INTER_CUBIC), dtype=np.float32
        )
        weight, cells = weight * falloff, cells * 2
    low, high = float(out.min()), float(out.max())
    return np.asarray((out - low) / max(high - low, 1e-6), dtype=np.float32)


def _along(rng: np.random.Generator, size_hw: tuple[int, int]) -> Floats:
    """Return a coordinate in pixels along a random direction, bent a little by noise."""
    height, width = size_hw
    angle = rng.choice([0.0, 0.5 * math.pi, rng.uniform(0.0, math.pi)])
    v, u = np.mgrid[0:height, 0:width].astype(np.float32)
    out = u * np.float32(math.cos(angle)) + v * np.float32(math.sin(angle))
    if rng.random() < 0.4:
        out = out + np.float32(rng.uniform(0.0, 0.12) * width) * _noise(rng, size_hw, 2.5)
    return np.asarray(out, dtype=np.float32)


def _stripes(rng: np.random.Generator, size_hw: tuple[int, int]) -> Floats:
    period = np.float32(np.exp(rng.uniform(np.log(4.0), np.log(max(0.5 * max(size_hw), 4.1)))))
    phase = _along(rng, size_hw) / period % 1.0
    if rng.random() < 0.5:
        return np.asarray(0.5 + 0.5 * np.cos(2.0 * math.pi * phase), dtype=np.float32)
    return np.asarray(phase < rng.uniform(0.2, 0.8), dtype=np.float32)


def _checks(rng: np.random.Generator, size_hw: tuple[int, int]) -> Floats:
    first, second = _stripes(rng, size_hw), _stripes(rng, size_hw)
    if rng.random() < 0.5:
        return np.asarray(0.5 * (first + second), dtype=np.float32)
    return np.asarray(np.abs(first - second), dtype=np.float32)


def _cells(rng: np.random.Generator, size_hw: tuple[int, int]) -> Floats:
    """Return cells of the nearest of random points, each with a level of its own."""
    count = int(np.exp(rng.uniform(np.log(6.0), np.log(300.0))))
    seeds = np.full(size_hw, 255, np.uint8)
    rows, columns = rng.integers(0, size_hw[0], count), rng.integers(0, size_hw[1], count)
    seeds[rows, columns] = 0
    _, labels = cv2.distanceTransformWithLabels(
        seeds, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    levels = rng.random(int(labels.max()) + 1, dtype=np.float32)
    return np.asarray(levels[labels], dtype=np.float32)


def _gradient(rng: np.random.Generator, size_hw: tuple[int, int]) -> Floats:
    height, width = size_hw
    v, u = np.mgrid[0:height, 0:width].astype(np.float32)
    if rng.random() < 0.5:
        centre = rng.uniform(-0.2, 1.2, 2) * [height, width]
        out = np.hypot(v - np.float32(centre[0]), u - np.float32(centre[1]))
    else:
        angle = rng.uniform(0.0, 2.0 * math.pi)
        out = u * np.float32(math.cos(angle)) + v * np.float32(math.sin(angle))
    low, high = float(out.min()), float(out.max())
    return np.asarray((out - low) / max(high - low, 1e-6), dtype=np.float32)


# Noise twice: it is the most common in real scenery.
_KINDS: Final[tuple[Callable[[np.random.Generator, tuple[int, int]], Floats], ...]] = (
    _noise,
    _noise,
    _stripes,
    _checks,
    _cells,
    _gradient,
)


def random_colour(rng: np.random.Generator) -> Floats:
    """Return red, green and blue (3,) in 0–255: a natural colour, a grey, or any."""
    kind = rng.random()
    if kind < 0.55:
        colour = _NATURAL[int(rng.integers(len(_NATURAL)))] * rng.uniform(0.5, 1.2)
        return np.asarray(np.clip(colour + rng.normal(0.0, 14.0, 3), 0, 255), dtype=np.float32)
    if kind < 0.85:
        grey = rng.uniform(10.0, 245.0) + rng.normal(0.0, 6.0, 3)
        return np.asarray(np.clip(grey, 0, 255), dtype=np.float32)
    return np.asarray(rng.uniform(0.0, 255.0, 3), dtype=np.float32)


def _coloured(levels: Floats, rng: np.random.Generator) -> Floats:
    """Return levels in [0, 1] in the colours of a random palette, blended or in steps."""
    count = int(rng.integers(*_PALETTE))
    stops = np.stack([random_colour(rng) for _ in range(count)])
    if rng.random() < 0.5:  # variations of one colour
        stops = stops[:1] * rng.uniform(0.6, 1.3, (count, 1))
    table = np.empty((256, 3), np.float32)
    at = np.linspace(0.0, 1.0, count)
    level = np.linspace(0.0, 1.0, 256)
    for channel in range(3):
        table[:, channel] = np.interp(level, at, stops[:, channel])
    if rng.random() < 0.3:
        table = stops[np.minimum((level * count).astype(int), count - 1)].astype(np.float32)
    return np.asarray(table[(levels * 255.0).astype(np.uint8)], dtype=np.float32)


def _room(rng: np.random.Generator, size_hw: tuple[int, int]) -> Image:
    """Return a wall and a floor that meet at a horizon, and often a second wall and a ceiling."""
    height, width = size_hw
    out = random_texture(rng, size_hw)
    horizon = rng.uniform(0.35, 0.75) * height
    tilt = rng.normal(0.0, 0.04) * width
    floor = _receding(random_texture(rng, size_hw), horizon, size_hw, rng)
    edge = [(0, horizon - tilt), (width, horizon + tilt)]
    _paste(out, floor, [*edge, (width, height), (0, height)])
    if rng.random() < 0.5:
        corner = rng.uniform(0.1, 0.9) * width
        side = random_texture(rng, size_hw)
        lean = rng.uniform(-0.3, 0.3) * height
        outer = width if rng.random() < 0.5 else 0
        _paste(out, side, [(corner, 0), (outer, 0), (outer, horizon + lean), (corner, horizon)])
    if rng.random() < 0.3:
        top = rng.uniform(0.05, 0.3) * height
        _paste(out, random_texture(rng, size_hw), [(0, 0), (width, 0), (width, top), (0, top)])
    return out


def _receding(
    texture: Image, horizon: float, size_hw: tuple[int, int], rng: np.random.Generator
) -> Image:
    """Return a texture on a floor that recedes to the horizon."""
    height, width = size_hw
    narrow = rng.uniform(0.1, 0.45) * width
    source = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    middle = rng.uniform(0.3, 0.7) * width
    target = np.array(
        [[middle - narrow, horizon], [middle + narrow, horizon], [1.6 * width, height],
         [-0.6 * width, height]], np.float32,
    )  # fmt: skip
    matrix = cv2.getPerspectiveTransform(source, target)
    return np.asarray(
        cv2.warpPerspective(texture, matrix, (width, height), borderMode=cv2.BORDER_WRAP),
        dtype=np.uint8,
    )


def _paste(
    out: Image, patch: Image, polygon: list[tuple[float, float]] | NDArray[np.float64]
) -> None:
    mask = np.zeros(out.shape[:2], np.uint8)
    cv2.fillPoly(mask, [np.asarray(polygon).round().astype(np.int32)], (255,), cv2.LINE_AA)
    alpha = mask[..., None].astype(np.float32) / 255.0
    out[...] = np.asarray(out + (patch.astype(np.float32) - out) * alpha, dtype=np.uint8)


def _draw_thing(out: Image, rng: np.random.Generator, size_px: float) -> None:
    """Draw one thing: a box, an ellipse, a polygon, a pole, a limb, a line, or a frame."""
    height, width = out.shape[:2]
    side = max(3.0, size_px * float(rng.uniform(0.25, 1.0)))
    centre = rng.uniform(-0.05, 1.05, 2) * [width, height]
    kind = rng.random()
    if kind < 0.16:
        _draw_line(out, rng, centre, side)
        return
    aspect = float(np.exp(rng.normal(0.0, 0.6)))
    turn = rng.normal(0.0, 0.12) if rng.random() < 0.7 else rng.uniform(0.0, math.pi)
    half = 0.5 * side * np.array([math.sqrt(aspect), 1.0 / math.sqrt(aspect)])
    if kind < 0.42:
        shape = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=np.float64)
    elif kind < 0.60:
        angle = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
        shape = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    elif kind < 0.76:
        angle = np.sort(rng.uniform(0.0, 2.0 * math.pi, int(rng.integers(3, 9))))
        shape = np.stack([np.cos(angle), np.sin(angle)], axis=1) * rng.uniform(
            0.5, 1, (angle.size, 1)
        )
    else:  # a pole, a leg of a chair, an arm of a lamp: long and narrow, wider at one end
        narrow = rng.uniform(0.06, 0.3)
        half = 0.5 * side * np.array([narrow, 1.0])
        end = rng.uniform(0.3, 1.0)
        shape = np.array([[-1, -1], [1, -1], [end, 1], [-end, 1]], dtype=np.float64)
    c, s = math.cos(turn), math.sin(turn)
    polygon = (shape * half) @ np.array([[c, s], [-s, c]]) + centre
    low = np.clip(np.floor(polygon.min(axis=0)) - 1, 0, [width, height]).astype(int)
    high = np.clip(np.ceil(polygon.max(axis=0)) + 1, 0, [width, height]).astype(int)
    if (high - low).min() < 2:
        return
    part = out[low[1] : high[1], low[0] : high[0]]
    size_hw = (part.shape[0], part.shape[1])
    if rng.random() < 0.45 and min(size_hw) > 4:
        patch = random_texture(rng, size_hw)
    else:
        patch = np.broadcast_to(random_colour(rng).astype(np.uint8), part.shape)
    if rng.random() < 0.6:  # rounded by light from one side
        across = np.linspace(-1.0, 1.0, size_hw[1], dtype=np.float32)
        if rng.random() < 0.3:
            light = np.linspace(1.15, 0.6, size_hw[0], dtype=np.float32)[:, None, None]
        else:
            light = (1.1 - 0.5 * (across - np.float32(rng.uniform(-0.8, 0.8))) ** 2)[None, :, None]
        patch = np.asarray(np.clip(patch * light, 0, 255), dtype=np.uint8)
    _paste(part, patch, polygon - low)


def _draw_line(
    out: Image, rng: np.random.Generator, centre: NDArray[np.float64], side: float
) -> None:
    colour = tuple(int(value) for value in random_colour(rng))
    thick = max(1, int(rng.uniform(0.005, 0.06) * side))
    for _ in range(int(rng.integers(1, 5))):
        angle = rng.choice([0.0, 0.5 * math.pi, rng.uniform(0.0, math.pi)])
        reach = side * np.array([math.cos(angle), math.sin(angle)])
        first, last = (centre + sign * reach for sign in (-1.0, 1.0))
        ends = [tuple(int(x) for x in point) for point in (first, last)]
        cv2.line(out, ends[0], ends[1], colour, thick, cv2.LINE_AA)
        centre = centre + rng.normal(0.0, 0.3 * side, 2)
