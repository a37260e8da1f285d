"""Worker meshes that the simulation draws: ``python -m training.workers`` makes them.

A parametric body model gives the naked body, its joints and its keypoints. The clothes of a
warehouse worker are made here as geometry, painted texel by texel and packed into the files that
``sim_tests`` loads.
"""

from __future__ import annotations

from ._people import PEOPLE
from ._person import Person
from ._random import random_person

__all__ = ["PEOPLE", "Person", "random_person"]
