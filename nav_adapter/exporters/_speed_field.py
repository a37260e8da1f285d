"""The speed limit at hypothetical poses and times."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray, finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from ._field_arrays import ArrayLibrary, checked, is_tensor, library_of
from ._field_limits import FieldLimits
from ._field_people import PeopleAhead, people_ahead
from ._field_poses import Poses, poses_of

# Numbers computed together: enough that the calls cost little, and few enough for the cache.
_TOGETHER: Final = 20_000
# Rounding of positions and of limits, in units of the last place.
_POSITION_ROUNDING: Final = 8.0
_LIMIT_ROUNDING: Final = 32.0


def speed_limit_at(
    constraints: NavConstraints,
    positions_odom_m: Any,
    headings_odom_rad: Any = None,
    *,
    dt_s: float,
    first_s: float = 0.0,
    speeds_mps: Any = None,
    yaw_rates_radps: Any = None,
    aware_for_s: float = math.inf,
) -> Any:
    """Return (K, T), the speed limit in m/s at K × T poses, people moving as predicted.

    It is a lower bound of the limit that ``NavAdapter.update`` will give at that time to a robot
    that is there. All rules of the policy count, and so do lost people, the age of the data and the
    recovery after stale data. Whatever is not given counts with its worst value:

    * without headings the robot's circumscribed circle counts, and people in every direction;
    * without speeds the robot may stand or drive in any direction, so people behind count in full;
    * without yaw rates, a robot whose state has an age may have turned by any angle since.

    The bound holds if

    * people keep the velocity of their track, and those whom the latest frames show are seen as
      now: with the same covariance, the same age of the data and at least the same awareness;
    * people out of sight, and missing ones, are not seen again; the uncertainty of a track that
      coasts grows with its velocity's;
    * the tracker reports at least once per ``fresh_within_s``, and the adapter is updated as often;
    * the robot is no faster than its maximum.

    For people who stand and are seen, it is the limit itself.

    With torch tensors of positions the result is a tensor with gradients, computed without a copy
    in their precision and on their device. Other arrays are computed in single precision, and the
    rounding error is taken off the limit.

    Args:
        constraints: of ``NavAdapter.update``.
        positions_odom_m: (K, T, 2) of the robot's base; entry t is at ``first_s + t·dt_s`` after
            ``constraints.stamp_s``.
        headings_odom_rad: (K, T), or None for any.
        dt_s: > 0, time step.
        first_s: ≥ 0, time of the first entry.
        speeds_mps: (K, T) signed along the heading, or (K, T, 2) forward and left, or None.
        yaw_rates_radps: (K, T), or None.
        aware_for_s: ≥ 0, how long after the stamp awareness counts. People are unaware from then
            on, as they may have looked away.

    Raises:
        NavError: for an argument that is not finite, out of bounds or of a wrong shape, and for
            constraints that do not come from ``update`` unless they stop the robot.
    """
    request = _Request(
        constraints,
        positions_odom_m,
        headings_odom_rad,
        dt_s,
        first_s,
        speeds_mps,
        yaw_rates_radps,
        aware_for_s,
    )
    return request.limits_mps()


def limited_by_at(
    constraints: NavConstraints,
    positions_odom_m: Any,
    headings_odom_rad: Any = None,
    *,
    dt_s: float,
    first_s: float = 0.0,
    speeds_mps: Any = None,
    yaw_rates_radps: Any = None,
    aware_for_s: float = math.inf,
) -> NDArray[np.object_]:
    """Return (K, T), the person and the rule that set each limit of :func:`speed_limit_at`.

    The texts are those of :attr:`~nav_adapter.NavConstraints.limited_by`, such as ``"track 3: speed
    and separation"``. The arguments and errors are those of :func:`speed_limit_at`. It takes
    several times as long, so ask for the few poses that matter.
    """
    request = _Request(
        constraints,
        np.asarray(positions_odom_m),
        headings_odom_rad,
        dt_s,
        first_s,
        speeds_mps,
        yaw_rates_radps,
        aware_for_s,
    )
    return request.reasons()


def time_cost(
    constraints: NavConstraints,
    positions_odom_m: Any,
    headings_odom_rad: Any = None,
    *,
    dt_s: float,
    first_s: float = 0.0,
    speeds_mps: Any = None,
    yaw_rates_radps: Any = None,
    aware_for_s: float = math.inf,
    slowest_mps: float = 0.05,
) -> Any:
    """Return (K,), the seconds that a robot takes along K trajectories at the limits there.

    Each step counts with its length over the lower limit of its two ends. A robot that stands takes
    no time, so add what remains to the goal, for example the distance over the maximum speed.

    A limit below ``slowest_mps`` counts as that, so the cost is finite. With ``slowest_mps=0`` a
    trajectory through a place where the robot must stop costs infinite time.

    Args:
        constraints: as for :func:`speed_limit_at`, like the other arguments.
        positions_odom_m: (K, T, 2), T ≥ 2 for a cost above 0.
        headings_odom_rad: (K, T), or None.
        dt_s: > 0.
        first_s: ≥ 0.
        speeds_mps: (K, T), (K, T, 2) or None.
        yaw_rates_radps: (K, T), or None.
        aware_for_s: ≥ 0.
        slowest_mps: ≥ 0, least speed that counts.

    Raises:
        NavError: as :func:`speed_limit_at`.
    """
    slowest = finite_number("slowest_mps", slowest_mps, NavError, minimum=0.0)
    limits = speed_limit_at(
        constraints,
        positions_odom_m,
        headings_odom_rad,
        dt_s=dt_s,
        first_s=first_s,
        speeds_mps=speeds_mps,
        yaw_rates_radps=yaw_rates_radps,
        aware_for_s=aware_for_s,
    )
    if is_tensor(positions_odom_m):
        library, positions = library_of(positions_odom_m), positions_odom_m
        steps = positions[:, 1:] - positions[:, :-1]
        lengths = library.sqrt((steps * steps).sum(-1))
        slower = library.at_least(library.minimum(limits[:, 1:], limits[:, :-1]), slowest)
        return (lengths / slower).sum(-1)
    steps = np.diff(np.asarray(positions_odom_m, dtype=np.float64), axis=1)
    lengths = np.hypot(steps[..., 0], steps[..., 1])
    slower = np.maximum(np.minimum(limits[:, 1:], limits[:, :-1]), slowest)
    seconds = np.full(lengths.shape, math.inf)
    np.divide(lengths, slower, out=seconds, where=slower > 0.0)
    return np.where(lengths > 0.0, seconds, 0.0).sum(axis=1)


class _Request:
    """Poses and times that were asked for, after a check."""

    def __init__(
        self,
        constraints: NavConstraints,
        positions_odom_m: Any,
        headings_odom_rad: Any,
        dt_s: float,
        first_s: float,
        speeds_mps: Any,
        yaw_rates_radps: Any,
        aware_for_s: float,
    ) -> None:
        positions = checked("positions_odom_m", positions_odom_m, ("K", "T", 2), positions_odom_m)
        self._shape: tuple[int, int] = (int(positions.shape[0]), int(positions.shape[1]))
        dt = finite_number("dt_s", dt_s, NavError, minimum=0.0, exclusive_minimum=True)
        first = finite_number("first_s", first_s, NavError, minimum=0.0)
        if not aware_for_s >= 0.0:
            raise NavError(f"aware_for_s must be >= 0 s, got {aware_for_s!r:.80}")
        headings = self._checked("headings_odom_rad", headings_odom_rad, positions)
        rates = self._checked("yaw_rates_radps", yaw_rates_radps, positions)
        times_s = first + dt * np.arange(self._shape[1])
        self.field = SpeedField(constraints, library_of(positions), times_s, aware_for_s)
        velocities = self._velocities(speeds_mps, positions)
        self.field.place(positions, headings, velocities, rates)

    def limits_mps(self) -> Any:
        return self.field.limits_mps()

    def reasons(self) -> NDArray[np.object_]:
        return self.field.reasons()

    def _checked(self, name: str, values: Any, positions: Any) -> Any:
        return None if values is None else checked(name, values, self._shape, positions)

    def _velocities(self, speeds_mps: Any, positions: Any) -> tuple[Any, Any] | None:
        """Return the speeds forward and to the left."""
        if speeds_mps is None:
            return None
        if len(np.shape(speeds_mps)) == 3:
            both = checked("speeds_mps", speeds_mps, (*self._shape, 2), positions)
            return both[:, :, 0], both[:, :, 1]
        forward = checked("speeds_mps", speeds_mps, self._shape, positions)
        return forward, None


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
        basis = constraints.speed_basis
        if basis is None and constraints.speed_limit_mps > 0.0:
            raise NavError(
                "constraints must come from NavAdapter.update, got some without speed_basis"
            )
        self._constraints = constraints
        self._basis = basis
        self._library = library
        self._times_s = times_s
        self._aware_for_s = aware_for_s
        self._reach_m = reach_m
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
        basis, library = self._basis, self._library
        self._times_first = positions_m.shape[1] <= positions_m.shape[0]
        x, y = positions_m[:, :, 0], positions_m[:, :, 1]
        if basis is None or not positions_m.shape[0] * positions_m.shape[1]:
            # Nothing but the shape is needed.
            self._basis, self._poses = None, Poses(self._inner(x), self._inner(y))
            return
        low = np.array([x.min().item(), y.min().item()])
        high = np.array([x.max().item(), y.max().item()])
        reference = 0.5 * (low + high)
        self._poses = poses_of(
            library,
            basis,
            self._inner(x - float(reference[0])),
            self._inner(y - float(reference[1])),
            None if headings_rad is None else self._inner(headings_rad),
            None
            if velocities_mps is None
            else (
                self._inner(velocities_mps[0]),
                None if velocities_mps[1] is None else self._inner(velocities_mps[1]),
            ),
            None if yaw_rates_radps is None else self._inner(yaw_rates_radps),
        )

        def is_near(places_m: FloatArray, within_m: float) -> bool:
            off_m = places_m - np.clip(places_m, low, high)
            return bool(np.hypot(off_m[:, 0], off_m[:, 1]).min() <= within_m + self._reach_m)

        people = people_ahead(
            basis,
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
        self._rules = FieldLimits(library, basis, rounding_m, self._reach_m)

    def limits_mps(self) -> Any:
        """Return the limits (K, T)."""
        library, maximum_mps = self._library, self._maximum_mps
        lowest = 0.0 * self._poses.x + 2.0 * maximum_mps
        if self._basis is not None:
            assert self._rules is not None
            for part, poses, people in self._parts():
                for limit in self._rules.of(people, poses).values():
                    least = library.lowest(limit)
                    if library.is_torch:  # all poses, and nothing in place for the gradients
                        lowest = library.minimum(lowest, least)
                    else:
                        np.minimum(lowest[part], least, out=lowest[part])
            lowest = (1.0 - _LIMIT_ROUNDING * library.rounding) * lowest
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

    @property
    def _maximum_mps(self) -> float:
        basis = self._constraints.speed_basis
        return 0.0 if basis is None else basis.robot.max_speed_mps

    def _lowered(self, limits_mps: Any) -> Any:
        """Return the limits after the recovery from stale data, and what stops the robot."""
        basis, library = self._basis, self._library
        if basis is None:
            return limits_mps
        if basis.stopped:
            return 0.0 * limits_mps
        if basis.ceiling_mps is not None:
            rise_mps2 = 0.0 if self._constraints.stale else basis.robot.max_acceleration_mps2
            ceilings_mps = basis.ceiling_mps + rise_mps2 * self._times_s
            ceilings_mps = (1.0 - _LIMIT_ROUNDING * library.rounding) * ceilings_mps
            ceilings = self._column(ceilings_mps[None, :])[0]
            limits_mps = library.minimum(limits_mps, ceilings)
        if self._poses.sideways is not None:
            limits_mps = library.where(self._poses.sideways, 0.0 * limits_mps, limits_mps)
        return limits_mps

    def _inner(self, values: Any) -> Any:
        """Return values (K, T) with the longer axis last, so that rows are long."""
        values = values.T if self._times_first else values
        if self._library.is_torch:
            return values
        return np.ascontiguousarray(values, dtype=np.float32)

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


def _cut(part: tuple[slice, slice]) -> Any:
    return lambda values: values[part]


def _cut_column(part: tuple[slice, slice]) -> Any:
    """Return a function that cuts a part out of numbers (N, 1 or rows, 1 or columns)."""

    def cut(values: Any) -> Any:
        rows = part[0] if values.shape[1] > 1 else slice(None)
        columns = part[1] if values.shape[2] > 1 else slice(None)
        return values[:, rows, columns]

    return cut
