"""The surround pipeline: from an RGB image of a wide lens to one observation per person."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import cv2
import numpy as np

from .._camera import Camera
from .._floor import FloorPlane
from .._observation import PersonObservation
from .._pipeline import AwarenessPipeline
from ..arrays import FloatArray, ImageRgb, check_image, unit_vector
from ..errors import PerceptionError
from ..matrices import CHI2_999, mahalanobis2
from ._lenses import FlatView, PanoramaLens, WideLens

# Two observations are of the same person up to 99.9 % in the plane across the camera's y axis, and
# up to this distance.
_SAME_WITHIN_M: Final = 1.0
# Standard deviation to add, because the border of a view cuts bodies off.
_CUT_OFF_STD_M: Final = 0.1
_UP_CAMERA: Final = np.array([0.0, -1.0, 0.0])
_LEAST_AHEAD: Final = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class SeenInView:
    """An observation and the view that it comes from.

    Attributes:
        observation: the observation in the camera frame; its box is in pixels of the view.
        view: index of the view.
        row: index among the observations of the view.
    """

    observation: PersonObservation
    view: int
    row: int


def merge_views(
    views: Sequence[FlatView],
    seen: Sequence[Sequence[PersonObservation]],
    up_camera: FloatArray = _UP_CAMERA,
) -> tuple[SeenInView, ...]:
    """Merge the observations of several views of one instant, so that each person occurs once.

    A person in the overlap of two views appears in both. Two observations are of the same person if
    they come from different views, lie within 1 m of each other, and are no farther apart than
    their covariances explain. The nearest pairs are formed first, and an observation pairs with at
    most one of each other view. Of a pair, the observation nearer to the axis of its view is kept,
    because there the border cuts off less of the body. Observations of one view are never merged
    with each other.

    Args:
        views: V views of one camera.
        seen: observations of each view, in the view's optical frame.
        up_camera: (3,) direction up in the camera frame; default against its y axis.

    Returns:
        The merged observations in the camera frame.

    Raises:
        PerceptionError: if there is not one list of observations per view.
    """
    if len(seen) != len(views):
        raise PerceptionError(
            f"seen must hold one list of observations per view ({len(views)}), got {len(seen)}"
        )
    level = _level_axes(up_camera)
    entries = [
        SeenInView(view.in_camera(observation), number, row)
        for number, (view, rows) in enumerate(zip(views, seen, strict=True))
        for row, observation in enumerate(rows)
    ]
    pairs = sorted(
        (distance_m, one, other)
        for one, first in enumerate(entries)
        for other in range(one + 1, len(entries))
        if first.view != entries[other].view
        and (
            distance_m := _distance_if_same_m(first.observation, entries[other].observation, level)
        )
        is not None
    )
    dropped: set[int] = set()
    paired: set[tuple[int, int]] = set()
    for _, one, other in pairs:
        first, second = entries[one], entries[other]
        taken = (one, second.view) in paired or (other, first.view) in paired
        if taken or one in dropped or other in dropped:
            continue
        paired |= {(one, second.view), (other, first.view)}
        off_rad = [
            _off_axis_rad(entry.observation, views[entry.view], level) for entry in (first, second)
        ]
        dropped.add(other if off_rad[0] <= off_rad[1] else one)
    return tuple(entry for index, entry in enumerate(entries) if index not in dropped)


def _level_axes(up_camera: FloatArray) -> FloatArray:
    """Return two axes (2, 3) across the direction up; x and z of a level camera."""
    ahead = np.array([0.0, 0.0, 1.0]) - up_camera[2] * up_camera
    if (length := float(np.linalg.norm(ahead))) < _LEAST_AHEAD:  # the camera looks up or down
        ahead, length = np.array([0.0, -1.0, 0.0]) + up_camera[1] * up_camera, 1.0
    ahead = ahead / length
    return np.array([np.cross(ahead, up_camera), ahead])


def _distance_if_same_m(
    first: PersonObservation, second: PersonObservation, level: FloatArray
) -> float | None:
    """Return the horizontal distance of two observations; None if they are of two people."""
    difference = level @ (second.position_camera_m - first.position_camera_m)
    distance_m = float(np.hypot(*difference))
    if distance_m > _SAME_WITHIN_M:
        return None
    both = first.position_covariance_m2 + second.position_covariance_m2
    spread = level @ both @ level.T + _CUT_OFF_STD_M**2 * np.eye(2)
    chi2 = float(mahalanobis2(difference, spread))
    return distance_m if chi2 <= CHI2_999 else None


def _off_axis_rad(observation: PersonObservation, view: FlatView, level: FloatArray) -> float:
    """Return the horizontal angle between the axis of the view and an observation."""
    (x, z), (right, ahead) = (
        (level @ each).tolist()
        for each in (observation.position_camera_m, view.rotation_camera_view[:, 2])
    )
    return abs(math.atan2(x * ahead - z * right, x * right + z * ahead))


class SurroundPipeline:
    """An :class:`~perception.AwarenessPipeline` for a lens with a wider view than a pinhole.

    Args:
        lens: lens of the camera.
        views: flat views to cut from an image, for example from :func:`ring_of_views`.
        make_pipeline: makes the pipeline for the camera of a view; default one with the shipped
            networks. It is called once for each camera object; the views with that camera share its
            networks (:meth:`~perception.AwarenessPipeline.for_another_view`). Points of the robot,
            and a constant floor, are those of the lens's camera frame.

    Raises:
        PerceptionError: without views, or from ``make_pipeline``.
    """

    def __init__(
        self,
        lens: WideLens,
        views: Sequence[FlatView],
        make_pipeline: Callable[[Camera], AwarenessPipeline] = AwarenessPipeline,
    ) -> None:
        if not views:
            raise PerceptionError("views must hold at least one view, got none")
        self.lens = lens
        self.views = tuple(views)
        cameras = {id(view.camera): view.camera for view in self.views}
        made = {key: make_pipeline(camera) for key, camera in cameras.items()}
        # A pipeline keeps people from one image of its view to the next.
        self._pipelines = [
            made[id(view.camera)].for_another_view(view.rotation_camera_view) for view in self.views
        ]
        self._maps = [
            # Fixed-point maps make cv2.remap several times faster.
            cv2.convertMaps(*view.sampling_maps(lens), cv2.CV_16SC2)
            for view in self.views
        ]
        self._wraps = isinstance(lens, PanoramaLens)

    def flat_pictures(self, image_rgb: ImageRgb) -> tuple[ImageRgb, ...]:
        """Return the flat views of an image (H, W, 3); black where the lens does not see.

        Raises:
            PerceptionError: for an image of another size or type.
        """
        check_image(image_rgb, self.lens.height_px, self.lens.width_px)
        border = cv2.BORDER_WRAP if self._wraps else cv2.BORDER_CONSTANT
        return tuple(
            np.asarray(cv2.remap(image_rgb, *maps, cv2.INTER_LINEAR, borderMode=border))
            for maps in self._maps
        )

    def process(
        self,
        image_rgb: ImageRgb,
        stamp_s: float,
        floor: FloorPlane | None = None,
        *,
        up_camera: Any | None = None,
    ) -> tuple[PersonObservation, ...]:
        """Return one observation per person, in the camera frame, without keypoints.

        Boxes are in pixels of the lens's image. The box is None for a person across the seam of a
        panorama. Each view is turned upright as :meth:`AwarenessPipeline.process` does it.

        Args:
            image_rgb: (H, W, 3) uint8 of the lens's size.
            stamp_s: time of the frame.
            floor: the floor in the camera frame, if it is known.
            up_camera: direction up in the camera frame, if the floor is not known.

        Raises:
            PerceptionError: as :meth:`AwarenessPipeline.process`.
        """
        up = None if floor is None else floor.normal_camera
        if up_camera is not None:
            up = unit_vector("up_camera", up_camera)
        seen = [
            pipeline.process(
                flat,
                stamp_s,
                None if floor is None else floor.in_view(view.rotation_camera_view),
                up_camera=None if up is None else up @ view.rotation_camera_view,
            )
            for flat, pipeline, view in zip(
                self.flat_pictures(image_rgb), self._pipelines, self.views, strict=True
            )
        ]
        merged = merge_views(self.views, seen, _UP_CAMERA if up is None else up)
        return tuple(self._with_lens_box(each) for each in merged)

    def _with_lens_box(self, seen: SeenInView) -> PersonObservation:
        """Return the observation with its box in pixels of the lens's image."""
        box = seen.observation.box_xyxy_px
        if box is not None:
            box = self.views[seen.view].box_in(self.lens, box)
        return replace(seen.observation, box_xyxy_px=box, keypoints=None)
