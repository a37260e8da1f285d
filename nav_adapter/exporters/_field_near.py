"""The poses that a person is near enough to: most people are too far from most poses to count."""

from __future__ import annotations

from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ._field_limits import FieldLimits
from ._field_people import PeopleAhead
from ._field_poses import Poses

# Poses that a person is near to are taken out of the others unless nearly all of them are.
_NEARLY_ALL: Final = 0.9


class NearPoses:
    """Poses whose limits are lowered by one person after the other, where that person is near.

    The limits are to the bit those of all people at all poses. It works with NumPy only.

    Args:
        poses: arrays (rows, columns), contiguous.
        limits_mps: (rows, columns) so far, contiguous; :meth:`lower` writes into it.
        spare_m: added to every distance, for rounding and for what is not known of the pose.
    """

    def __init__(self, poses: Poses, limits_mps: NDArray[np.float32], spare_m: float) -> None:
        self._poses = poses
        self._limits_mps = limits_mps
        self._spare_m = spare_m
        self._columns: Final = limits_mps.shape[1]
        self._starts: Final = self._columns * np.arange(limits_mps.shape[0] + 1)
        self._free_m2, self._x, self._y = np.empty((3, *limits_mps.shape), dtype=np.float32)
        self._is_near = np.empty(limits_mps.shape, dtype=bool)

    def lower(self, rules: FieldLimits, people: PeopleAhead) -> None:
        """Lower the limits to those of the people, whose arrays broadcast with the poses."""
        flat = self._limits_mps.reshape(-1)
        for index in range(len(people.track_ids)):
            near = self._near(people, index)
            if near.size > _NEARLY_ALL * flat.size:
                person = people.mapped(partial(_only, index))
                for limit in rules.of(person, self._poses).values():
                    np.minimum(self._limits_mps, limit[0], out=self._limits_mps)
            elif near.size:
                limits_mps = flat[near]
                poses = self._poses.mapped(partial(_at, near))
                for limit in rules.of(self._person(people, index, near), poses).values():
                    np.minimum(limits_mps, limit[0], out=limits_mps)
                flat[near] = limits_mps

    def _near(self, people: PeopleAhead, index: int) -> NDArray[np.int64]:
        """Return where a person may allow less than the limits so far, as flat indices."""
        reach, limits_mps, free_m2 = people.reaches[index], self._limits_mps, self._free_m2
        np.multiply(limits_mps, np.float32(reach.square_s2pm), out=free_m2)
        free_m2 += np.float32(reach.linear_s)
        free_m2 *= limits_mps
        free_m2 += np.float32(reach.fixed_m + self._spare_m)
        free_m2 *= free_m2
        is_near = self._is_within(people.x[index], people.y[index])
        if people.track_x is not None:
            is_near = is_near.copy()
            is_near |= self._is_within(people.track_x[index], people.track_y[index])
        return np.flatnonzero(is_near)

    def _is_within(self, x: Any, y: Any) -> Any:
        np.subtract(self._poses.x, x, out=self._x)
        np.subtract(self._poses.y, y, out=self._y)
        self._x *= self._x
        self._y *= self._y
        self._x += self._y
        return np.less(self._x, self._free_m2, out=self._is_near)

    def _person(self, people: PeopleAhead, index: int, near: NDArray[np.int64]) -> PeopleAhead:
        """Return one of the people at the near poses, in arrays (1, M) or (1, 1)."""
        counts = np.diff(near.searchsorted(self._starts))

        def at_near(values: Any) -> Any:
            if values.shape[1] > 1:
                return values[index, :, 0].repeat(counts)[None]
            if values.shape[2] > 1:
                return values[index, 0].take(near % self._columns)[None]
            return values[index]

        return people.mapped(at_near)


def _only(index: int, values: Any) -> Any:
    return values[index : index + 1]


def _at(near: NDArray[np.int64], values: Any) -> Any:
    return values.take(near) if values.ndim else values
