"""Every number of the recipe."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Recipe:
    """What is rendered and how long is trained.

    Workers, hall layouts and variants of goods and colours are chosen so that the shipped workers, two of
    the five layouts and the first eight variants stay unseen: they are for evaluation.

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
    crowd: int = 36
    scenes: int = 110
    frames: int = 28
    person_patches: int = 70
    head_patches: int = 240
    layouts: tuple[str, ...] = ("open", "blind_corner", "aisles")
    variants: tuple[int, int] = (8, 200)
    detector_steps: int = 4000
    pose_steps: int = 8000
    head_steps: int = 12000

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
