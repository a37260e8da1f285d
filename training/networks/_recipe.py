"""All numbers of the training recipe, and one run of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path


@dataclass(frozen=True)
class Recipe:
    """Amounts of rendered data and of training.

    The shipped workers, two of the five layouts and the first eight variants of goods and colours
    are left for evaluation.

    Attributes:
        seed: seed of everything random.
        crowd: number of random workers.
        head_shapes: copies of each with a head of another shape.
        scenes: halls with people of the crowd; a scene is rendered as one shard.
        frames: whole images per scene, for the detector and the pose network.
        person_patches: exact crops of people per scene, for the pose network.
        head_patches: exact crops of heads per scene.
        layouts: halls for training.
        variants: first and last variant of goods and colours for training.
        backgrounds: random pictures that stand in for the halls, made for each network anew.
        check_backgrounds: the same for held-out figures.
        detector_steps: optimiser steps.
        pose_steps: optimiser steps.
        head_steps: optimiser steps.
        head_batch: crops of a step.
        head_crops: crops of it that are cut from one photographed head.
        head_rate: highest learning rate.
    """

    seed: int = 0
    crowd: int = 64
    head_shapes: int = 3
    scenes: int = 150
    frames: int = 24
    person_patches: int = 60
    head_patches: int = 400
    layouts: tuple[str, ...] = ("open", "blind_corner", "aisles")
    variants: tuple[int, int] = (8, 200)
    backgrounds: int = 400
    check_backgrounds: int = 40
    detector_steps: int = 12000
    pose_steps: int = 9000
    head_steps: int = 12000
    head_batch: int = 64
    head_crops: int = 4
    head_rate: float = 2.5e-3

    def held_out(self) -> Recipe:
        """Return a recipe with other people, goods and colours, for validation and calibration."""
        first = self.variants[1] + 1
        return replace(
            self,
            seed=self.seed + 1000,
            crowd=min(self.crowd, 5),
            scenes=min(self.scenes, 6),
            person_patches=min(self.person_patches, 40),
            head_patches=min(self.head_patches, 120),
            variants=(first, first + 100),
        )

    def long(self) -> Recipe:
        """Return the recipe of the shipped head network: minutes on a GPU, a day on two cores."""
        return replace(self, head_steps=9266, head_batch=768, head_crops=8, head_rate=4e-3)

    def quick(self) -> Recipe:
        """Return a tiny recipe that checks every stage; its networks are useless."""
        return replace(
            self,
            crowd=2,
            head_shapes=1,
            scenes=2,
            frames=3,
            person_patches=4,
            head_patches=6,
            backgrounds=3,
            check_backgrounds=2,
            detector_steps=2,
            pose_steps=2,
            head_steps=2,
        )


@dataclass(frozen=True)
class Run:
    """The training of one network.

    Attributes:
        recipe: amounts and seed.
        shards: folder of the rendered data.
        held_out: folder of the data of other people, for figures.
        checkpoints: folder of the checkpoints and logs.
        device: see :func:`._fit.torch_device`.
    """

    recipe: Recipe
    shards: Path
    held_out: Path
    checkpoints: Path
    device: str
