"""Training of the networks that ship with ``perception``; README.md in this folder says how.

Only what needs no PyTorch is on this page.
"""

from __future__ import annotations

from ._augment import similarity, warp, with_surroundings
from ._head_sample import HeadSample, cropped
from ._recipe import Recipe

__all__ = ["HeadSample", "Recipe", "cropped", "similarity", "warp", "with_surroundings"]
