"""Head crops as training data of the head network."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.networks.heads import ray_axes, ray_stretch

from ._augment import (
    covered,
    emptied_outside,
    inside_of,
    moved,
    photographed_layers,
    random_part,
    reduced,
    sheared,
    warp,
    with_surroundings,
)
from ._batch import Batch, stacked
from ._degradation import degrade, random_degradation
from ._head_sample import LEAST_SEEN, SIZE, HeadSample, cropped
from ._samples import HEAD_SIDE_M, ImageSample, Patch, PersonTruth, layered_picture
from ._shard_file import read_shards
from ._textures import Backgrounds

#: Part of an image kept around a head, as a share of the crop's side.
_REACH: Final = 0.95
#: Share of crops without a head.
_NEGATIVES: Final = 0.06
_BACKGROUND_SHARE: Final = 0.4
#: Share of the held-out crops of :meth:`HeadData.still` that a camera degrades on request.
DEGRADED_SHARE: Final = 0.5
#: Share of the training after which crops are distorted less.
LATE: Final = 0.75
_MIN_SIDE_PX: Final = 10.0
_MIN_COARSE_PX: Final = 18.0
# Larger heads are stored with fewer pixels, still more than the network's input has.
_MOST_SIDE_PX: Final = 1.5 * SIZE


class HeadData:
    """All heads of some shards, in memory.

    Args:
        folder: of the shards.
        seed: of all distortions.
        backgrounds: number of random backgrounds.
    """

    def __init__(self, folder: Path, seed: int, backgrounds: int = 1) -> None:
        self._seed = seed
        self.backgrounds = Backgrounds(backgrounds, seed + 2)
        self.heads: list[HeadSample] = []
        self.others: list[NDArray[np.uint8]] = []
        rng = np.random.default_rng([seed, 21])
        for shard in read_shards(folder):
            for patch in [*shard.heads, *shard.people]:
                self._add(_of_patch(patch))
            for frame in shard.frames:
                image = layered_picture(frame.png)
                for person in frame.people:
                    self._add(_of_frame(frame, image, person))
                self.others += list(_elsewhere(frame, image[..., :3], rng))

    def _add(self, sample: HeadSample | None) -> None:
        if sample is not None:
            self.heads.append(sample)

    def batch(self, step: int, done: float, count: int = 64, crops: int = 1) -> Batch:
        """Return ``count`` random crops; the same step gives the same crops.

        Crops are distorted less from ``LATE`` on, the last quarter of the training. ``crops`` of
        them are cut from each photographed head: a photograph costs five times as much as a crop.
        """
        rng = np.random.default_rng([self._seed, 22, step % 2**32])
        strength = 1.0 if done < LATE else 0.5
        samples: list[dict[str, Any]] = []
        while len(samples) < count:
            samples += self._crops(rng, strength, min(crops, count - len(samples)))
        return stacked(samples)

    def still(
        self,
        start: int,
        stop: int,
        jitter: float = 0.05,
        spread: float = 0.07,
        *,
        degraded: bool = False,
    ) -> Batch:
        """Return crops ``start`` to ``stop``, placed as in use.

        They are as rendered, or with ``degraded`` half of them as random cameras take them before
        random backgrounds.
        """
        rng = np.random.default_rng([self._seed, 23, start])
        effects = np.random.default_rng([self._seed, 24, start])
        return stacked(
            [
                cropped(
                    self._photographed(head, effects, 1.0)
                    if degraded and effects.random() < DEGRADED_SHARE
                    else head,
                    rng.normal(0, jitter, 2),
                    np.exp(rng.normal(0, spread)),
                    0.0,
                    flip=False,
                )
                for head in self.heads[start:stop]
            ]
        )

    def distorted(self, rng: np.random.Generator, strength: float = 1.0) -> dict[str, Any]:
        """Return a random crop as a random camera takes it; ``strength`` below 1 is gentler."""
        (sample,) = self._crops(rng, strength, 1)
        return sample

    def _crops(self, rng: np.random.Generator, strength: float, count: int) -> list[dict[str, Any]]:
        """Return ``count`` crops of one photograph; some show nobody."""
        head = self._photographed(self.heads[int(rng.integers(len(self.heads)))], rng, strength)
        return [
            self._nobody(rng) if rng.random() < _NEGATIVES else self._crop(head, rng, strength)
            for _ in range(count)
        ]

    def _crop(self, head: HeadSample, rng: np.random.Generator, strength: float) -> dict[str, Any]:
        """Return a crop about a head, off as a first guess is, sometimes coarse or half hidden."""
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
        return sample

    def _photographed(
        self, head: HeadSample, rng: np.random.Generator, strength: float
    ) -> HeadSample:
        """Return the head before a random background, sheared and degraded by a camera."""
        # Half of a crop's side is the head itself.
        size_px = 0.5 * head.side_px / head.scale
        degradation = random_degradation(rng, strength, size_px)
        image, keypoints = head.image, head.keypoints
        if degradation.shutter_shear:
            image, matrix = sheared(image, degradation.shutter_shear, float(head.centre[1]))
            keypoints = moved(keypoints, matrix)
        background = self.backgrounds.sometimes(rng, strength * _BACKGROUND_SHARE)
        image = photographed_layers(image, degradation, rng, background, head.scale)
        if head.inside is not None:
            image = emptied_outside(image, head.inside)
        return replace(head, image=image, keypoints=keypoints)

    def _nobody(self, rng: np.random.Generator) -> dict[str, Any]:
        """Return a crop without a head."""
        if rng.random() < 0.4 or not self.others:
            image = random_part(self.backgrounds.random(rng), (SIZE, SIZE), rng)
        else:
            other = self.others[int(rng.integers(len(self.others)))]
            height, width = other.shape[:2]
            image = warp(other, np.array([[64 / width, 0, 0], [0, 64 / height, 0.0]]), (SIZE, SIZE))
            if rng.random() < 0.5:
                image = np.ascontiguousarray(image[:, ::-1])
        return {
            "image": degrade(image, random_degradation(rng, size_px=0.5 * SIZE), rng),
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
        layered_picture(patch.png),
        patch.origin_px,
        patch.size_px,
        patch.intrinsics_px,
        patch.person,
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
    # Both sides by the same factor, so that pixels stay square.
    factor = _MOST_SIDE_PX / side
    if factor < 1.0:
        whole = (np.array(cut.shape[1::-1]) * factor).astype(int) / factor
        cut = cut[: int(whole[1]), : int(whole[0])]
    cut, scales = reduced(cut, factor)
    scale = float(scales.mean())
    return HeadSample(
        image=cut,
        centre=(centre - corner) * scales,
        side_px=float(side) * scale,
        keypoints=(person.keypoints_px[:5] + 0.5 - corner) * scales,
        visible=person.visible[:5],
        focal_px=focal * scale,
        principal_point=(np.array([cx, cy]) + 0.5 - corner) * scales,
        rotation_camera_head=person.rotation_camera_head.astype(np.float64),
        seen=person.head_seen,
        scale=scale,
        inside=(np.array([[0, 0], [size[0], 0], size, [0, size[1]]]) - corner) * scales,
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
