"""The speed field of some constraints: poses are placed in it, and limits or reasons come out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from .._constraints import NavConstraints
from .._errors import NavError
from ._field_arrays import ArrayLibrary
from ._field_limits import FieldLimits
from ._field_near import NearPoses
from ._field_people import PeopleAhead, people_ahead
from ._field_poses import Poses, poses_of

# Numbers computed together: enough that the calls cost little, and few enough for the cache.
_TOGETHER: Final = 20_000
# From so many poses on it pays to find those that a person is near enough to, so many at once.
_MANY: Final = 4_000
_FILTERED: Final = 40_000
# A person is left out only this much farther away than the formula says, for rounding.
_SPARE_M: Final = 0.001
# Rounding of positions and of limits, in units of the last place.
_POSITION_ROUNDING: Final = 8.0
_LIMIT_ROUNDING: Final = 32.0


class SpeedField:
    """The speed field of some constraints at T times, for arrays of poses.

    Args:
        constraints: of ``NavAdapter.update``.
        library: of the arrays.
        times_s: (T,) after the stamp.
        aware_for_s: how long awareness counts.
        reach_m: the limits hold within this distance of the poses; poses then have no heading.

    Raises:
        NavError: for constraints that do not come from ``update`` unless they stop the robot.
    """

    def __init__(
        self,
        constraints: NavConstraints,
        library: ArrayLibrary,
        times_s: FloatArray,
        aware_for_s: float,
        reach_m: float = 0.0,
    ) -> None:
        if not isinstance(constraints, NavConstraints):
            raise NavError(f"constraints must be NavConstraints, got {type(constraints).__name__}")
        basis, robot = constraints.speed_basis, constraints.robot
        if (basis is None or robot is None) and constraints.speed_limit_mps > 0.0:
            raise NavError(
                "constraints must come from NavAdapter.update, got some without speed_basis"
            )
        self._constraints = constraints
        self._basis = None if robot is None else basis
        self._maximum_mps = 0.0 if basis is None or robot is None else robot.max_speed_mps
        self._library = library
        self._times_s = times_s
        self._aware_for_s = aware_for_s
        self._reach_m = reach_m
        self._spare_m = 0.0
        self._people: list[PeopleAhead] = []
        self._poses = Poses(None, None)
        self._times_first = True
        self._rules: FieldLimits | None = None

    def place(
        self,
        positions_m: Any,
        headings_rad: Any = None,
        velocities_mps: tuple[Any, Any] | None = None,
        yaw_rates_radps: Any = None,
    ) -> None:
        """Place the robot at the poses (K, T, …)."""
        basis, robot, library = self._basis, self._constraints.robot, self._library
        self._times_first = positions_m.shape[1] <= positions_m.shape[0]
        x, y = (self._turned(positions_m[:, :, axis]) for axis in (0, 1))
        if basis is None or robot is None or not positions_m.shape[0] * positions_m.shape[1]:
            # Nothing but the shape is needed.
            self._basis, self._poses = None, Poses(self._single(x), self._single(y))
            return
        low = np.array([x.min().item(), y.min().item()])
        high = np.array([x.max().item(), y.max().item()])
        reference = 0.5 * (low + high)
        self._poses = poses_of(
            library,
            basis,
            robot,
            self._single(x - float(reference[0])),
            self._single(y - float(reference[1])),
            None if headings_rad is None else self._inner(headings_rad),
            None
            if velocities_mps is None
            else (
                self._inner(velocities_mps[0]),
                None if velocities_mps[1] is None else self._inner(velocities_mps[1]),
            ),
            None if yaw_rates_radps is None else self._inner(yaw_rates_radps),
        )

        self._spare_m = self._reach_m + _largest(self._poses.driven_m)

        (low_x, low_y), (high_x, high_y) = low.tolist(), high.tolist()

        def is_near(corner_m: FloatArray, other_m: FloatArray, within_m: float) -> bool:
            (x, y), (other_x, other_y) = corner_m.tolist(), other_m.tolist()
            off_x = max(min(x, other_x) - high_x, low_x - max(x, other_x), 0.0)
            off_y = max(min(y, other_y) - high_y, low_y - max(y, other_y), 0.0)
            return math.hypot(off_x, off_y) <= within_m + self._spare_m

        people = people_ahead(
            basis,
            robot,
            self._constraints.stamp_s,
            self._times_s,
            self._aware_for_s,
            reference,
            is_near,
        )
        self._people = [group.mapped(self._column) for group in people]
        extent_m = 20.0 + float(np.abs(high - low).max())
        if library.is_torch:
            extent_m += float(np.abs(reference).max())
        rounding_m = _POSITION_ROUNDING * library.rounding * extent_m
        self._spare_m += _SPARE_M + 4.0 * rounding_m
        self._rules = FieldLimits(library, basis.policy, robot, rounding_m, self._reach_m)

    def limits_mps(self) -> Any:
        """Return the limits (K, T)."""
        library, maximum_mps = self._library, self._maximum_mps
        less = 1.0 - _LIMIT_ROUNDING * library.rounding
        # A little above the maximum, which remains the limit after the rounding is taken off.
        lowest = 0.0 * self._poses.x + 1.001 * maximum_mps / less
        if self._basis is not None:
            assert self._rules is not None
            if not library.is_torch and lowest.size >= _MANY:
                self._lower_where_near(lowest)
            else:
                for part, poses, people in self._parts():
                    for limit in self._rules.of(people, poses).values():
                        least = library.lowest(limit)
                        if library.is_torch:  # all poses, and nothing in place for the gradients
                            lowest = library.minimum(lowest, least)
                        else:
                            np.minimum(lowest[part], least, out=lowest[part])
            lowest = less * lowest
        lowest = self._lowered(library.minimum(lowest, library.convert(maximum_mps)))
        result = lowest.T if self._times_first else lowest
        if library.is_torch:
            return result
        result = np.ascontiguousarray(result, dtype=np.float64)
        return np.minimum(result, maximum_mps, out=result)

    def reasons(self) -> NDArray[np.object_]:
        """Return the reasons (K, T) of the limits."""
        lowest = 0.0 * self._poses.x + self._maximum_mps
        texts = np.full(lowest.shape, "robot maximum", dtype=object)
        if self._basis is None:
            if self._constraints.speed_limit_mps == 0.0:
                texts[...] = self._constraints.limited_by
            return np.ascontiguousarray(texts.T if self._times_first else texts)
        assert self._rules is not None
        for part, poses, people in self._parts():
            for rule, limits in self._rules.of(people, poses).items():
                for track_id, limit in zip(people.track_ids, limits, strict=True):
                    is_lower = limit < lowest[part]
                    texts[part][is_lower] = f"track {track_id}: {rule}"
                    lowest[part] = np.where(is_lower, limit, lowest[part])
        below = self._lowered(lowest) < lowest
        texts[below] = "recovery after stale data"
        if self._poses.sideways is not None:
            texts[self._poses.sideways] = "robot: moves sideways, but its profile says otherwise"
        if self._basis.stopped:
            texts[...] = "stale data"
        return np.ascontiguousarray(texts.T if self._times_first else texts)

    def _lower_where_near(self, lowest_mps: Any) -> None:
        """Lower the limits so far, one person after the other, where that person is near enough.

        Most people are too far from most poses to allow less than somebody else does.
        """
        assert self._rules is not None
        rows, columns = lowest_mps.shape
        width = min(columns, _FILTERED)
        height = max(1, _FILTERED // width)
        for top in range(0, rows, height):
            for left in range(0, columns, width):
                part = slice(top, top + height), slice(left, left + width)
                poses = self._poses.mapped(partial(_contiguous, part))
                lowest = np.ascontiguousarray(lowest_mps[part])
                near = NearPoses(poses, lowest, self._spare_m)
                for people in self._people:
                    near.lower(self._rules, people.mapped(_cut_column(part)))
                lowest_mps[part] = lowest

    def _lowered(self, limits_mps: Any) -> Any:
        """Return the limits after the recovery from stale data, and what stops the robot."""
        basis, robot, library = self._basis, self._constraints.robot, self._library
        if basis is None or robot is None:
            return limits_mps
        if basis.stopped:
            return 0.0 * limits_mps
        if basis.ceiling_mps is not None:
            rise_mps2 = 0.0 if self._constraints.stale else robot.max_acceleration_mps2
            ceilings_mps = basis.ceiling_mps + rise_mps2 * self._times_s
            ceilings_mps = (1.0 - _LIMIT_ROUNDING * library.rounding) * ceilings_mps
            ceilings = self._column(ceilings_mps[None, :])[0]
            limits_mps = library.minimum(limits_mps, ceilings)
        if self._poses.sideways is not None:
            limits_mps = library.where(self._poses.sideways, 0.0 * limits_mps, limits_mps)
        return limits_mps

    def _inner(self, values: Any) -> Any:
        """Return values (K, T) as the rules compute with them."""
        return self._single(self._turned(values))

    def _turned(self, values: Any) -> Any:
        """Return values (K, T) with the longer axis last, so that rows are long."""
        values = values.T if self._times_first else values
        return values if self._library.is_torch else np.ascontiguousarray(values)

    def _single(self, values: Any) -> Any:
        return values if self._library.is_torch else values.astype(np.float32)

    def _column(self, values: FloatArray) -> Any:
        """Return numbers (N, T) or (N, 1) as they broadcast with people and poses."""
        converted = self._library.convert(values)
        return converted[:, :, None] if self._times_first else converted[:, None, :]

    def _parts(self) -> Iterator[tuple[tuple[slice, slice], Poses, PeopleAhead]]:
        """Yield parts of the poses, small enough for the cache, with each group of people."""
        rows, columns = self._poses.x.shape
        for people in self._people:
            together = max(1, _TOGETHER // len(people.track_ids))
            if self._library.is_torch:
                together = rows * columns
            width = min(columns, together)
            height = max(1, together // width)
            for top in range(0, rows, height):
                for left in range(0, columns, width):
                    part = slice(top, top + height), slice(left, left + width)
                    yield part, self._poses.mapped(_cut(part)), people.mapped(_cut_column(part))


def _contiguous(part: tuple[slice, slice], values: Any) -> Any:
    return np.ascontiguousarray(values[part]) if values.ndim else values


def _largest(values: Any) -> float:
    return values if isinstance(values, float) else float(values.max())


def _cut(part: tuple[slice, slice]) -> Callable[[Any], Any]:
    return lambda values: values[part]


def _cut_column(part: tuple[slice, slice]) -> Callable[[Any], Any]:
    """Return a function that cuts a part out of numbers (N, 1 or rows, 1 or columns)."""

    def cut(values: Any) -> Any:
        rows = part[0] if values.shape[1] > 1 else slice(None)
        columns = part[1] if values.shape[2] > 1 else slice(None)
        return values[:, rows, columns]

    return cut
