"""Motion of a person between two decisions: constant acceleration, out of racks, and the feet."""

from __future__ import annotations

import math
from typing import Any, Final

from ...world.errors import SimError
from ..body import Gait, GaitPose, OnlineFootsteps, skeleton
from ._forces import box_force
from ._spec import PersonSpec

Box = tuple[float, float, float, float]
State = tuple[float, float, float, float]  # x, y, vx, vy

#: Half the width of a body: the centre of a walker stays this far from every box.
WALKER_RADIUS_M: Final = 0.25
# Boxes farther away are skipped. The list of near boxes is renewed after this much walking.
_NEAR_BOX_M: Final = 3.0
_RENEW_AFTER_M: Final = 1.5
_MAX_PASSES: Final = 3
#: Largest acceleration of a person who walks.
MAX_ACCELERATION_MPS2: Final = 3.0


class Obstacles:
    """Racks, walls and props around one person: they push, and a step never leads into one.

    Args:
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max.
    """

    def __init__(self, boxes_odom_m: Any) -> None:
        self._boxes: list[Box] = [(a, b, c, d) for a, b, c, d in boxes_odom_m.tolist()]
        self._near: list[Box] = []
        self._near_of: tuple[float, float] | None = None

    def check_free(self, name: str, x_m: float, y_m: float) -> None:
        """Raise SimError if the point called ``name`` lies inside a box."""
        for x_min, y_min, x_max, y_max in self._boxes:
            if x_min < x_m < x_max and y_min < y_m < y_max:
                raise SimError(
                    f"{name} lies inside a rack, a wall or a prop that spans x {x_min:g} to "
                    f"{x_max:g} m, y {y_min:g} to {y_max:g} m; got ({x_m:g}, {y_m:g}) m"
                )

    def force(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the acceleration (m/s²) of a walker away from all boxes."""
        ax = ay = 0.0
        for box in self._boxes_near(x_m, y_m):
            px, py = box_force(x_m, y_m, box, WALKER_RADIUS_M)
            ax += px
            ay += py
        return ax, ay

    def is_clear(self, start: tuple[float, float], goal: tuple[float, float]) -> bool:
        """Return whether the straight way keeps half a body's width from all boxes."""
        steps = max(math.ceil(math.dist(start, goal) / (0.5 * WALKER_RADIUS_M)), 1)
        for step in range(1, steps + 1):
            x = start[0] + step / steps * (goal[0] - start[0])
            y = start[1] + step / steps * (goal[1] - start[1])
            if any(_distance((x, y), box) < WALKER_RADIUS_M for box in self._boxes):
                return False
        return True

    def end_of_step(
        self, start: tuple[float, float], goal: tuple[float, float]
    ) -> tuple[float, float]:
        """Return the end of a short step towards ``goal`` that keeps the walker out of all boxes.

        A walker that already stands nearer to a box than its radius gets no nearer to it.
        """
        near = self._boxes_near(*start)
        margins = [min(WALKER_RADIUS_M, _distance(start, box)) for box in near]
        x, y = goal
        for _ in range(_MAX_PASSES):
            moved = False
            for box, margin in zip(near, margins, strict=True):
                if _distance((x, y), box) < margin - 1e-9:
                    x, y = _pushed_out(x, y, start, box, margin)
                    moved = True
            if not moved:
                return x, y
        # In a narrow corner the walker stays.
        return start

    def _boxes_near(self, x_m: float, y_m: float) -> list[Box]:
        if self._near_of is None or math.dist(self._near_of, (x_m, y_m)) > _RENEW_AFTER_M:
            self._near_of = (x_m, y_m)
            self._near = [box for box in self._boxes if _distance(self._near_of, box) < _NEAR_BOX_M]
        return self._near


class Trajectory:
    """Segments of constant acceleration, one after the other.

    Attributes:
        acceleration: of the present segment, m/s².
        end: state at the planned end of the present segment.
    """

    def __init__(self, x_m: float, y_m: float, obstacles: Obstacles) -> None:
        self._obstacles = obstacles
        self._start_s = 0.0
        self._start: State = (x_m, y_m, 0.0, 0.0)
        self.acceleration = (0.0, 0.0)
        self.end = self._start

    @property
    def start(self) -> tuple[float, float]:
        """Position at the start of the present segment."""
        return self._start[0], self._start[1]

    def state(self, t_s: float) -> State:
        """Return position and velocity at a time in the present segment."""
        dt_s = t_s - self._start_s
        x, y, vx, vy = self._start
        ax, ay = self.acceleration
        return (
            x + (vx + 0.5 * ax * dt_s) * dt_s,
            y + (vy + 0.5 * ay * dt_s) * dt_s,
            vx + ax * dt_s,
            vy + ay * dt_s,
        )

    def start_segment(
        self, t_s: float, state: State, acceleration: tuple[float, float], duration_s: float
    ) -> None:
        """Start a segment; if it led into a box, constant velocity to a free place replaces it."""
        x, y, vx, vy = state
        ax, ay = acceleration
        goal = (
            x + (vx + 0.5 * ax * duration_s) * duration_s,
            y + (vy + 0.5 * ay * duration_s) * duration_s,
        )
        end = self._obstacles.end_of_step((x, y), goal)
        if end == goal or duration_s <= 0.0:
            self.end = (*goal, vx + ax * duration_s, vy + ay * duration_s)
        else:
            ax = ay = 0.0
            vx, vy = (end[0] - x) / duration_s, (end[1] - y) / duration_s
            self.end = (*end, vx, vy)
        self._start_s, self._start, self.acceleration = t_s, (x, y, vx, vy), (ax, ay)


class Feet:
    """The feet of one person, who stands at the first place."""

    def __init__(self, spec: PersonSpec) -> None:
        self._spec = spec
        self._steps: OnlineFootsteps | None = None
        self._now_s = 0.0
        self._place = self._place_before = (0.0, 0.0, 0.0)

    def follow(
        self,
        t_s: float,
        place: tuple[float, float, float],
        velocity_mps: tuple[float, float],
        acceleration_mps2: tuple[float, float],
        *,
        turning_radps: float | None = None,
        slide: bool = False,
    ) -> GaitPose:
        """Return the pose of the feet under a body that has moved on.

        Its turning is that since the last call unless given. ``slide`` shifts the feet with it.
        """
        dt_s, before = t_s - self._now_s, self._place
        self._now_s, self._place, self._place_before = t_s, place, before
        x, y, heading = place
        if self._steps is None:
            gait = Gait(skeleton(self._spec.look, self._spec.stature_m))
            self._steps, before = OnlineFootsteps(gait, x, y, heading), place
        if slide:
            pose = self._steps.translate(x - before[0], y - before[1])
            if pose is not None:
                return pose
        if turning_radps is None:
            turned = math.remainder(heading - before[2], math.tau)
            turning_radps = turned / dt_s if dt_s > 0.0 else 0.0
        return self._steps.step(dt_s, place, (*velocity_mps, turning_radps), acceleration_mps2)

    def undo(self) -> None:
        """Take the last pose back, because the body did not move."""
        self._place = self._place_before
        if self._steps is not None:
            self._steps.undo()


def limited(x: float, y: float, most: float) -> tuple[float, float]:
    """Return a vector, shortened to this length if it is longer."""
    size = math.hypot(x, y)
    return (x * most / size, y * most / size) if size > most else (x, y)


def _distance(point: tuple[float, float], box: Box) -> float:
    x, y = point
    return math.hypot(x - min(max(x, box[0]), box[2]), y - min(max(y, box[1]), box[3]))


def _pushed_out(
    x: float, y: float, start: tuple[float, float], box: Box, margin: float
) -> tuple[float, float]:
    """Return the nearest point with this margin to the box, on the side of ``start``."""
    near_x, near_y = min(max(x, box[0]), box[2]), min(max(y, box[1]), box[3])
    away = math.hypot(x - near_x, y - near_y)
    if away > 1e-9:
        return near_x + (x - near_x) * margin / away, near_y + (y - near_y) * margin / away
    near_x = min(max(start[0], box[0]), box[2])
    near_y = min(max(start[1], box[1]), box[3])
    away = math.dist(start, (near_x, near_y))
    if away < 1e-9:
        return start
    return (
        near_x + (start[0] - near_x) * margin / away,
        near_y + (start[1] - near_y) * margin / away,
    )
