"""Views: where a sensor would have detected a person, and which places it has seen empty."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from perception import Camera
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import (
    FloatArray,
    finite_array,
    finite_number,
    rigid_transform,
    rotation_matrix,
    set_fields,
)

from ._errors import TrackingError

if TYPE_CHECKING:
    from perception.laser import ScanPoints

BoolArray = NDArray[np.bool_]

#: Height of the point that represents a body.
CHEST_M: Final = 1.2
# A gap between the rays that have passed a place hides nobody if it is no wider than a child's leg.
_GAP_M: Final = 0.08


@runtime_checkable
class View(Protocol):
    """The chance that a frame shows a person, for each position.

    A view may take racks and walls into account. It does not need to consider people who hide each
    other: the tracker does that itself. A view must not keep state between calls, since late frames
    are processed again.
    """

    def visibility(self, positions_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
        """Return (N,) in [0, 1]: the chance that a person at each position would be detected.

        Args:
            positions_odom_m: (N, 2) on the floor plane.
            T_odom_camera: (4, 4) pose of the camera.
        """
        ...


@runtime_checkable
class RangedView(View, Protocol):
    """A view whose sensor measures how far it sees: it can show that a place is empty.

    Without one, a frame that does not show a person does not prove that the place is empty: before
    it may stand something that neither the map nor the tracker knows.
    """

    def passed(
        self, positions_odom_m: FloatArray, radii_m: FloatArray, T_odom_camera: FloatArray
    ) -> BoolArray:
        """Return (N,) whether the frame has seen through all of each place, to what lies behind.

        Args:
            positions_odom_m: (N, 2) on the floor plane.
            radii_m: (N,) of the places.
            T_odom_camera: (4, 4) pose of the sensor.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class CameraView:
    """The view of a camera: people whose chest is in the image and within range are visible.

    Visibility falls linearly from 1 to 0 over a margin at the left and right of the image, where
    bodies are cut off, and over the last fifth of the range. The floor is at z = 0 in odom.

    Attributes:
        camera: its intrinsics.
        max_range_m: > 0, horizontal distance from which visibility is 0.
        min_range_m: ≥ 0; nearer than this, visibility is 0: too little of a body is in the image.
        side_margin: in [0, 0.5), width of the margin at each side as a share of the image's width.
        chest_height_m: ≥ 0, height of the point that represents a body.
    """

    camera: Camera
    max_range_m: float = 8.0
    min_range_m: float = 0.5
    side_margin: float = 0.05
    chest_height_m: float = CHEST_M
    _limits: tuple[float, float, float, float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        camera = self.camera
        if not isinstance(camera, Camera):
            raise TrackingError(f"camera must be a Camera, got {type(camera).__name__}")
        set_fields(
            self,
            max_range_m=finite_number(
                "max_range_m", self.max_range_m, TrackingError, minimum=0.0, exclusive_minimum=True
            ),
            chest_height_m=finite_number(
                "chest_height_m", self.chest_height_m, TrackingError, minimum=0.0
            ),
            side_margin=finite_number(
                "side_margin", self.side_margin, TrackingError, minimum=0.0, maximum=0.49
            ),
        )
        set_fields(
            self,
            min_range_m=finite_number(
                "min_range_m",
                self.min_range_m,
                TrackingError,
                minimum=0.0,
                maximum=self.max_range_m,
            ),
        )
        # Image borders are curved if the lens distorts. Use a rectangle in x/z and y/z through the
        # middles of the four borders: projecting people with the lens model instead would fold
        # those far outside the image back into it.
        right, bottom = camera.width_px - 0.5, camera.height_px - 0.5
        sides = camera.normalise(
            [
                [-0.5, camera.cy_px],
                [right, camera.cy_px],
                [camera.cx_px, -0.5],
                [camera.cx_px, bottom],
            ],
            nearest=True,
        )
        set_fields(
            self,
            _limits=(
                float(sides[0, 0]),
                float(sides[1, 0]),
                float(sides[2, 1]),
                float(sides[3, 1]),
            ),
        )

    def visibility(self, positions_odom_m: Any, T_odom_camera: Any) -> FloatArray:
        """Return (N,) in [0, 1] for people at ``positions_odom_m`` (N, 2).

        Raises:
            TrackingError: for positions that are not finite or not (N, 2), and for a
                ``T_odom_camera`` that is not a rigid transform.
        """
        positions = finite_array("positions_odom_m", positions_odom_m, ("N", 2), TrackingError)
        T = rigid_transform("T_odom_camera", T_odom_camera, TrackingError)
        chests = np.column_stack((positions, np.full(len(positions), self.chest_height_m)))
        x, y, z = ((chests - T[:3, 3]) @ T[:3, :3]).T
        ranges = np.hypot(*(positions - T[:2, 3]).T)
        ahead = z > 1e-6
        depth = np.where(ahead, z, 1.0)
        left, right, top, bottom = self._limits
        aside, up = x / depth, y / depth
        inside = ahead & (up >= top) & (up <= bottom) & (ranges >= self.min_range_m)
        margin = max(self.side_margin * (right - left), 1e-9)
        from_side = np.minimum(aside - left, right - aside) / margin
        from_range = (self.max_range_m - ranges) / (0.2 * self.max_range_m)
        return np.where(inside, np.clip(np.minimum(from_side, from_range), 0.0, 1.0), 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class ScannerView:
    """The view of a laser scanner whose frame has x ahead and y to the left, as in REP-103.

    Visibility falls linearly from 1 to 0 over the last fifth of the range. With the points of one
    scan it is the view of that scan (``PersonTracker.update(..., view=...)``): people are visible
    only as far as rays have reached, and places are empty that rays have passed.

    Attributes:
        max_range_m: > 0, horizontal distance from which people are not recognised.
        min_range_m: ≥ 0; nearer than this, visibility is 0.
        field_rad: in (0, 2π], the angle over which the scanner scans, centred ahead.
        points: of the scan, in odom; None for a view of which the ranges are unknown.
    """

    max_range_m: float = 8.0
    min_range_m: float = 0.1
    field_rad: float = 2.0 * np.pi
    points: ScanPoints | None = None

    def __post_init__(self) -> None:
        def number(name: str, high: float, *, positive: bool) -> float:
            return finite_number(
                name,
                getattr(self, name),
                TrackingError,
                minimum=0.0,
                exclusive_minimum=positive,
                maximum=high,
            )

        set_fields(
            self,
            max_range_m=number("max_range_m", float("inf"), positive=True),
            min_range_m=number("min_range_m", self.max_range_m, positive=False),
            field_rad=number("field_rad", 2.0 * np.pi, positive=True),
        )
        if not (self.points is None or hasattr(self.points, "ends_odom_m")):
            raise TrackingError(
                f"points must be ScanPoints or None, got {type(self.points).__name__}"
            )

    def visibility(self, positions_odom_m: Any, T_odom_camera: Any) -> FloatArray:
        """Return (N,) in [0, 1] for people at ``positions_odom_m`` (N, 2).

        ``T_odom_camera`` (4, 4) is the pose of the scanner. With points, of the rays towards a body
        those count that have come as far as its near side, or have met nothing.

        Raises:
            TrackingError: for positions that are not finite or not (N, 2), and for a
                ``T_odom_camera`` that is not a rigid transform.
        """
        positions = finite_array("positions_odom_m", positions_odom_m, ("N", 2), TrackingError)
        T = rigid_transform("T_odom_camera", T_odom_camera, TrackingError)
        offset = positions - T[:2, 3]
        ranges = np.hypot(offset[:, 0], offset[:, 1])
        # A scanner that hangs upside down has its y axis to the right; the field is symmetrical.
        x, y = (offset @ T[:2, :2]).T
        inside = (np.abs(np.arctan2(y, x)) <= 0.5 * self.field_rad) & (ranges >= self.min_range_m)
        from_range = (self.max_range_m - ranges) / (0.2 * self.max_range_m)
        in_view = np.where(inside, np.clip(from_range, 0.0, 1.0), 0.0)
        if self.points is None:
            return in_view
        along, across, free, _ = _towards(positions, self.points)
        at_body = (along > 0.0) & (np.abs(across) <= BODY_RADIUS_M)
        reached = (at_body & (free >= along - BODY_RADIUS_M)).sum(axis=1)
        # Rays that saw nothing are not among those at the body: as many as it takes must be there.
        whole_rad = 2.0 * np.arcsin(BODY_RADIUS_M / np.maximum(ranges, BODY_RADIUS_M))
        wanted = np.floor(whole_rad / abs(self.points.angle_increment_rad))
        wanted = np.maximum(np.maximum(wanted, at_body.sum(axis=1)), 1.0)
        return np.asarray(in_view * reached / wanted)

    def passed(self, positions_odom_m: Any, radii_m: Any, T_odom_camera: Any) -> BoolArray:
        """Return (N,) whether the rays show that nobody is within ``radii_m`` (N,) of each place.

        They do if those that have met something behind the place leave no gap across it that is
        wider than a leg. A ray that met nothing (+inf) proves nothing, since dark clothes return
        nothing either. Without points nothing is proved.

        Raises:
            TrackingError: for positions or radii that are not finite or not (N, 2) and (N,).
        """
        positions = finite_array("positions_odom_m", positions_odom_m, ("N", 2), TrackingError)
        radii = finite_array("radii_m", radii_m, (len(positions),), TrackingError)
        found = np.zeros(len(positions), dtype=np.bool_)
        if self.points is None:
            return found
        along, across, free, measured = _towards(positions, self.points)
        at_place = (along > 0.0) & (np.abs(across) < radii[:, None])
        behind = along + np.sqrt(np.maximum(radii[:, None] ** 2 - across * across, 0.0))
        beyond = at_place & measured & (free > behind)
        for row, radius_m in enumerate(radii.tolist()):
            sides = np.sort(np.concatenate(([-radius_m, radius_m], across[row, beyond[row]])))
            found[row] = np.diff(sides).max() <= _GAP_M
        return found


def _towards(
    positions_m: FloatArray, points: ScanPoints
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Return where N places lie as seen along the R rays of a scan that saw something.

    The place's distance along each ray (N, R) and to its left (N, R), the distance over which each
    ray met nothing (R,), and whether it then met something (R,); all on the floor plane.
    """
    origins, x, y, free, measured = _rays_of(points)
    to_x, to_y = positions_m.T[..., None] - origins[:, None]
    return to_x * x + to_y * y, to_y * x - to_x * y, free, measured


@lru_cache(maxsize=4)  # the last scan of each scanner is asked several times
def _rays_of(
    points: ScanPoints,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, BoolArray]:
    """Return the R rays of a scan that saw something, on the floor plane.

    They are their starts (2, R), their directions' x and y (R,), and the last two of
    :func:`_towards`.
    """
    known = np.isfinite(points.ends_odom_m[:, 0]).nonzero()[0]
    origins = points.origins_odom_m.T[:2].take(known, axis=1)
    x, y = points.ends_odom_m.T[:2].take(known, axis=1) - origins
    free = np.hypot(x, y)
    return origins, x / free, y / free, free, points.usable[known]


@dataclass(frozen=True, slots=True, eq=False)
class SurroundView:
    """The union of several views with one optical centre, for example of a fisheye camera.

    Attributes:
        views: V views, each in its own optical frame; a :class:`CameraView` for each flat camera.
        rotations_camera_view: V rotations (3, 3) from each view's optical frame to the camera's, as
            in :class:`perception.surround.FlatView`.
    """

    views: tuple[View, ...]
    rotations_camera_view: tuple[FloatArray, ...]

    def __post_init__(self) -> None:
        views = tuple(self.views)
        rotations = tuple(
            rotation_matrix(f"rotations_camera_view[{index}]", rotation, TrackingError)
            for index, rotation in enumerate(self.rotations_camera_view)
        )
        if not views or len(views) != len(rotations):
            raise TrackingError(
                "views and rotations_camera_view must be of one length, at least 1, got "
                f"{len(views)} and {len(rotations)}"
            )
        for view in views:
            if not isinstance(view, View):
                raise TrackingError(
                    "views must have a method visibility(positions_odom_m, T_odom_camera), "
                    f"got {type(view).__name__}"
                )
        set_fields(self, views=views, rotations_camera_view=rotations)

    def visibility(self, positions_odom_m: Any, T_odom_camera: Any) -> FloatArray:
        """Return (N,) in [0, 1]: for each person, the visibility in the best view.

        Raises:
            TrackingError: as raised by the views, and for a ``T_odom_camera`` that is not a rigid
                transform.
        """
        T_odom_camera = rigid_transform("T_odom_camera", T_odom_camera, TrackingError)
        visibilities = []
        for view, rotation in zip(self.views, self.rotations_camera_view, strict=True):
            T_odom_view = np.array(T_odom_camera)
            T_odom_view[:3, :3] = T_odom_camera[:3, :3] @ rotation
            visibilities.append(view.visibility(positions_odom_m, T_odom_view))
        return np.asarray(np.max(visibilities, axis=0))
