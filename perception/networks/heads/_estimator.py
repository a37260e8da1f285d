"""A head pose estimator that runs a network on a crop around each head."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..._camera import Camera
from ..._manifest import HEAD
from ..._stages import HeadPose, PersonKeypoints
from ...anthropometry import HEAD_CENTRE_HEAD_M, HEAD_TEMPLATE_M
from ...arrays import FloatArray, ImageRgb, finite_number
from ...body import DEFAULT_MIN_SCORE
from ...errors import PerceptionError
from ...matrices import rotation_log, skew
from .._images import rgb_image, run_on_images
from .._model import ModelSource, OnnxModel, as_onnx_model
from .._settings import OnnxSettings
from ._crops import HeadCrops, uncertainty_factors
from ._locate import locate_heads
from ._outputs import (
    HeadOutputs,
    read_outputs,
    read_placement,
    read_rotations,
    read_rows,
    recognise,
)

# A smaller crop shows nothing of a head.
_MIN_SIDE_PX: Final = 8.0
# A crop is cut again if the network places the head's centre farther than this from the crop's
# centre (in sides of the crop), or if its size is off by more than this factor (logarithm).
_MAX_OFFSET: Final = 0.03
_MAX_LOG_FACTOR: Final = 0.08
# Smallest standard deviations of the direction and of the logarithm of the distance.
_MIN_ROTATION_STD_RAD: Final = float(np.radians(0.5))
_MIN_LOG_STD: Final = 0.01
# A head whose direction is less certain than this gets no pose.
_MAX_ROTATION_STD_RAD: Final = float(np.radians(100.0))
_IDENTITY: Final = np.eye(3)
_MAX_ROTATION_COVARIANCE: Final = _MAX_ROTATION_STD_RAD**2 * _IDENTITY
# For a network that gives a rotation only: standard deviation of the head's centre, and of the
# logarithm of its distance, which then comes from the body's scale.
_CENTRE_STD_M: Final = 0.04
_BODY_LOG_STD: Final = 0.12
# A crop with a lower probability of a head gives no pose.
_MIN_HEAD: Final = 0.5


class OnnxHeadPoseEstimator:
    """A network that gives direction and distance of each head, from a crop around it.

    The keypoints of the pose estimator (head, else shoulders) tell where the head is. The crops of
    all people of a frame form one batch if the network's batch axis is free. A network of
    awarenav's layout gives the head's centre in the crop and the size of the crop, so a second pass
    cuts the crop better. What the two see differently joins the covariance: a network knows little
    of the errors that blur and compression cause, but they differ from crop to crop. The covariance
    also grows with the blur that the crop shows. A network of
    the 6DRepNet kind (224 × 224, a rotation matrix or six numbers) gives a rotation only: its pose
    has a fixed standard deviation of 10° per axis, and the distance comes from the body's scale.

    Args:
        path: the ONNX file, its bytes, or a loaded :class:`~perception.networks.OnnxModel`; None
            for the shipped network.
        settings: providers and threads, for a model that is not loaded yet.
        min_score: keypoints with a lower score are not used to find the head.

    Raises:
        PerceptionError: for a file that cannot be loaded, an unknown layout (the message says what
            was found and what is known), and an invalid value.
    """

    # A crop is cut at most so often; one that is centred is not cut again.
    _passes = 2

    def __init__(
        self,
        path: ModelSource | None = None,
        *,
        settings: OnnxSettings | None = None,
        min_score: float = DEFAULT_MIN_SCORE,
    ) -> None:
        self._min_score = finite_number("min_score", min_score, minimum=0.0, maximum=1.0)
        if path is None:
            path = OnnxModel.shipped(HEAD, settings)
            settings = None
        self.model = as_onnx_model(path, settings)
        self.layout = recognise(self.model)

    def estimate(
        self, image_rgb: ImageRgb, camera: Camera, people: tuple[PersonKeypoints, ...]
    ) -> tuple[HeadPose | None, ...]:
        """Return one head pose per person; None where no head is found.

        Args:
            image_rgb: (H, W, 3) uint8.
            camera: camera of the image.
            people: keypoints of each person.

        Raises:
            PerceptionError: for an image of another type or shape, and when the network fails or
                returns non-finite numbers.
        """
        image = rgb_image(image_rgb)
        found = locate_heads(people, self._min_score)
        rows = [
            row
            for row, place in enumerate(found)
            if place is not None and self._is_visible(place, image.shape)
        ]
        poses: list[HeadPose | None] = [None] * len(people)
        if not rows:
            return tuple(poses)
        places = [place for place in (found[row] for row in rows) if place is not None]
        size_px = self.layout.crop_side_m * np.array([place[1] for place in places])
        crops = HeadCrops.of_sizes(camera, np.array([place[0] for place in places]), size_px)
        output_rows, crops, pictures, scatter = self._run_passes(image, crops)
        outputs = read_outputs(self.layout, self.model, output_rows)
        covariance = outputs.covariance_ray + scatter
        if self.layout.is_awarenav:
            covariance *= (uncertainty_factors(pictures) ** 2)[:, None, None]
        outputs = replace(outputs, covariance_ray=covariance)
        found_poses = _poses(outputs, crops, self.layout.crop_side_m)
        for index, row in enumerate(rows):
            if outputs.head is None or outputs.head[index] >= _MIN_HEAD:
                poses[row] = found_poses[index]
        return tuple(poses)

    def _is_visible(self, place: tuple[FloatArray, float], shape: tuple[int, ...]) -> bool:
        """Return True for a head whose crop overlaps the image and is large enough."""
        side = self.layout.crop_side_m * place[1]
        reach = 0.5 * side
        u, v = place[0].tolist()
        inside = -reach < u < shape[1] + reach and -reach < v < shape[0] + reach
        return bool(inside and side >= _MIN_SIDE_PX)

    def _run_passes(
        self, image: ImageRgb, crops: HeadCrops
    ) -> tuple[FloatArray, HeadCrops, list[NDArray[np.uint8]], FloatArray]:
        """Return the network's rows for the last crop of each head, and what belongs to them.

        Returns:
            The rows; the crops; their pictures; the scatter (N, 3, 3) of the last two crops'
            rotations, in ray axes: the covariance of one of them if their errors are independent,
            and 0 for a head that was cut once.
        """
        size = self.layout.size_px
        pictures = [crops.cut(image, row, size) for row in range(len(crops.side_px))]
        rows = self._run(pictures)
        scatter = np.zeros((len(rows), 3, 3))
        for _ in range(self._passes - 1 if self.layout.is_awarenav else 0):
            centre, side_m, head = read_placement(rows)
            larger = side_m / self.layout.crop_side_m
            off = np.abs(centre - 0.5).max(axis=1) > _MAX_OFFSET
            off |= np.abs(np.log(larger)) > _MAX_LOG_FACTOR
            again = (off & (head >= 0.5 * _MIN_HEAD)).nonzero()[0]
            if not len(again):
                break
            before = crops.axes[again] @ read_rotations(self.model, rows[again])
            # The limits keep a wrong output from leading to a crop of the whole image or one pixel.
            factor = 1.0 / np.minimum(np.maximum(larger[again], 0.5), 2.0)
            crops = crops.recentred(again, centre[again], factor)
            for row in again:
                pictures[row] = crops.cut(image, row, size)
            rows[again] = self._run([pictures[row] for row in again])
            now = read_rotations(self.model, rows[again])
            turn = rotation_log(crops.axes[again].swapaxes(1, 2) @ before @ now.swapaxes(1, 2))
            scatter[again] = 0.5 * turn[:, :, None] * turn[:, None, :]
        return rows, crops, pictures, scatter

    def _run(self, pictures: Sequence[NDArray[np.uint8]]) -> FloatArray:
        """Return the network's row of outputs for each crop's picture."""
        layout, size, count = self.layout, self.layout.size_px, len(pictures)
        blob = layout.pixels.empty_blob(count, size, size)
        for row, picture in enumerate(pictures):
            layout.pixels.write(picture, blob[row])
        blob = layout.pixels.as_input(blob)
        step = layout.batch or count
        parts = []
        for start in range(0, count, step):
            part = blob[start : start + step]
            missing = step - len(part)
            if missing:
                part = np.concatenate([part, np.zeros((missing, *part.shape[1:]), part.dtype)])
            results = run_on_images(self.model, part)
            parts.append([result[: step - missing] for result in results])
        arrays = [
            np.concatenate(rows) if len(rows) > 1 else rows[0] for rows in zip(*parts, strict=True)
        ]
        if any(len(array) != count for array in arrays):
            raise PerceptionError(
                f"{self.model.name} must return one result per crop ({count}), got "
                f"{[len(array) for array in arrays]}"
            )
        return read_rows(layout, self.model, arrays)


def _poses(outputs: HeadOutputs, crops: HeadCrops, crop_side_m: float) -> list[HeadPose | None]:
    """Return head poses in the camera frame from the network's outputs for each crop.

    The crop's side in metres and as an angle along its ray gives the distance of the head's centre
    C. The nose lies at C minus the rotated arm from nose to C, so an error of the rotation also
    moves the nose: the covariance couples both.
    """
    axes, side_px = crops.axes, crops.side_px
    count = len(side_px)
    side_m = np.full(count, crop_side_m) if outputs.side_m is None else outputs.side_m
    log_std = (
        np.full(count, _BODY_LOG_STD)
        if outputs.side_log_std is None
        else np.maximum(outputs.side_log_std, _MIN_LOG_STD)
    )
    across_m = (
        np.full(count, _CENTRE_STD_M)
        if outputs.keypoints_std is None
        else outputs.keypoints_std.sum(axis=1) * (side_m / 5.0)
    )
    rotation = axes @ outputs.rotation_ray_head
    turn = outputs.covariance_ray + _MIN_ROTATION_STD_RAD**2 * _IDENTITY
    tangent = side_px / crops.focal_px
    along_ray = np.ones((count, 3))
    along_ray[:, :2] = 0.0 if outputs.centre is None else (outputs.centre - 0.5) * tangent[:, None]
    along_ray *= (side_m / tangent)[:, None]
    centre = (axes @ along_ray[:, :, None])[:, :, 0]
    arm = rotation @ HEAD_CENTRE_HEAD_M
    nose = centre - arm
    # A rotation error changes rotation and nose; errors of distance and centre change the nose.
    moves = np.empty((count, 6, 3))
    moves[:, :3] = axes
    moves[:, 3:] = skew(arm) @ axes
    covariance = moves @ turn @ moves.swapaxes(1, 2)
    along = log_std[:, None] * centre
    covariance[:, 3:, 3:] += (
        along[:, :, None] * along[:, None] + (across_m**2)[:, None, None] * _IDENTITY
    )
    covariance = 0.5 * (covariance + covariance.swapaxes(1, 2))
    error_px = _reprojection(outputs, crops, rotation, nose).tolist()
    return [
        HeadPose(
            nose[row],
            rotation[row],
            covariance[row],
            error_px[row],
            face_seen=_face_seen(outputs, row),
            range_relative_std=None if outputs.side_m is None else float(log_std[row]),
        )
        if _is_usable(turn[row])
        else None
        for row in range(count)
    ]


def _is_usable(covariance: FloatArray) -> bool:
    """Return True for a positive definite (3, 3) covariance of at most 100° in any direction."""
    return _is_positive_definite(covariance.tolist()) and _is_positive_definite(
        (_MAX_ROTATION_COVARIANCE - covariance).tolist()
    )


def _is_positive_definite(matrix: list[list[float]]) -> bool:
    """Return True for a positive definite symmetric (3, 3) matrix, by Sylvester's criterion."""
    (a, b, c), (_, e, f), (_, _, i) = matrix
    minor = a * e - b * b
    return a > 0.0 and minor > 0.0 and i * minor - a * f * f + c * (2.0 * b * f - c * e) > 0.0


def _face_seen(outputs: HeadOutputs, row: int) -> float | None:
    """Return the probability of a head of which at least two of nose and eyes are visible."""
    if outputs.visible is None or outputs.head is None:
        return None
    a, b, c = outputs.visible[row, :3].tolist()
    two: float = (a * b + a * c + b * c - 2.0 * a * b * c) * float(outputs.head[row])
    return min(max(two, 0.0), 1.0)


def _reprojection(
    outputs: HeadOutputs, crops: HeadCrops, rotation: FloatArray, nose: FloatArray
) -> FloatArray:
    """Return (N,) root mean square distances between visible and template keypoints.

    They are in pixels of the camera turned towards each head, as in the crop.
    """
    count = len(nose)
    if outputs.keypoints is None or outputs.visible is None:
        return np.zeros(count)
    points = HEAD_TEMPLATE_M @ rotation.swapaxes(1, 2) + nose[:, None]
    turned = points @ crops.axes
    depth = turned[:, :, 2:]
    seen = outputs.visible >= 0.5
    # A template point behind the camera has no image, so it does not count.
    seen &= depth[:, :, 0] > 0.0
    expected = crops.focal_px * turned[:, :, :2] / np.where(depth > 0.0, depth, 1.0)
    found = (outputs.keypoints - 0.5) * crops.side_px[:, None, None]
    away = np.where(seen[:, :, None], expected - found, 0.0).reshape(count, 10)
    return np.asarray(np.sqrt((away * away).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)))
