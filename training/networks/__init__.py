"""Training of the networks that ship with ``perception``; README.md in this folder says how.

Only what needs no PyTorch is on this page.
"""

from __future__ import annotations

from ._augment import similarity, warp, with_surroundings
from ._degradation import (
    Degradation,
    compressed,
    degrade,
    motion_kernel,
    random_degradation,
    rolling_shutter,
)
from ._head_sample import HeadSample, cropped
from ._recipe import Recipe
from ._textures import random_background, random_texture

__all__ = [
    "Degradation",
    "HeadSample",
    "Recipe",
    "compressed",
    "cropped",
    "degrade",
    "motion_kernel",
    "random_background",
    "random_degradation",
    "random_texture",
    "rolling_shutter",
    "similarity",
    "warp",
    "with_surroundings",
]
