"""Head poses from a network on a crop about each head."""

from __future__ import annotations

import os
from typing import Final

import numpy as np

from ..._camera import Camera
from ..._head_pose import HeadPose
from ..._keypoints import PersonKeypoints
from ..._manifest import HEAD
from ..._metric_scale import DEFAULT_MIN_SCORE
from ..._pose_refinement import skew
from ...anthropometry import HEAD_CENTRE_HEAD_M, HEAD_TEMPLATE_M
from ...arrays import FloatArray, ImageRgb, finite_number
from ...errors import PerceptionError
from .._image import rgb_image
from .._session import OnnxModel, OnnxSettings, as_onnx_model
from ._crops import HeadCrops
from ._layouts import HeadOutputs, read_outputs, read_rows, recognise, where_it_is
from ._place import locate_heads

# A crop of fewer pixels shows nothing of a head.
_MIN_SIDE_PX: Final = 8.0
# A crop as near as this to where the network would have it is not cut again.
_CENTRED: Final = 0.03
_SIZED: Final = 0.08
# No network knows a direction or a distance better than this.
_MIN_ROTATION_STD_RAD: Final = float(np.radians(0.5))
_MIN_LOG_STD: Final = 0.01
_MAX_ROTATION_STD_RAD: Final = float(np.radians(100.0))
_IDENTITY: Final = np.eye(3)
_MOST_TURN: Final = _MAX_ROTATION_STD_RAD**2 * _IDENTITY
# What a network without keypoints leaves open of the head's centre, and of its distance when the
# body's scale alone says it.
_CENTRE_STD_M: Final = 0.04
_BODY_LOG_STD: Final = 0.12
_MAX_PASSES: Final = 5


class OnnxHeadPoseEstimator:
    """A network that sees a crop about each head: where it points and how far away it is.

    The head is found from the keypoints of whichever pose model runs (head, else shoulders); the
    crops of all people of a frame form one batch where the graph allows. Own networks say where the
    head's centre lies in the crop and how large the crop is, so a second pass cuts it better.
    Networks of the 6DRepNet kind (224 × 224, a rotation matrix or six numbers) give a rotation
    only; their pose carries a fixed covariance of 10° an axis, and the body's scale for distance.

    Args:
        path: the ONNX file, its bytes or a loaded :class:`OnnxModel`; None for the shipped
            network. A layout that is not known is refused.
        settings: providers and threads for a model that is not loaded yet.
        sha256: what its content must hash to.
        passes: how often a crop is cut, 1 to 5; a crop that is centred already is not cut again.
        min_score: keypoints scored below this are not used to find the head.
        min_head: crops that hold a head with a probability below this give no pose.
    """

    def __init__(
        self,
        path: OnnxModel | str | os.PathLike[str] | bytes | None = None,
        *,
        settings: OnnxSettings | None = None,
        sha256: str | None = None,
        passes: int = 2,
        min_score: float = DEFAULT_MIN_SCORE,
        min_head: float = 0.5,
    ) -> None:
        if isinstance(passes, bool) or passes not in range(1, _MAX_PASSES + 1):
            raise PerceptionError(
                f"passes must be a whole number from 1 to {_MAX_PASSES}, got {passes!r}"
            )
        self._passes = passes
        self._min_score = finite_number("min_score", min_score, minimum=0.0, maximum=1.0)
        self._min_head = finite_number("min_head", min_head, minimum=0.0, maximum=1.0)
        if path is None:
            path = OnnxModel.shipped(HEAD, settings)
            settings = None
        self.model = as_onnx_model(path, settings, sha256)
        self.layout = recognise(self.model)

    def estimate(
        self, image_rgb: ImageRgb, camera: Camera, people: tuple[PersonKeypoints, ...]
    ) -> tuple[HeadPose | None, ...]:
        """Return one head pose a person, or None where no head is found or none is in the crop.

        Args:
            image_rgb: (H, W, 3) uint8.
            camera: that took it.
            people: keypoints of each person.

        Raises:
            PerceptionError: for a bad image, and when the network fails or returns no numbers.
        """
        image = rgb_image(image_rgb)
        found = locate_heads(people, self._min_score)
        rows = [
            row
            for row, place in enumerate(found)
            if place is not None and self._worth_a_look(place, image.shape)
        ]
        poses: list[HeadPose | None] = [None] * len(people)
        if not rows:
            return tuple(poses)
        places = [place for place in (found[row] for row in rows) if place is not None]
        size_px = self.layout.crop_side_m * np.array([place[1] for place in places])
        answers, crops = self._look(
            image, HeadCrops.of_sizes(camera, np.array([place[0] for place in places]), size_px)
        )
        outputs = read_outputs(self.layout, self.model, answers)
        made = _poses(outputs, crops, self.layout.crop_side_m)
        for index, row in enumerate(rows):
            if outputs.head is None or outputs.head[index] >= self._min_head:
                poses[row] = made[index]
        return tuple(poses)

    def _worth_a_look(self, place: tuple[FloatArray, float], shape: tuple[int, ...]) -> bool:
        side = self.layout.crop_side_m * place[1]
        reach = 0.5 * side
        u, v = place[0].tolist()
        inside = -reach < u < shape[1] + reach and -reach < v < shape[0] + reach
        return bool(inside and side >= _MIN_SIDE_PX)

    def _look(self, image: ImageRgb, crops: HeadCrops) -> tuple[FloatArray, HeadCrops]:
        """What the network said in the last pass, with the crops that it belongs to."""
        answers = self._run(image, crops)
        for _ in range(self._passes - 1 if self.layout.own else 0):
            centre, side_m, head = where_it_is(answers)
            larger = side_m / self.layout.crop_side_m
            off = np.abs(centre - 0.5).max(axis=1) > _CENTRED
            off |= np.abs(np.log(larger)) > _SIZED
            again = (off & (head >= 0.5 * self._min_head)).nonzero()[0]
            if not len(again):
                break
            # A wild answer must not end in a crop of the whole picture or of one pixel.
            factor = 1.0 / np.minimum(np.maximum(larger[again], 0.5), 2.0)
            crops = crops.moved(again, centre[again], factor)
            answers[again] = self._run(image, crops.only(again))
        return answers, crops

    def _run(self, image: ImageRgb, crops: HeadCrops) -> FloatArray:
        layout, size, count = self.layout, self.layout.size_px, len(crops.side_px)
        blob = layout.pixels.blob(count, size, size)
        for row in range(count):
            layout.pixels.write(crops.cut(image, row, size), blob[row])
        blob = layout.pixels.fed(blob)
        name, step = self.model.inputs[0].name, layout.batch or count
        parts = []
        for start in range(0, count, step):
            part = blob[start : start + step]
            short = step - len(part)
            if short:
                part = np.concatenate([part, np.zeros((short, *part.shape[1:]), part.dtype)])
            results = self.model.run({name: part})
            parts.append([result[: step - short] for result in results])
        arrays = [
            np.concatenate(rows) if len(rows) > 1 else rows[0] for rows in zip(*parts, strict=True)
        ]
        if any(len(array) != count for array in arrays):
            raise PerceptionError(
                f"{self.model.name} must return one result a crop ({count}), got "
                f"{[len(array) for array in arrays]}"
            )
        return read_rows(layout, self.model, arrays)


def _poses(outputs: HeadOutputs, crops: HeadCrops, crop_side_m: float) -> list[HeadPose | None]:
    """Head poses in the camera frame from what the network said of each crop.

    The crop's side in metres and in radians, as seen along its ray, gives the distance of the
    head's centre C; the nose is C less the rotated arm from nose to C, whose turning couples the
    two halves of the covariance.
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
    # Turning moves rotation and nose together; distance and place in the crop move the nose alone.
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


def _is_usable(turn: FloatArray) -> bool:
    """Whether a covariance (3, 3) is one and no standard deviation exceeds what makes sense."""
    return _is_positive(turn.tolist()) and _is_positive((_MOST_TURN - turn).tolist())


def _is_positive(matrix: list[list[float]]) -> bool:
    """Whether a symmetric (3, 3) matrix is positive definite, by Sylvester's criterion."""
    (a, b, c), (_, e, f), (_, _, i) = matrix
    minor = a * e - b * b
    return a > 0.0 and minor > 0.0 and i * minor - a * f * f + c * (2.0 * b * f - c * e) > 0.0


def _face_seen(outputs: HeadOutputs, row: int) -> float | None:
    """Probability that there is a head and at least two of nose and eyes are visible."""
    if outputs.visible is None or outputs.head is None:
        return None
    a, b, c = outputs.visible[row, :3].tolist()
    two: float = (a * b + a * c + b * c - 2.0 * a * b * c) * float(outputs.head[row])
    return min(max(two, 0.0), 1.0)


def _reprojection(
    outputs: HeadOutputs, crops: HeadCrops, rotation: FloatArray, nose: FloatArray
) -> FloatArray:
    """(N,) root mean square distance of the visible keypoints from the template's.

    In pixels of the camera turned to each head, as which the crop shows it.
    """
    count = len(nose)
    if outputs.keypoints is None or outputs.visible is None:
        return np.zeros(count)
    points = HEAD_TEMPLATE_M @ rotation.swapaxes(1, 2) + nose[:, None]
    turned = points @ crops.axes
    depth = turned[:, :, 2:]
    seen = outputs.visible >= 0.5
    # A template point behind the camera has no image, and no error.
    seen &= depth[:, :, 0] > 0.0
    expected = crops.focal_px * turned[:, :, :2] / np.where(depth > 0.0, depth, 1.0)
    found = (outputs.keypoints - 0.5) * crops.side_px[:, None, None]
    away = np.where(seen[:, :, None], expected - found, 0.0).reshape(count, 10)
    return np.asarray(np.sqrt((away * away).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)))
