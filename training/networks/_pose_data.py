"""Crops of people as training data of the pose network."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ._augment import (
    box_around,
    covered,
    emptied_outside,
    inside_of,
    moved,
    photographed_layers,
    reduced,
    sheared,
    similarity,
    warp,
    with_surroundings,
    within_rectangle,
)
from ._batch import Batch, stacked
from ._degradation import random_degradation
from ._pose_net import HEIGHT, WIDTH
from ._samples import PersonTruth, layered_picture
from ._shard_file import read_shards
from ._textures import Backgrounds

_SWAP: Final = [0, 2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13, 16, 15]
_PADDING: Final = 1.25
_MIN_BOX_PX: Final = 12.0
# Person crops are black outside the image, as OpenMMLab's are.
_OUTSIDE: Final = 0
_BACKGROUND_SHARE: Final = 0.45
# Larger people are stored with fewer pixels: half more than the network's input has.
_MOST_PX: Final = 1.5 * HEIGHT


@dataclass
class PersonSample:
    """A person; pixels count from the corner of ``image``.

    Attributes:
        image: (H, W, 4), or (H, W, 3) once it is photographed.
        outline: (32, 2).
        keypoints: (17, 2).
        keypoints_root_m: (17, 3).
        visible: (17,).
        inside: (4, 2) corners of the camera's picture.
        scale: pixels of the image per pixel of the camera, ≤ 1.
    """

    image: NDArray[np.uint8]
    outline: NDArray[np.float64]
    keypoints: NDArray[np.float64]
    keypoints_root_m: NDArray[np.float64]
    visible: NDArray[np.bool_]
    inside: NDArray[np.float64]
    scale: float = 1.0

    @property
    def box(self) -> NDArray[np.float64]:
        """The box (4,) around the visible pixels."""
        return box_around(self.outline)


class PoseData:
    """All people of some shards, in memory.

    Args:
        folder: of the shards.
        seed: of all distortions.
        backgrounds: number of random backgrounds.
    """

    def __init__(self, folder: Path, seed: int, backgrounds: int = 1) -> None:
        self._seed = seed
        self.backgrounds = Backgrounds(backgrounds, seed + 1)
        self.people: list[PersonSample] = []
        for shard in read_shards(folder):
            for patch in shard.people:
                self._add(layered_picture(patch.png), patch.origin_px, patch.size_px, patch.person)
            for frame in shard.frames:
                image = layered_picture(frame.png)
                size = (image.shape[1], image.shape[0])
                for person in frame.people:
                    self._add(image, (0, 0), size, person)

    def _add(
        self,
        image: NDArray[np.uint8],
        origin: tuple[int, int],
        size: tuple[int, int],
        person: PersonTruth,
    ) -> None:
        box = person.box_xyxy_px.astype(np.float64)
        extent = box[2:] - box[:2]
        if extent.min() < _MIN_BOX_PX or person.visible.sum() < 3:
            return
        # Half the size of the largest distorted crop.
        half = 0.5 * _PADDING * max(extent[0], extent[1] * WIDTH / HEIGHT) * 1.25
        half = np.array([half, half * HEIGHT / WIDTH])
        middle = 0.5 * (box[:2] + box[2:])
        low = np.maximum(np.floor(middle - half).astype(int) - origin, 0)
        high = np.minimum(np.ceil(middle + half).astype(int) - origin, image.shape[1::-1])
        cut = np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]])
        corner = (int(low[0]) + origin[0], int(low[1]) + origin[1])
        cut, corner = with_surroundings(cut, corner, size, int(0.12 * extent.max()) + 2, _OUTSIDE)
        at = np.array(corner, dtype=np.float64)
        cut, scale = reduced(cut, _MOST_PX / max(extent[0], extent[1]))
        self.people.append(
            PersonSample(
                cut,
                (person.outline_px.astype(np.float64) - at) * scale,
                (person.keypoints_px.astype(np.float64) + 0.5 - at) * scale,
                person.keypoints_root_m.astype(np.float64),
                person.visible,
                (np.array([[0, 0], [size[0], 0], size, [0, size[1]]]) - at) * scale,
                float(scale.min()),
            )
        )

    def batch(self, step: int, count: int = 32) -> Batch:
        """Return ``count`` random, distorted crops; the same step gives the same crops."""
        rng = np.random.default_rng([self._seed, 32, step])
        return stacked([self.distorted(rng) for _ in range(count)])

    def still(self, start: int, stop: int) -> Batch:
        """Return crops ``start`` to ``stop``, cut as in use, not distorted."""
        return stacked(
            [_crop(p, np.zeros(2), 1.0, 0.0, flip=False) for p in self.people[start:stop]]
        )

    def distorted(self, rng: np.random.Generator) -> dict[str, Any]:
        """Return a random crop of a random person as a random camera takes it."""
        person = self.people[int(rng.integers(len(self.people)))]
        sample = _crop(
            self._photographed(person, rng),
            np.clip(rng.normal(0.0, 0.035, 2), -0.12, 0.12),
            float(np.exp(np.clip(rng.normal(0.0, 0.09), -0.22, 0.22))),
            np.radians(rng.normal(0.0, 7.0)) if rng.random() < 0.5 else 0.0,
            flip=bool(rng.random() < 0.5),
        )
        if rng.random() < 0.3:
            other = self.people[int(rng.integers(len(self.people)))].image
            sample["image"], box = covered(sample["image"], rng, other[..., :3])
            sample["visible"] = sample["visible"] & ~inside_of(sample["keypoints"], box)
        return sample

    def _photographed(self, person: PersonSample, rng: np.random.Generator) -> PersonSample:
        """Return the person before a random background, sheared and degraded by a camera."""
        extent = person.box[2:] - person.box[:2]
        degradation = random_degradation(rng, size_px=0.25 * extent.max() / person.scale)
        image, outline, keypoints = person.image, person.outline, person.keypoints
        if degradation.shutter_shear:
            middle_row = 0.5 * (person.box[1] + person.box[3])
            image, matrix = sheared(image, degradation.shutter_shear, middle_row)
            low, high = person.inside.min(axis=0), person.inside.max(axis=0)
            left = within_rectangle(moved(outline, matrix), low, high)
            outline = outline if left is None else left
            keypoints = moved(keypoints, matrix)
        background = self.backgrounds.sometimes(rng, _BACKGROUND_SHARE)
        image = photographed_layers(image, degradation, rng, background, person.scale)
        image = emptied_outside(image, person.inside, _OUTSIDE)
        return replace(person, image=image, outline=outline, keypoints=keypoints)


def _crop(
    person: PersonSample, shift: NDArray[np.float64], enlarged: float, angle: float, *, flip: bool
) -> dict[str, Any]:
    """Return a crop of a person with its keypoints, shifted by ``shift`` of its size."""
    extent = (person.box[2:] - person.box[:2]) * _PADDING
    width = max(extent[0], extent[1] * WIDTH / HEIGHT) * enlarged
    height = width * HEIGHT / WIDTH
    middle = 0.5 * (person.box[:2] + person.box[2:]) + shift * [width, height]
    matrix = similarity(middle, WIDTH / width, angle, (WIDTH, HEIGHT), flip=flip)
    image = warp(person.image, matrix, (WIDTH, HEIGHT), outside=_OUTSIDE)[..., :3]
    keypoints = moved(person.keypoints, matrix)
    depth, visible = person.keypoints_root_m[:, 2], person.visible
    if flip:
        keypoints, depth, visible = keypoints[_SWAP], depth[_SWAP], visible[_SWAP]
    within = inside_of(keypoints, np.array([0.0, 0.0, WIDTH, HEIGHT]))
    return {
        "image": image,
        "keypoints": keypoints,
        "within": within,
        "visible": visible & within,
        "depth": depth,
    }
