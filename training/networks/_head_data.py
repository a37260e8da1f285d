"""Head crops as training data of the head network."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.networks.heads import ray_axes, ray_stretch

from ._augment import covered, degraded, inside_of, warp, with_surroundings
from ._batch import Batch, stacked
from ._head_sample import LEAST_SEEN, SIZE, HeadSample, cropped
from ._samples import HEAD_SIDE_M, ImageSample, Patch, PersonTruth, picture
from ._shard_file import read_shards

#: Part of an image kept around a head, as a share of the crop's side.
_REACH: Final = 0.95
#: Share of crops without a head.
_NEGATIVES: Final = 0.05
#: Share of the training after which crops are distorted less.
LATE: Final = 0.75
_MIN_SIDE_PX: Final = 10.0
_MIN_COARSE_PX: Final = 18.0


class HeadData:
    """All heads of some shards, in memory."""

    def __init__(self, folder: Path, seed: int, first: int = 0, last: int | None = None) -> None:
        self._seed = seed
        self.heads: list[HeadSample] = []
        self.others: list[NDArray[np.uint8]] = []
        rng = np.random.default_rng([seed, 21])
        for shard in read_shards(folder, first, last):
            for patch in [*shard.heads, *shard.people]:
                self._add(_of_patch(patch))
            for frame in shard.frames:
                image = picture(frame.png)
                for person in frame.people:
                    self._add(_of_frame(frame, image, person))
                self.others += list(_elsewhere(frame, image, rng))

    def _add(self, sample: HeadSample | None) -> None:
        if sample is not None:
            self.heads.append(sample)

    def batch(self, step: int, done: float, count: int = 64) -> Batch:
        """Return ``count`` random crops; the same step gives the same crops.

        Crops are distorted less from ``LATE`` on, the last quarter of the training.
        """
        rng = np.random.default_rng([self._seed, 22, step])
        strength = 1.0 if done < LATE else 0.5
        return stacked([self._distorted(rng, strength) for _ in range(count)])

    def still(self, start: int, stop: int, jitter: float = 0.05, spread: float = 0.07) -> Batch:
        """Return crops ``start`` to ``stop``, placed as in use, not distorted."""
        rng = np.random.default_rng([self._seed, 23, start])
        return stacked(
            [
                cropped(
                    head, rng.normal(0, jitter, 2), np.exp(rng.normal(0, spread)), 0.0, flip=False
                )
                for head in self.heads[start:stop]
            ]
        )

    def _distorted(self, rng: np.random.Generator, strength: float) -> dict[str, Any]:
        if rng.random() < _NEGATIVES:
            return self._nobody(rng)
        head = self.heads[int(rng.integers(len(self.heads)))]
        angle = np.radians(rng.normal(0.0, 12.0)) if rng.random() < 0.5 else 0.0
        # First guesses lie this far off the head; the second pass is nearer.
        wide = 1.0 if rng.random() < 0.5 * strength else 0.4
        shift = np.clip(rng.normal(0.0, 0.11 * wide, 2), -0.3, 0.3)
        enlarged = float(np.exp(np.clip(rng.normal(0.0, 0.17 * wide), -0.4, 0.4)))
        coarse = None
        if rng.random() < 0.3 * strength:
            low = min(_MIN_COARSE_PX, head.side_px)
            coarse = int(np.exp(rng.uniform(np.log(low), np.log(max(head.side_px, low + 1.0)))))
        sample = cropped(head, shift, enlarged, angle, flip=bool(rng.random() < 0.5), coarse=coarse)
        if rng.random() < 0.16 * strength:
            other = self.others[int(rng.integers(len(self.others)))]
            _hide(sample, rng, other)
        sample["image"] = degraded(sample["image"], rng)
        return sample

    def _nobody(self, rng: np.random.Generator) -> dict[str, Any]:
        """Return a crop without a head."""
        other = self.others[int(rng.integers(len(self.others)))]
        height, width = other.shape[:2]
        image = warp(other, np.array([[64 / width, 0, 0], [0, 64 / height, 0.0]]), (SIZE, SIZE))
        if rng.random() < 0.5:
            image = np.ascontiguousarray(image[:, ::-1])
        return {
            "image": degraded(image, rng),
            "rotation": np.eye(3),
            "keypoints": np.full((5, 2), 0.5),
            "visible": np.zeros(5, bool),
            "centre": np.full(2, 0.5),
            "log_side": 0.0,
            "head": 0.0,
            "weight": 0.0,
        }


def _of_patch(patch: Patch) -> HeadSample | None:
    return _sample(
        picture(patch.png), patch.origin_px, patch.size_px, patch.intrinsics_px, patch.person
    )


def _of_frame(
    frame: ImageSample, image: NDArray[np.uint8], person: PersonTruth
) -> HeadSample | None:
    height, width = image.shape[:2]
    principal = (width / 2.0, height / 2.0)
    return _sample(image, (0, 0), (width, height), (frame.focal_px, *principal), person)


def _sample(
    image: NDArray[np.uint8],
    origin: tuple[int, int],
    size: tuple[int, int],
    intrinsics: tuple[float, float, float],
    person: PersonTruth,
) -> HeadSample | None:
    """Return a head with its surroundings; None for one that is too small or hidden."""
    focal, cx, cy = intrinsics
    x, y, z = person.head_centre_camera_m.tolist()
    # Continuous coordinates: half a pixel more than those of pixel centres.
    centre = np.array([focal * x / z + cx + 0.5, focal * y / z + cy + 0.5])
    side = HEAD_SIDE_M * focal / float(np.sqrt(x * x + y * y + z * z))
    if side < _MIN_SIDE_PX or person.head_seen < 0.05:
        return None
    stretch = ray_stretch(ray_axes(np.array([[x / z, y / z]])))[0]
    reach = np.ceil(_REACH * side * np.abs(stretch).sum(axis=1)).astype(int)
    low = np.floor(centre).astype(int) - reach
    high = low + 2 * reach
    # The part of that rectangle that the patch has.
    height, width = image.shape[:2]
    left, top = np.maximum(low - origin, 0).tolist()
    right, bottom = np.minimum(high - origin, [width, height]).tolist()
    if right - left < 4 or bottom - top < 4:
        return None
    cut = image[top:bottom, left:right]
    cut_origin = (left + origin[0], top + origin[1])
    cut, cut_origin = with_surroundings(cut, cut_origin, size, max(4, int(0.3 * side)))
    corner = np.array(cut_origin, dtype=np.float64)
    return HeadSample(
        image=cut,
        centre=centre - corner,
        side_px=float(side),
        keypoints=person.keypoints_px[:5] + 0.5 - corner,
        visible=person.visible[:5],
        focal_px=focal,
        principal_point=np.array([cx, cy]) + 0.5 - corner,
        rotation_camera_head=person.rotation_camera_head.astype(np.float64),
        seen=person.head_seen,
    )


def _hide(sample: dict[str, Any], rng: np.random.Generator, other: NDArray[np.uint8]) -> None:
    """Hide a part of the head behind another image."""
    sample["image"], box = covered(sample["image"], rng, other)
    box = box / SIZE
    sample["visible"] = sample["visible"] & ~inside_of(sample["keypoints"], box)
    v, u = np.mgrid[-1:1:9j, -1:1:9j].reshape(2, -1)
    disk = np.stack([u, v], axis=1)[u**2 + v**2 <= 1.0]
    # A disk of the size of the head, as in the shards.
    points = sample["centre"] + disk * 0.2 * np.exp(-sample["log_side"])
    hidden = inside_of(points, box).mean()
    if hidden > 1.0 - LEAST_SEEN:
        sample["head"] = 0.0
    if hidden > 0.8:
        sample["weight"] = 0.0


def _elsewhere(
    frame: ImageSample, image: NDArray[np.uint8], rng: np.random.Generator
) -> Iterable[NDArray[np.uint8]]:
    """Yield squares of an image without a head in their middle; about half of them on bodies."""
    height, width = image.shape[:2]
    for _ in range(2):
        side = float(np.exp(rng.uniform(np.log(20.0), np.log(140.0))))
        centre = rng.uniform([0.0, 0.0], [width, height])
        if frame.people and rng.random() < 0.6:
            person = frame.people[int(rng.integers(len(frame.people)))]
            centre = rng.uniform(person.box_xyxy_px[:2], person.box_xyxy_px[2:])
        near = False
        for person in frame.people:
            x, y, z = person.head_centre_camera_m.tolist()
            head = np.array([x, y]) * frame.focal_px / z + [width / 2.0, height / 2.0]
            size = HEAD_SIDE_M * frame.focal_px / z
            near |= bool(np.abs(head - centre).max() < 0.5 * side + 0.25 * size)
        if near:
            continue
        half = side / 2.0
        low = np.maximum(centre - half, 0.0).astype(int)
        high = np.minimum(centre + half, [width, height]).astype(int)
        if (high - low).min() > 8:
            yield image[low[1] : high[1], low[0] : high[0]].copy()
