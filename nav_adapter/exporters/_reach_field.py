"""The limit of :mod:`nav_adapter.limit` at many poses at once, a lower bound of it.

The steps of time are those of :func:`~nav_adapter.limit.limit_mps`. The one in which the robot
stops is halved where it decides, as there. Each person is computed only at poses where they may
lower the limit that others set, the nearest first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from perception.arrays import FloatArray

from .._known import SpeedBasis
from .._robot import RobotProfile
from ..course import Course
from ..limit import step_of_s
from ..reach import changed_s
from ..rules import Known
from ._courses import NOWHERE_M, Pairs, Value, chosen_of, contacts_m, in_table, stopping_mps

# Parts of a step of time: the step that decides is divided into these.
_PARTS: Final = 16
# Pairs of pose and person that are computed together: few calls, and numbers that fit the cache.
_TOGETHER: Final = 65536
# A limit is lowered by this share of itself, for rounding in single precision.
_ROUNDING: Final = 1e-5


@dataclass(frozen=True, slots=True)
class Reaches:
    """The reach of all people at all times, in tables over parts of a step of time ahead.

    A row is one person at one time. Tables (J, rows) have one column where all rows are equal.

    Attributes:
        first: (P,) the first row of each person.
        follows: (P,) 1 for a person with a row for each of the times, 0 for one row for all.
        x_m: (rows,) place.
        y_m: the same.
        velocity_x_mps: (rows,).
        velocity_y_mps: (rows,).
        body_m: (rows,) body radius and uncertainty of the present place.
        least_mps: (rows,) what a lost person allows at least, or -∞.
        elapsed_s: (rows,) age of the place.
        react_s: (rows,) reaction time of the robot and age of the place.
        ahead_s: (J,) times ahead.
        drift_s: (J, rows) by how much their velocity carries the middle of the reach.
        reach_m: (J, rows) r and the uncertainty; the body is not in it.
        margin_m: (J, rows) body and the clearance that r leaves.
        around_m: (J, rows) farthest place of the body from the place now, until then.
        need_mps: (J, rows) a faster robot still moves.
        braked_m: (J, rows) way that braking has saved.
    """

    first: Any
    follows: Any
    x_m: FloatArray
    y_m: FloatArray
    velocity_x_mps: Any
    velocity_y_mps: Any
    body_m: Any
    least_mps: FloatArray
    elapsed_s: Any
    react_s: Any
    ahead_s: Any
    drift_s: Any
    reach_m: Any
    margin_m: Any
    around_m: Any
    need_mps: Any
    braked_m: Any

    @classmethod
    def of(cls, people: list[list[Known]], basis: SpeedBasis, robot: RobotProfile) -> Reaches:
        """Return the tables of one or more people, who are known at each of the times."""
        places: list[tuple[float, ...]] = []
        values: list[tuple[float, ...]] = []
        first: list[int] = []
        follows: list[bool] = []
        column_of: list[int] = []
        for ahead in people:
            # Most people differ in place alone from time to time.
            place = [(each.reach.x_m, each.reach.y_m, each.least_mps) for each in ahead]
            rest = [
                (*reach[2:8], reach.within_m, *reach[11:], *reach.variances, each.body_m)
                for each in ahead
                for reach in [each.at_first_sight]
            ]
            if rest.count(rest[0]) == len(rest):
                rest = rest[:1]
                if place.count(place[0]) == len(place):
                    place = place[:1]
            first.append(len(places))
            follows.append(len(place) > 1)
            begin = len(values)
            differs = len(rest) > 1
            column_of += range(begin, begin + len(rest)) if differs else [begin] * len(place)
            places += place
            values += rest
        x, y, least = np.ascontiguousarray(np.array(places).T)
        vx, vy, U, tau, delay, elapsed, within, until, later, keeps, a0, a1, a2, body = (
            np.ascontiguousarray(np.array(values).T)
        )
        each_row = np.array(column_of)
        a, react = robot.max_deceleration_mps2, robot.reaction_time_s + elapsed
        step_s = 2.0 * step_of_s(robot.max_speed_mps, a)  # twice that of the limit
        steps = math.ceil((react.max() + robot.max_speed_mps / a) / step_s + 1e-6)
        t = (step_s / _PARTS) * np.arange(_PARTS * steps + 1)[:, None]
        late = np.maximum(t - react, 0.0)
        walking = np.hypot(vx, vy)
        kept = np.minimum(t + elapsed, keeps)
        m = tau * -np.expm1((kept - t - elapsed) / tau)
        drift = kept + m
        since = t + elapsed + delay
        late_s = np.maximum(since - until, 0.0)
        r = U * changed_s(tau, since, np) + np.maximum(later - U, 0.0) * changed_s(tau, late_s, np)
        aware_m = U * changed_s(tau, np.minimum(since, until), np)
        left = basis.policy.margins.floor_m - np.minimum(aware_m, within)
        left = left if within.any() else left[:, :1]
        variance = np.maximum(a0 + m * (a1 + m * a2), 0.0)
        r = r + np.sqrt(np.maximum.accumulate(variance, axis=0))
        around = np.maximum.accumulate(r + (drift + 0.5 * step_s) * walking, axis=0)
        margin = np.maximum(basis.policy.margins.floor_m, body + basis.policy.margins.clearance_m)
        around = around + margin + elapsed * walking
        # Single precision: its rounding counts as reach, and that of squares grows with them.
        largest_m = float(around.max()) + robot.max_speed_mps * float(t[-1, 0])
        largest_m += 2.0 * robot.circumscribed_radius_m
        slack = 2e-6 * (2.0 + largest_m) ** 2

        def table(values: FloatArray) -> Any:
            """Return values (…, rows), or (…, 1) where all rows are equal."""
            values = values.astype(np.float32)
            return values[..., :1] if values.shape[-1] == 1 else values[..., each_row]

        if np.ptp(react) == 0.0:
            react, late = react[:1], late[:, :1]
        return cls(
            *(
                np.array(first),
                np.array(follows, dtype=np.intp),
                x,
                y,
                vx[each_row].astype(np.float32),
            ),
            *(vy[each_row].astype(np.float32), (body + slack)[each_row].astype(np.float32), least),
            *(elapsed[each_row].astype(np.float32), table(react), t[:, 0].astype(np.float32)),
            *(
                table(drift),
                table(r + slack),
                table(left),
                table(around + 2.0 * slack),
                table(a * late),
            ),
            table(0.5 * a * late * late),
        )


class Field:
    """Limits of people at many poses.

    Args:
        reaches: of the people.
        course: (N,) of the robot, for the reach; None if no reach counts.
        field: (N,) of the protective field; None if none counts.
        times: (N,) index of the time of each pose.
        basis: of the constraints.
        robot: of the constraints.
        reach_m: the limits hold within this distance of the poses.
    """

    def __init__(
        self,
        reaches: Reaches,
        course: Course | None,
        field: Course | None,
        times: Any,
        basis: SpeedBasis,
        robot: RobotProfile,
        reach_m: float,
    ) -> None:
        self._reaches, self._times = reaches, times
        self._course, self._field = course, field
        self._a = np.float32(robot.max_deceleration_mps2)
        self._reach_m = np.float32(reach_m)
        # No farther from the base is any part of robot or field, wherever they point.
        size = 0.0
        for each in (course, field):
            if each is not None:
                sizes = np.hypot(np.maximum(each.front_m, -each.rear_m), each.half_m)
                size = max(size, float(np.max(np.maximum(sizes, each.radius_m))) + reach_m)
        self._size_m = np.float32(size)
        self._step_s = float(reaches.ahead_s[_PARTS])

    def lower(self, limits: FloatArray) -> None:
        """Lower limits (N,) in place to those that people set."""
        reaches = self._reaches
        course = self._field if self._course is None else self._course
        assert course is not None
        people = range(len(reaches.first))
        nearest, least = np.full(len(limits), -1), np.full(len(limits), np.inf)
        away = []
        for index in people:
            row = reaches.first[index] + reaches.follows[index] * self._times
            dx, dy = reaches.x_m[row] - course.x_m, reaches.y_m[row] - course.y_m
            distance = np.sqrt(dx * dx + dy * dy)
            away.append((row, distance))
            free = distance - in_table(reaches.around_m, len(reaches.ahead_s) // 2, row)
            nearest[free < least] = index
            np.minimum(least, free, out=least)
        rows = reaches.first[nearest] + reaches.follows[nearest] * self._times
        self._lower_by([(np.arange(len(limits)), rows)], limits)
        others = []
        for index, (row, distance) in enumerate(away):
            poses = np.flatnonzero((distance < self._near_m(row, limits)) & (nearest != index))
            others.append((poses, row[poses]))
        self._lower_by(others, limits)

    def _near_m(self, row: Any, limits: Any) -> Any:
        """Return the distances (n,) from which on a person sets no lower limit."""
        react = self._reacts_s(row)
        stop_s = limits / self._a + react
        return self._around_m(row, stop_s) + 0.5 * limits * (stop_s + react) + self._size_m

    def _around_m(self, row: Any, until_s: Any) -> Any:
        """Return how far people (n,) come from their place until some times."""
        around = self._reaches.around_m
        part = (until_s * (1.0 / self._step_s) + 1.0).astype(np.intp) * _PARTS
        np.minimum(part, len(around) - 1, out=part)
        return in_table(around, part, row)

    def _reacts_s(self, row: Any) -> Value:
        return in_table(self._reaches.react_s[None], 0, row)

    def _lower_by(self, pairs: list[Any], limits: FloatArray) -> None:
        """Lower the limits by pairs (poses, rows); each pose is in each of them once."""
        poses, rows = (np.concatenate(each) for each in zip(*pairs, strict=True))
        before, own = limits[poses].astype(np.float32), np.empty(len(poses), dtype=np.float32)
        for start in range(0, len(poses), _TOGETHER):
            some = slice(start, start + _TOGETHER)
            own[some] = self._limits(poses[some], rows[some], before[some])
        lowest = np.maximum(own * (1.0 - _ROUNDING), self._reaches.least_mps[rows])
        end = 0
        for chosen, _ in pairs:
            begin, end = end, end + len(chosen)
            limits[chosen] = np.minimum(limits[chosen], lowest[begin:end])

    def _limits(self, pose: Any, row: Any, before: Any) -> Any:
        """Return the limits (n,), ∞ where not below ``before``."""
        reaches, field = self._reaches, self._field
        own = np.full(len(pose), NOWHERE_M)
        if field is not None:
            elapsed = reaches.elapsed_s[row]
            pairs = self._pairs(field, pose, row)
            own = self._path_mps(pairs, pairs.x_m, pairs.y_m)
            if np.any(elapsed):
                x, y = (
                    pairs.x_m + elapsed * pairs.velocity_x_mps,
                    pairs.y_m + elapsed * pairs.velocity_y_mps,
                )
                np.minimum(own, self._path_mps(pairs, x, y), out=own)
        if self._course is None:
            return own
        np.minimum(before, own, out=before)
        pairs = self._pairs(self._course, pose, row)
        near = self._near(pairs, before)
        own[near] = np.minimum(own[near], self._reach_mps(pairs.at(near), before[near]))
        return own

    def _pairs(self, course: Course, pose: Any, row: Any) -> Pairs:
        """Return pairs of the courses at some poses and the people of some rows."""
        reaches = self._reaches
        dx = (reaches.x_m[row] - course.x_m[pose]).astype(np.float32)
        dy = (reaches.y_m[row] - course.y_m[pose]).astype(np.float32)
        vx, vy = reaches.velocity_x_mps[row], reaches.velocity_y_mps[row]
        if course.circle_m:
            radius = chosen_of(course.radius_m, pose) + self._reach_m
            return Pairs(row, dx, dy, vx, vy, None, None, 0.0, 0.0, 0.0, radius)
        cos, sin, *rest = (chosen_of(each, pose) for each in course[2:10])
        return Pairs(
            *(row, cos * dx + sin * dy, cos * dy - sin * dx),
            *(cos * vx + sin * vy, cos * vy - sin * vx, *rest),
        )

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
        steps = (len(around) - 1) // _PARTS
        low, high = np.zeros(len(free), dtype=np.int16), np.full(len(free), steps, dtype=np.int16)
        for _ in range(steps.bit_length()):
            middle = (low + high) >> 1
            part = np.minimum(middle + 1, steps).astype(np.intp) * _PARTS
            way = self._reaches.ahead_s[part] * before
            apart = free > in_table(around, part, pairs.row) + way
            low, high = np.where(apart, middle + 1, low), np.where(apart, high, middle)
        return np.minimum(low, steps)

    def _path_mps(self, pairs: Pairs, x: Any, y: Any) -> Any:
        """Return the limits (n,) of the protective field with people at these places; ∞ for none.

        It is that of :func:`~nav_adapter.limit.in_the_path_mps`.
        """
        body = self._reaches.body_m[pairs.row]
        if pairs.fan_cos is None:
            gap = np.sqrt(x * x + y * y) - body - pairs.radius_m
        else:
            gap, _, behind = contacts_m(x, y, pairs, body, np.float32(0.0))
            if behind is not None:
                gap = np.where(behind >= 0.0, np.float32(0.0), gap)
        return stopping_mps(gap, self._reacts_s(pairs.row), self._a)

    def _reach_mps(self, pairs: Pairs, before: Any, first: Any = None, again: int = 2) -> Any:
        """Return the limits (n,) by the reach; they are ∞ where they are not below ``before``.

        The first steps that count are given, or computed. The step in which a robot stops is looked
        at in parts. Where none of them sets a limit, later steps count, ``again`` times at most.
        """
        if first is None:
            first = self._first_step(pairs, before)
        limits, lowest = np.full(len(before), NOWHERE_M), before.copy()
        order = np.argsort(first, kind="stable")
        begins = np.searchsorted(first[order], np.arange(len(self._reaches.ahead_s) // _PARTS + 1))
        left = order[:0]
        stopping: list[tuple[Any, Any, Any]] = []
        for step in range(len(begins) - 1):
            left = np.concatenate((left, order[begins[step] : begins[step + 1]]))
            if not len(left):
                continue
            later = (step + 1) * _PARTS
            now = pairs.at(left)
            own = self._lowest_mps(now, step * _PARTS, later)
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
        halved, is_met = self._halved_mps(pairs.at(chosen), steps * _PARTS, own)
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
        last = ends = first + _PARTS
        others = np.full(len(limits), NOWHERE_M)
        for _ in range(_PARTS.bit_length() - 1):
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
        margin = in_table(reaches.margin_m, later, row)
        if pairs.fan_cos is None:
            past = behind = None
            near = np.sqrt(x * x + y * y) - (pairs.radius_m + margin) - reach
        else:
            near, past, behind = contacts_m(x, y, pairs, reach, margin)
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
