"""Every number of the recipe."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Recipe:
    """What is rendered and how long is trained.

    The shipped workers, two of the five layouts and the first eight variants of goods and colours
    stay unseen: they are for evaluation.

    Attributes:
        seed: of everything random.
        crowd: number of random workers made to learn from.
        scenes: halls with a cast of the crowd; a scene is rendered as one shard.
        frames: whole pictures a scene, for the detector and the pose network.
        person_patches: exact crops of a person a scene, for the pose network.
        head_patches: exact crops of a head a scene.
        layouts: halls to learn from.
        variants: first and last variant of goods and colours to learn from.
        detector_steps: optimiser steps.
        pose_steps: optimiser steps.
        head_steps: optimiser steps.
    """

    seed: int = 0
    crowd: int = 40
    scenes: int = 110
    frames: int = 28
    person_patches: int = 70
    head_patches: int = 240
    layouts: tuple[str, ...] = ("open", "blind_corner", "aisles")
    variants: tuple[int, int] = (8, 200)
    detector_steps: int = 2600
    pose_steps: int = 5500
    head_steps: int = 26000

    def held_out(self) -> Recipe:
        """Other people in other goods and colours: to watch over training and to calibrate."""
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

    def quick(self) -> Recipe:
        """The same in miniature, to see that everything runs; its networks are useless."""
        return replace(
            self,
            crowd=2,
            scenes=2,
            frames=3,
            person_patches=4,
            head_patches=6,
            detector_steps=2,
            pose_steps=2,
            head_steps=2,
        )
