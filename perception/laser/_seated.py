"""People who sit: a scan meets their shanks, and a camera tells where the trunk is."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from .._observation import PersonObservation
from ..arrays import FloatArray, finite_array
from ..errors import PerceptionError
from ._candidate import PersonCandidate

# Somebody sits whose chest is this far beside the ankles and less than this above them, on a body
# of average size.
_BESIDE_M: Final = 0.2
_ABOVE_M: Final = 1.0
# Fewest images that show it, and the weight of the last one.
_IMAGES: Final = 4
_NEWEST: Final = 0.15
# One person in two images is this near to the same ray, and the legs of one person, of which a scan
# may meet either, this near to each other.
_SAME_M: Final = 0.35
_LEGS_M: Final = 0.45
# The assumed size is at most this much too large or too small.
_RATIOS: Final = (0.85, 1.8)
# Without images the posture holds for this long after the legs were met last, where they were when
# an image was at most this old.
_REMEMBERED_S: Final = 2.0
_RECENT_S: Final = 0.5
# Everything that is met this near to the line from legs to trunk is the person or the seat.
_BODY_M: Final = 0.35
_STD_M: Final = 0.08


@dataclass(slots=True, eq=False)
class _Seated:
    """Somebody whom images show, from ankles to chest.

    Attributes:
        offset_m: (3,) from the ankles to the chest in odom, mean of the images.
        eye_m: (2,) place of the camera.
        ankles_m: (2,) place of the ankles by the camera.
        images: number of images.
        image_s: time of the last image.
        met_s: time of the last scan that met the legs.
        legs_m: (2,) place of the legs by the scanner, in the last scan with a recent image; None
            until it met them.
        ratio: by how much the camera puts them too far away.
    """

    offset_m: FloatArray
    eye_m: FloatArray
    ankles_m: FloatArray
    images: int
    image_s: float
    met_s: float = -math.inf
    legs_m: FloatArray | None = None
    ratio: float = 1.0

    @property
    def sits(self) -> bool:
        """True if the images show a person who sits."""
        beside = float(np.hypot(*self.offset_m[:2]))
        return self.images >= _IMAGES and beside > _BESIDE_M and self.offset_m[2] < _ABOVE_M

    def ratio_to(self, legs_m: FloatArray) -> float | None:
        """Return how many times too far the camera puts legs at a place; None if not their ray."""
        ray, legs = self.ankles_m - self.eye_m, legs_m - self.eye_m
        far, near = float(np.hypot(*ray)), float(np.hypot(*legs))
        if far <= 0.0 or near <= 0.0 or float(ray @ legs) <= 0.0:
            return None
        across = abs(float(ray[0] * legs[1] - ray[1] * legs[0])) / far
        low, high = _RATIOS
        return far / near if across <= _SAME_M and low <= far / near <= high else None

    def may_have(self, legs_m: FloatArray) -> bool:
        """Return whether legs that a scan met may be this person's."""
        if self.legs_m is None:
            return self.ratio_to(legs_m) is not None
        return bool(np.hypot(*(legs_m - self.legs_m)) <= _LEGS_M)


class SeatedPeople:
    """Puts candidates of people who sit where their trunk is.

    A scan cannot tell the shanks of somebody seated from the legs of somebody who stands, and they
    are about 0.4 m apart from the trunk. An image of the whole body shows it. The distance from
    ankles to chest is scaled by the measured range, so that it also holds for children.
    """

    def __init__(self) -> None:
        self._people: list[_Seated] = []

    def see(self, observations: Iterable[PersonObservation], T_odom_camera: Any) -> None:
        """Note the postures in an image.

        Args:
            observations: people of the image; those without ``legs_camera_m`` are left out.
            T_odom_camera: (4, 4) pose of the camera.

        Raises:
            PerceptionError: for a pose that is no finite (4, 4) array.
        """
        T = finite_array("T_odom_camera", T_odom_camera, (4, 4))
        others = list(self._people)
        for one in observations:
            if not isinstance(one, PersonObservation):
                raise PerceptionError(
                    f"observations must be of PersonObservation, got {type(one).__name__}"
                )
            if one.legs_camera_m is None:
                continue
            ankles = (T[:3, :3] @ one.legs_camera_m + T[:3, 3])[:2]
            offset = T[:3, :3] @ (one.position_camera_m - one.legs_camera_m)
            known = _nearest(others, ankles, T[:2, 3])
            if known is None:
                self._people.append(_Seated(offset, T[:2, 3], ankles, 1, one.stamp_s))
                continue
            others.remove(known)
            weight = max(_NEWEST, 1.0 / (1.0 + known.images))
            known.offset_m = known.offset_m + weight * (offset - known.offset_m)
            known.eye_m, known.ankles_m = T[:2, 3], ankles
            known.images += 1
            known.image_s = max(known.image_s, one.stamp_s)

    def placed(
        self, candidates: Iterable[PersonCandidate], stamp_s: float
    ) -> tuple[PersonCandidate, ...]:
        """Return the candidates of one scan, with those of people who sit at their trunk.

        What is met of a seat beside them is left out.

        Args:
            candidates: of :meth:`LegDetector.detect`.
            stamp_s: time of the scan.
        """
        self._people = [
            each
            for each in self._people
            if stamp_s - max(each.image_s, each.met_s) <= _REMEMBERED_S
        ]
        rest = list(candidates)
        found: list[PersonCandidate] = []
        for person in self._people:
            if not person.sits:
                continue
            own = [
                (_order(person, each, each.legs_odom_m), number, each.legs_odom_m)
                for number, each in enumerate(rest)
                if each.legs_odom_m is not None and person.may_have(each.legs_odom_m)
            ]
            if not own:
                continue
            _, number, legs = min(own, key=lambda each: each[:2])
            best = rest[number]
            person.met_s = max(person.met_s, stamp_s)
            if person.legs_m is None or stamp_s - person.image_s <= _RECENT_S:
                person.ratio = person.ratio_to(legs) or person.ratio
                person.legs_m = legs
            place = legs + person.offset_m[:2] / person.ratio
            rest = [each for each in rest if each is not best and not _between(each, legs, place)]
            found.append(replace(best, position_odom_m=place, covariance_m2=_STD_M**2 * np.eye(2)))
        return (*found, *rest)


def _nearest(people: list[_Seated], ankles_m: FloatArray, eye_m: FloatArray) -> _Seated | None:
    """Return who of these people has ankles on the ray of ankles in a new image."""
    best, nearest = None, _SAME_M
    for each in people:
        ray, to = ankles_m - eye_m, each.ankles_m - eye_m
        far = max(float(np.hypot(*ray)), 1e-6)
        across = abs(float(ray[0] * to[1] - ray[1] * to[0])) / far
        along = float(ray @ to) / far
        if across < nearest and 0.6 * far < along < 1.6 * far:
            best, nearest = each, across
    return best


def _between(candidate: PersonCandidate, legs_m: FloatArray, trunk_m: FloatArray) -> bool:
    """Return whether a candidate is a part of the body between legs and trunk, or of the seat."""
    along = trunk_m - legs_m
    for point in (candidate.position_odom_m, candidate.legs_odom_m):
        if point is None:
            continue
        share = float((point - legs_m) @ along) / max(float(along @ along), 1e-9)
        nearest = legs_m + min(max(share, 0.0), 1.0) * along
        if np.hypot(*(point - nearest)) <= _BODY_M:
            return True
    return False


def _order(person: _Seated, candidate: PersonCandidate, legs_m: FloatArray) -> tuple[bool, float]:
    """Return the order of candidates: two legs first, then the most certain or the nearest."""
    if person.legs_m is None:
        return candidate.kind != "two_legs", -candidate.score
    return candidate.kind != "two_legs", float(np.hypot(*(legs_m - person.legs_m)))
