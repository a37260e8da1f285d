"""A store of random backgrounds for training, made once from a seed."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ._textures import random_background

_SIZE_HW: Final = (300, 384)


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
            random_background(np.random.default_rng([seed, 51, number]), _SIZE_HW)
            for number in range(count)
        ]

    def random(self, rng: np.random.Generator) -> NDArray[np.uint8]:
        """Return one of the pictures."""
        return self._pictures[int(rng.integers(len(self._pictures)))]

    def sometimes(self, rng: np.random.Generator, share: float) -> NDArray[np.uint8] | None:
        """Return one of the pictures with this probability, else None."""
        return self.random(rng) if rng.random() < share else None
