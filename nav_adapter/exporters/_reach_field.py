"""The limit of :mod:`nav_adapter.limit` at many poses at once, a lower bound of it.

The steps of time are those of :func:`~nav_adapter.limit.limit_mps`. The one in which the robot
stops is halved where it decides, as there. Each person is computed only at poses where they may
lower the limit that others set, the nearest first.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from .._constraints import NavConstraints
from .._errors import NavError
from .._robot import LATERAL_NOISE_MPS, RobotProfile
from .._speed_basis import SpeedBasis
from ..limit import STANDING_MPS
from ._courses import (
    NOWHERE_M,
    Courses,
    Pairs,
    Value,
    chosen_of,
    contacts_m,
    course_speed_mps,
    courses_of,
    extents_m,
    in_table,
    stopping_mps,
)
from ._people_ahead import PARTS, Reaches, people_ahead

# Pairs of pose and person that are computed together: few calls, and numbers that fit the cache.
_TOGETHER: Final = 65536
# A limit is lowered by this share of itself, for rounding in single precision.
_ROUNDING: Final = 1e-5


class _Field:
    """Limits of people at many poses.

    Args:
        reaches: of the people.
        courses: (N,) of the robot.
        times: (N,) index of the time of each pose.
        basis: of the constraints.
        robot: of the constraints.
        reach_m: the limits hold within this distance of the poses.
    """

    def __init__(
        self,
        reaches: Reaches,
        courses: Courses,
        times: Any,
        basis: SpeedBasis,
        robot: RobotProfile,
        reach_m: float,
    ) -> None:
        self._reaches, self._courses, self._times = reaches, courses, times
        self._margin_m = np.float32(basis.policy.margins.floor_m)
        self._clearance_m = np.float32(basis.policy.margins.clearance_m)
        self._has_reach = basis.policy.reach is not None
        self._a = np.float32(robot.max_deceleration_mps2)
        front, rear, half = extents_m(robot, 0.0)
        self._circle_m = np.float32(math.hypot(max(front, -rear), half) + reach_m)
        length = np.maximum(courses.front_m, -courses.rear_m) + courses.driven_m
        size_m = np.sqrt(np.square(length) + np.square(courses.half_m))
        # Of a circle that holds footprint and course, wherever they point.
        self._size_m = np.float32(np.max(size_m)) + (self._circle_m if courses.cos is None else 0)
        self._step_s = float(reaches.ahead_s[PARTS])

    def lower(self, limits: FloatArray) -> Any:
        """Lower limits (N,) in place to those that people set, and return by whom.

        The result (N,) is twice the index of a person, one more for the path, or −1 for nobody.
        """
        reaches, courses = self._reaches, self._courses
        by = np.full(len(limits), -1)
        nearest, least = np.zeros(len(limits), dtype=np.intp), np.full(len(limits), np.inf)
        away = []
        for index in range(len(reaches.people)):
            row = reaches.first[index] + reaches.follows[index] * self._times
            dx, dy = reaches.x_m[row] - courses.x_m, reaches.y_m[row] - courses.y_m
            distance = np.sqrt(dx * dx + dy * dy)
            away.append((row, distance))
            free = distance - in_table(reaches.around_m, len(reaches.ahead_s) // 2, row)
            nearest[free < least] = index
            np.minimum(least, free, out=least)
        rows = reaches.first[nearest] + reaches.follows[nearest] * self._times
        everywhere = np.arange(len(limits))
        self._lower_by([(everywhere, nearest, rows)], limits, by)
        others = []
        for index, (row, distance) in enumerate(away):
            poses = np.flatnonzero((distance < self._near_m(row, limits)) & (nearest != index))
            others.append((poses, np.full(len(poses), index), row[poses]))
        self._lower_by(others, limits, by)
        return by

    def _near_m(self, row: Any, limits: Any) -> Any:
        """Return the distances (n,) from which on a person sets no lower limit."""
        react = self._reacts_s(row)
        stop_s = limits / self._a + react
        return self._around_m(row, stop_s) + 0.5 * limits * (stop_s + react) + self._size_m

    def _around_m(self, row: Any, until_s: Any) -> Any:
        """Return how far people (n,) come from their place until some times."""
        around = self._reaches.around_m
        part = (until_s * (1.0 / self._step_s) + 1.0).astype(np.intp) * PARTS
        np.minimum(part, len(around) - 1, out=part)
        return in_table(around, part, row)

    def _reacts_s(self, row: Any) -> Value:
        return in_table(self._reaches.react_s[None], 0, row)

    def _lower_by(self, pairs: list[Any], limits: FloatArray, by: Any) -> None:
        """Lower the limits by pairs (poses, people, rows); each pose is in each of them once."""
        poses, people, rows = (np.concatenate(each) for each in zip(*pairs, strict=True))
        before, own = limits[poses].astype(np.float32), np.empty(len(poses), dtype=np.float32)
        in_the_path = np.empty(len(poses), dtype=bool)
        for start in range(0, len(poses), _TOGETHER):
            some = slice(start, start + _TOGETHER)
            path, reach = self._limits(poses[some], rows[some], before[some])
            own[some], in_the_path[some] = np.minimum(path, reach), path < reach
        lowest = np.maximum(own * (1.0 - _ROUNDING), self._reaches.least_mps[rows])
        end = 0
        for each in pairs:
            begin, end = end, end + len(each[0])
            lower = begin + np.flatnonzero(lowest[begin:end] < limits[each[0]])
            limits[poses[lower]] = lowest[lower]
            by[poses[lower]] = 2 * people[lower] + in_the_path[lower]

    def _limits(self, pose: Any, row: Any, before: Any) -> tuple[Any, Any]:
        """Return the limits (n,) by the path and by the reach, ∞ where not below ``before``."""
        reaches, courses = self._reaches, self._courses
        dx = (reaches.x_m[row] - courses.x_m[pose]).astype(np.float32)
        dy = (reaches.y_m[row] - courses.y_m[pose]).astype(np.float32)
        vx, vy = reaches.velocity_x_mps[row], reaches.velocity_y_mps[row]
        driven, react = chosen_of(courses.driven_m, pose), self._reacts_s(row)
        body, elapsed = reaches.body_m[row], reaches.elapsed_s[row]
        straight = tuple(chosen_of(each, pose) for each in courses.straight)
        path = self._path_mps(dx, dy, straight, body, driven, react)
        if np.any(elapsed):
            x, y = dx + vx * elapsed, dy + vy * elapsed
            np.minimum(path, self._path_mps(x, y, straight, body, driven, react), out=path)
        if not self._has_reach:
            return path, np.full(len(pose), NOWHERE_M)
        if courses.cos is None:
            pairs = Pairs(row, dx, dy, vx, vy, None, None, self._circle_m + driven, 0.0, 0.0)
        else:
            cos, sin = chosen_of(courses.cos, pose), chosen_of(courses.sin, pose)
            fan = (chosen_of(each, pose) for each in (courses.fan_cos, courses.fan_sin))
            extent = (chosen_of(courses.front_m, pose) + driven, chosen_of(courses.rear_m, pose))
            pairs = Pairs(
                *(row, cos * dx + sin * dy, cos * dy - sin * dx),
                *(cos * vx + sin * vy, cos * vy - sin * vx),
                *(*fan, *extent, chosen_of(courses.half_m, pose)),
            )
        np.minimum(before, path, out=before)
        reach = np.full(len(pose), NOWHERE_M)
        near = self._near(pairs, before)
        reach[near] = self._reach_mps(pairs.at(near), before[near])
        return path, reach

    def _near(self, pairs: Pairs, before: Any) -> Any:
        """Return the indices of pairs whose person may come to where the robot may be."""
        if pairs.fan_cos is None:
            return np.arange(len(before))
        around = self._around_m(pairs.row, before / self._a + self._reacts_s(pairs.row))
        x, y, cos, sin = pairs.x_m, np.abs(pairs.y_m), pairs.fan_cos, pairs.fan_sin
        low_y = cos * y - sin * x
        low_x = np.where(low_y <= 0.0, 1.0, cos * x + sin * y)
        close = around + self._size_m
        return np.flatnonzero(
            (low_y < around + pairs.half_m) & (low_x > -around) | (x * x + y * y < close * close)
        )

    def _first_step(self, pairs: Pairs, before: Any) -> Any:
        """Return the number (n,) of the first step in which robot and person may meet."""
        free = np.sqrt(pairs.x_m * pairs.x_m + pairs.y_m * pairs.y_m) - self._size_m
        around = self._reaches.around_m
        steps = (len(around) - 1) // PARTS
        low, high = np.zeros(len(free), dtype=np.int16), np.full(len(free), steps, dtype=np.int16)
        for _ in range(steps.bit_length()):
            middle = (low + high) >> 1
            part = np.minimum(middle + 1, steps).astype(np.intp) * PARTS
            way = self._reaches.ahead_s[part] * before
            apart = free > in_table(around, part, pairs.row) + way
            low, high = np.where(apart, middle + 1, low), np.where(apart, high, middle)
        return np.minimum(low, steps)

    def _path_mps(
        self, dx: Any, dy: Any, straight: tuple[Value, ...], body: Any, driven: Value, react: Value
    ) -> Any:
        """Return the limits (n,) of the protective field; ∞ for none."""
        if not straight:
            gap = np.sqrt(dx * dx + dy * dy) - body - (driven + self._circle_m + self._clearance_m)
        else:
            cos, sin, front, rear, half = straight
            x = cos * dx + sin * dy
            off = np.abs(cos * dy - sin * dx) - (half + self._clearance_m)
            inside = (x >= rear - body) & (off <= body)
            np.maximum(off, 0.0, out=off)
            ahead = np.sqrt(np.maximum(body * body - off * off, 0.0))
            gap = np.where(inside, x - ahead - (front + driven + self._clearance_m), NOWHERE_M)
        return stopping_mps(gap, react, self._a)

    def _reach_mps(self, pairs: Pairs, before: Any, first: Any = None, again: int = 2) -> Any:
        """Return the limits (n,) by the reach; they are ∞ where they are not below ``before``.

        The first steps that count are given, or computed. The step in which a robot stops is looked
        at in parts. Where none of them sets a limit, later steps count, ``again`` times at most.
        """
        if first is None:
            first = self._first_step(pairs, before)
        limits, lowest = np.full(len(before), NOWHERE_M), before.copy()
        order = np.argsort(first, kind="stable")
        begins = np.searchsorted(first[order], np.arange(len(self._reaches.ahead_s) // PARTS + 1))
        left = order[:0]
        stopping: list[tuple[Any, Any, Any]] = []
        for step in range(len(begins) - 1):
            left = np.concatenate((left, order[begins[step] : begins[step + 1]]))
            if not len(left):
                continue
            later = (step + 1) * PARTS
            now = pairs.at(left)
            own = self._lowest_mps(now, step * PARTS, later)
            need = in_table(self._reaches.need_mps, later, now.row)
            lower = np.flatnonzero(own < lowest[left])
            lowest[left[lower]] = own[lower]
            is_stop = own[lower] < chosen_of(need, lower)
            ends, passes = lower[is_stop], lower[~is_stop]
            limits[left[passes]] = own[passes]
            stopping.append((left[ends], own[ends], np.full(len(ends), step)))
            left = left[lowest[left] > need]
        if not stopping:
            return limits
        chosen, own, steps = (np.concatenate(each) for each in zip(*stopping, strict=True))
        halved, is_met = self._halved_mps(pairs.at(chosen), steps * PARTS, own)
        limits[chosen] = np.minimum(limits[chosen], halved)
        free = np.flatnonzero(~is_met)
        if len(free) and again:
            chosen, steps = chosen[free], steps[free] + 1
            before = np.minimum(before[chosen], limits[chosen])
            later_on = self._reach_mps(pairs.at(chosen), before, steps, again - 1)
            limits[chosen] = np.minimum(limits[chosen], later_on)
        elif len(free):
            limits[chosen[free]] = np.minimum(limits[chosen[free]], own[free])
        return limits

    def _halved_mps(self, pairs: Pairs, first: Any, limits: Any) -> tuple[Any, Any]:
        """Return limits (n,) that a whole step from ``first`` on set, in steps of one part.

        The second array tells where one of them lets the robot stop in it, so later ones are of no
        matter.
        """
        last = ends = first + PARTS
        others = np.full(len(limits), NOWHERE_M)
        for _ in range(PARTS.bit_length() - 1):
            middle = (first + last) // 2
            need = in_table(self._reaches.need_mps, middle, pairs.row)
            own = self._lowest_mps(pairs, first, middle)
            sooner = own < need
            np.minimum(others, own, out=others, where=~sooner)
            limits = np.where(sooner, own, np.maximum(limits, need))
            first, last = np.where(sooner, first, middle), np.where(sooner, middle, last)
        own = self._lowest_mps(pairs, first, last)
        is_met = own < in_table(self._reaches.need_mps, last, pairs.row)
        limits = np.minimum(np.maximum(limits, own), others)
        free = np.flatnonzero(~is_met)
        if len(free):
            # The rest of the step, which an earlier part that seemed to be met has hidden.
            rest = pairs.at(free)
            own = self._lowest_mps(rest, last[free], ends[free])
            limits[free] = np.minimum(limits[free], own)
            is_met[free] = own < in_table(self._reaches.need_mps, ends[free], rest.row)
        return limits, is_met

    def _lowest_mps(self, pairs: Pairs, part: Any, later: Any) -> Any:
        """Return what :func:`~nav_adapter.limit._lowest_mps` does; a robot may stop in between."""
        reaches, row = self._reaches, pairs.row
        t0, t1 = reaches.ahead_s[part], reaches.ahead_s[later]
        tables = reaches.drift_s, reaches.need_mps, reaches.braked_m
        m0, need0, braked0 = (in_table(each, part, row) for each in tables)
        m1, need1, braked1 = (in_table(each, later, row) for each in tables)
        middle, half = 0.5 * (m0 + m1), 0.5 * (m1 - m0)
        vx, vy = pairs.velocity_x_mps, pairs.velocity_y_mps
        x, y = pairs.x_m + vx * middle, pairs.y_m + vy * middle
        reach = in_table(reaches.reach_m, later, row) + half * np.sqrt(vx * vx + vy * vy)
        if pairs.fan_cos is None:
            past = behind = None
            near = np.sqrt(x * x + y * y) - (pairs.front_m + self._margin_m) - reach
        else:
            near, past, behind = contacts_m(x, y, pairs, reach, self._margin_m)
        own = np.maximum((near + braked1) / t1, need0)
        stops = np.flatnonzero(own < need1)
        if len(stops):
            stopped = stopping_mps(near[stops], self._reacts_s(row[stops]), self._a)
            own[stops] = np.maximum(stopped, chosen_of(need0, stops))
        if past is not None:
            own[own * t0 - braked0 > past] = NOWHERE_M
        if behind is not None:
            own = np.where(need0 * t0 - braked0 <= behind, need0, own)
        return own


def limits_at(
    constraints: NavConstraints,
    positions_m: FloatArray,
    headings_rad: FloatArray | None,
    velocities_mps: tuple[FloatArray, Value] | None,
    yaw_rates_radps: Value,
    times_s: FloatArray,
    aware_for_s: float,
    reach_m: float = 0.0,
) -> tuple[FloatArray, NDArray[np.intp], list[str]]:
    """Return the limits (K, T) at poses (K, T, …), and who sets them: indices of texts.

    Args:
        constraints: of ``NavAdapter.update``, or some that stop the robot.
        positions_m: (K, T, 2).
        headings_rad: (K, T), or None for any.
        velocities_mps: forward and left, (K, T), or None for a robot that drives forwards.
        yaw_rates_radps: (K, T), or 0.
        times_s: (T,) after the stamp.
        aware_for_s: how long awareness counts.
        reach_m: the limits hold within this distance of the poses; they have no heading then.

    Raises:
        NavError: for constraints that do not come from ``update`` unless they stop the robot.
    """
    if not isinstance(constraints, NavConstraints):
        raise NavError(f"constraints must be NavConstraints, got {type(constraints).__name__}")
    basis, robot = constraints.speed_basis, constraints.robot
    shape = positions_m.shape[:2]
    by = np.zeros(shape, dtype=np.intp)
    if basis is None or robot is None:
        if constraints.speed_limit_mps > 0.0:
            raise NavError(
                "constraints must come from NavAdapter.update, got some without speed_basis"
            )
        return np.zeros(shape), by, [constraints.limited_by]
    if basis.stopped:
        return np.zeros(shape), by, ["stale data"]
    texts = [
        "recovery after stale data",
        "robot: moves sideways, but its profile says otherwise",
        "robot maximum",
    ]
    limits, by = np.full(shape, robot.max_speed_mps), by + 2
    if basis.ceiling_mps is not None:
        rise_mps2 = 0.0 if constraints.stale else robot.max_acceleration_mps2
        ceilings = np.broadcast_to(basis.ceiling_mps + rise_mps2 * times_s, shape)
        by[ceilings < limits] = 0
        limits = np.minimum(limits, ceilings)
    if velocities_mps is not None and robot.moves_sideways is False:
        sideways = np.broadcast_to(np.abs(velocities_mps[1]) > LATERAL_NOISE_MPS, shape)
        limits[sideways], by[sideways] = 0.0, 1
    people = tuple(people_ahead(constraints, times_s, aware_for_s))
    if not people or not limits.size:
        return limits, by, texts

    def flat(value: Value) -> Value:
        is_array = isinstance(value, np.ndarray) and value.ndim
        return value.reshape(-1, *value.shape[2:]) if is_array else value

    places, headings, rates = map(flat, (positions_m, headings_rad, yaw_rates_radps))
    velocities = velocities_mps and tuple(map(flat, velocities_mps))
    times = np.tile(np.arange(shape[1]), shape[0])
    reaches = Reaches.of(people, shape[1], basis, robot)
    lowest, who = limits.reshape(-1), np.empty(limits.size, dtype=np.intp)
    standing = np.zeros(limits.size, dtype=bool)
    if velocities and headings_rad is not None and robot.moves_sideways is True:
        standing = course_speed_mps(*velocities) < STANDING_MPS
    for anywhere in (False, True):
        poses = np.flatnonzero(standing == anywhere)
        if not len(poses):
            continue
        here, heading, rate = (chosen_of(each, poses) for each in (places, headings, rates))
        velocity = velocities and tuple(chosen_of(each, poses) for each in velocities)
        courses = courses_of(robot, basis, here, heading, velocity, rate, anywhere)
        field = _Field(reaches, courses, times[poses], basis, robot, reach_m)
        some = lowest[poses]
        who[poses] = field.lower(some)
        lowest[poses] = some
    by = np.where(who.reshape(shape) < 0, by, who.reshape(shape) + len(texts))
    for person in people:
        rules = ("reach", "in the path") if person.least_mps is None else ("lost", "lost")
        texts += [f"track {person.track_id}: {rule}" for rule in rules]
    return lowest.reshape(shape), by, texts
