"""Constraints made of circles, for the tests of the exporters."""

from __future__ import annotations

from hypothesis import strategies as st
from nav_scenes import finite
from shapely.geometry import Point

from nav_adapter import NavConstraints, PersonObstacle

#: x, y, vx, vy, radius.
Circle = tuple[float, float, float, float, float]


def constraints_of(*circles: Circle) -> NavConstraints:
    obstacles = tuple(
        PersonObstacle(
            track_id=index,
            center_odom_m=(x, y),
            velocity_odom_mps=(vx, vy),
            radius_m=radius,
            height_m=1.7,
            awareness_lower=0.0,
            polygon=Point(x, y).buffer(1.01 * radius),
        )
        for index, (x, y, vx, vy, radius) in enumerate(circles)
    )
    return NavConstraints(0.0, obstacles, 1.0, "robot maximum", False)


def some_circles(
    min_size: int = 0, max_size: int = 4, reach_m: float = 6.0
) -> st.SearchStrategy[list[Circle]]:
    one = st.tuples(
        finite(-reach_m, reach_m),
        finite(-reach_m, reach_m),
        finite(-2, 2),
        finite(-2, 2),
        finite(0.3, 1.5),
    )
    return st.lists(one, min_size=min_size, max_size=max_size)
