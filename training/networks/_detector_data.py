"""Whole images as training data of the detector."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray

from perception import Camera
from perception.shipped import detector_input_size

from ._augment import (
    box_around,
    composed,
    covered,
    emptied_outside,
    moved,
    photographed_layers,
    similarity,
    warp,
    within_rectangle,
)
from ._batch import Batch, stacked_images
from ._degradation import random_degradation, rolling_shutter
from ._detector_net import HEIGHT, WIDTH
from ._samples import DIRECTIONS, layered_picture
from ._shard_file import read_shards
from ._textures import Backgrounds

#: Number to which the people of an image are padded in a batch.
MAX_PEOPLE: Final = 8
# People who show less than this (pixels of a 640 × 480 image, keypoints) are ignored.
_MIN_PIXELS: Final = 350
_MIN_KEYPOINTS: Final = 4
# Share of images with a random background, and of images of a background alone.
_BACKGROUND_SHARE: Final = 0.65
_EMPTY_SHARE: Final = 0.08


@dataclass
class Frame:
    """A whole image as rendered.

    Attributes:
        layers: (H, W, 4).
        outlines: (N, 32, 2) of the people, from the image's corner.
        wanted: (N,) whether a person is to be found.
        scale: pixels of the network's input in use per pixel of the image.
    """

    layers: NDArray[np.uint8]
    outlines: NDArray[np.float64]
    wanted: NDArray[np.bool_]
    scale: float


@dataclass
class FrameSample:
    """An input image or its layers, boxes (N, 4), and which of them (N,) are to be found."""

    image: NDArray[np.uint8]
    boxes: NDArray[np.float64]
    wanted: NDArray[np.bool_]


class DetectorData:
    """All whole images of some shards, in memory.

    Args:
        folder: of the shards.
        seed: of all distortions.
        backgrounds: number of random backgrounds.
    """

    def __init__(self, folder: Path, seed: int, backgrounds: int = 1) -> None:
        self._seed = seed
        self.backgrounds = Backgrounds(backgrounds, seed)
        self.frames: list[Frame] = []
        for shard in read_shards(folder):
            for frame in shard.frames:
                outlines = [person.outline_px for person in frame.people]
                wanted = [
                    person.pixels >= _MIN_PIXELS and person.visible.sum() >= _MIN_KEYPOINTS
                    for person in frame.people
                ]
                layers = layered_picture(frame.png)
                self.frames.append(
                    Frame(
                        layers,
                        np.array(outlines, dtype=np.float64).reshape(-1, DIRECTIONS, 2),
                        np.array(wanted, dtype=bool),
                        _scale_in_use(layers, frame.focal_px),
                    )
                )
        # Images of wide lenses get a much larger input in use, so they are not judged whole.
        self._whole = [f for f in self.frames if f.scale <= 1.4 * _fit_scale(f.layers)]

    def batch(self, step: int, count: int = 16) -> Batch:
        """Return ``count`` random, distorted images; the same step gives the same images."""
        rng = np.random.default_rng([self._seed, 42, step])
        return _stacked([self.distorted(rng) for _ in range(count)])

    @property
    def stills(self) -> int:
        """The number of images of :meth:`still`."""
        return len(self._whole)

    def still(self, start: int, stop: int) -> Batch:
        """Return images ``start`` to ``stop``, whole and letterboxed, not distorted."""
        samples = []
        for frame in self._whole[start:stop]:
            sample, inside = _placed(frame, _fit_scale(frame.layers), np.zeros(2))
            sample.image = emptied_outside(np.ascontiguousarray(sample.image[..., :3]), inside)
            samples.append(sample)
        return _stacked(samples)

    def distorted(self, rng: np.random.Generator) -> FrameSample:
        """Return a random image as a random camera takes it."""
        degradation = random_degradation(rng)
        if rng.random() < _EMPTY_SHARE:
            layers = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
            image = photographed_layers(layers, degradation, rng, self.backgrounds.random(rng), 0.5)
            return FrameSample(image, np.zeros((0, 4)), np.zeros(0, bool))
        frame = self.frames[int(rng.integers(len(self.frames)))]
        scale = frame.scale * float(np.exp(np.clip(rng.normal(0.0, 0.4), -1.1, 1.1)))
        size = np.array([WIDTH, HEIGHT]) / scale
        slack = np.abs(size - frame.layers.shape[1::-1])
        turn = rng.normal(0.0, 3.0) if rng.random() < 0.8 else rng.normal(0.0, 14.0)
        sample, inside = _placed(
            frame,
            scale,
            rng.uniform(-0.5, 0.5, 2) * slack,
            flip=bool(rng.random() < 0.5),
            angle=np.radians(turn),
            shear=degradation.shutter_shear,
        )
        for _ in range(int(rng.integers(0, 3))):
            if rng.random() < 0.35:
                layers, box = covered(sample.image, rng, self.backgrounds.random(rng))
                sample = _hidden(FrameSample(layers, sample.boxes, sample.wanted), box)
        background = self.backgrounds.sometimes(rng, _BACKGROUND_SHARE)
        image = photographed_layers(sample.image, degradation, rng, background, scale)
        return FrameSample(emptied_outside(image, inside), sample.boxes, sample.wanted)


def _fit_scale(image: NDArray[np.uint8]) -> float:
    return min(WIDTH / image.shape[1], HEIGHT / image.shape[0])


def _scale_in_use(image: NDArray[np.uint8], focal_px: float) -> float:
    height, width = image.shape[:2]
    camera = Camera(width, height, focal_px, focal_px, 0.5 * width, 0.5 * height)
    input_height, input_width = detector_input_size(camera)
    return min(input_width / width, input_height / height)


def _placed(
    frame: Frame,
    scale: float,
    shift: NDArray[np.float64],
    *,
    flip: bool = False,
    angle: float = 0.0,
    shear: float = 0.0,
) -> tuple[FrameSample, NDArray[np.float64]]:
    """Return the layers sheared by a rolling shutter, then scaled, shifted, turned and mirrored.

    Boxes are taken anew from the outlines, so they stay tight.

    Returns:
        The sample, and the corners (4, 2) of the picture in it.
    """
    height, width = frame.layers.shape[:2]
    middle = 0.5 * np.array([width, height]) + shift
    placed = similarity(middle, scale, angle, (WIDTH, HEIGHT), flip=flip)
    inside = moved(np.array([[0, 0], [width, 0], [width, height], [0, height]]), placed)
    shutter = rolling_shutter(shear, 0.5 * height)
    layers = warp(frame.layers, composed(placed, shutter), (WIDTH, HEIGHT), outside=None)
    boxes, wanted = [], []
    for outline, is_wanted in zip(frame.outlines, frame.wanted.tolist(), strict=True):
        # A person whom the shutter moves beyond the picture's edge ends there.
        seen = within_rectangle(moved(outline, shutter), np.zeros(2), np.array([width, height]))
        if seen is None:
            continue
        whole = moved(seen, placed)
        part = within_rectangle(whole, np.zeros(2), np.array([WIDTH, HEIGHT]))
        if part is None:
            continue
        (size, left) = np.ptp(part, axis=0), _area(part) / max(_area(whole), 1e-9)
        if size.min() > 2.0 and left > 0.05:
            boxes.append(box_around(part))
            wanted.append(is_wanted and left > 0.25 and size.min() > 5.0)
    found = np.array(boxes, dtype=np.float64).reshape(-1, 4)
    return FrameSample(layers, found, np.array(wanted, dtype=bool)), inside


def _area(outline: NDArray[np.float64]) -> float:
    """Return the area of a box around points (K, 2)."""
    return float(np.prod(np.ptp(outline, axis=0)))


def _hidden(frame: FrameSample, cover: NDArray[np.float64]) -> FrameSample:
    """Return the sample after a rectangle hides something: boxes are cut where a side is hidden."""
    boxes, wanted = frame.boxes.copy(), frame.wanted.copy()
    for row, (x1, y1, x2, y2) in enumerate(boxes):
        across = cover[0] <= x1 and cover[2] >= x2
        along = cover[1] <= y1 and cover[3] >= y2
        overlap = max(0.0, min(x2, cover[2]) - max(x1, cover[0])) * max(
            0.0, min(y2, cover[3]) - max(y1, cover[1])
        )
        if overlap > 0.6 * (x2 - x1) * (y2 - y1):
            wanted[row] = False
        if across and cover[1] <= y1 < cover[3]:
            boxes[row, 1] = min(cover[3], y2)
        if across and cover[1] < y2 <= cover[3]:
            boxes[row, 3] = max(cover[1], boxes[row, 1])
        if along and cover[0] <= x1 < cover[2]:
            boxes[row, 0] = min(cover[2], x2)
        if along and cover[0] < x2 <= cover[2]:
            boxes[row, 2] = max(cover[0], boxes[row, 0])
    size = boxes[:, 2:] - boxes[:, :2]
    keep = size.min(axis=1, initial=np.inf) > 2.0 if len(boxes) else np.zeros(0, bool)
    wanted &= keep
    return FrameSample(frame.image, boxes[keep], wanted[keep])


def _stacked(samples: list[FrameSample]) -> Batch:
    """Return the samples as one batch, boxes padded to ``MAX_PEOPLE``."""
    boxes = np.zeros((len(samples), MAX_PEOPLE, 4), np.float32)
    kind = np.zeros((len(samples), MAX_PEOPLE), np.float32)  # 0 no person, 1 to be found, 2 ignored
    for row, sample in enumerate(samples):
        count = min(len(sample.boxes), MAX_PEOPLE)
        boxes[row, :count] = sample.boxes[:count]
        kind[row, :count] = np.where(sample.wanted[:count], 1.0, 2.0)
    return {
        "image": stacked_images([sample.image for sample in samples]),
        "boxes": torch.from_numpy(boxes),
        "kind": torch.from_numpy(kind),
    }
