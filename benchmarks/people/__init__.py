"""Simulated people beside recorded ones: ``python -m benchmarks.people``.

Both are sampled at the same rate and smoothed by the same filter. Crowds of simulated people walk
in the layout of the recordings. Others stand beside a robot and start, or look at it before they
cross. The recorded distributions come with the benchmark as quantiles; the recordings do not.
"""

from __future__ import annotations

from ._cli import main
from ._closed_loop import closed_loop_scenes, scene_of
from ._comparison import Compared, compare, compare_eyes, table
from ._crowd import LAYOUTS, Layout, simulate
from ._distribution import RECORDED, Distribution, read_recorded, summarise, write_recorded
from ._motion import QUANTITIES, RATE_HZ, VEHICLE_GAP, Quantity, Scene, noise_m, read_scene
from ._standing import (
    DISPLACEMENTS,
    EYE_YAW_DEG,
    LOOKED,
    displacements,
    eye_yaw_deg,
    looked_within,
    starts,
)

__all__ = [
    "DISPLACEMENTS",
    "EYE_YAW_DEG",
    "LAYOUTS",
    "LOOKED",
    "QUANTITIES",
    "RATE_HZ",
    "RECORDED",
    "VEHICLE_GAP",
    "Compared",
    "Distribution",
    "Layout",
    "Quantity",
    "Scene",
    "closed_loop_scenes",
    "compare",
    "compare_eyes",
    "displacements",
    "eye_yaw_deg",
    "looked_within",
    "main",
    "noise_m",
    "read_recorded",
    "read_scene",
    "scene_of",
    "simulate",
    "starts",
    "summarise",
    "table",
    "write_recorded",
]
