"""Local planners: the interface, the reference planner, one with a costmap, and users' own."""

from __future__ import annotations

from ._choice import (
    KNOWN_PLANNERS,
    import_planner,
    is_outside,
    make_planner,
    planner_label,
    refuse_unusable_planner,
    seeded_generators,
)
from ._costmap import CostmapPlanner
from ._local_planner import LocalPlanner, SeatedPlanner, StraightOn
from ._reference import ReferencePlanner
