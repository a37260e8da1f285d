"""Head poses from a network on a crop about each head."""

from __future__ import annotations

import os
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .._camera import Camera
from .._errors import PerceptionError
from .._head_pose import HEAD_CENTRE_HEAD_M, HeadPose
from .._keypoints import PersonKeypoints
from .._metric_scale import DEFAULT_MIN_SCORE
from .._pose_refinement import skew
from .._protocols import ImageRgb
from ..anthropometry import HEAD_TEMPLATE_M
from ..arrays import FloatArray, finite_number
from ._head_crop import crop_to_image, head_crop
from ._head_layouts import HeadOutputs, read_outputs, recognise
from ._head_place import locate_heads
from ._image import rgb_image
from ._session import OnnxModel, OnnxSettings, as_onnx_model

# A crop of fewer pixels shows nothing of a head.
_MIN_SIDE_PX: Final = 8.0
# A crop as near as this to where the network would have it is not cut again.
_CENTRED: Final = 0.03
_SIZED: Final = 0.08
# No network knows a direction or a distance better than this.
_MIN_ROTATION_STD_RAD: Final = float(np.radians(0.5))
_MIN_LOG_STD: Final = 0.01
_MAX_ROTATION_STD_RAD: Final = float(np.radians(100.0))
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
            from ..shipped import HEAD, load_shipped  # noqa: PLC0415 - only where it is wanted

            path = load_shipped(HEAD, settings)
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
        centre_px = np.array([place[0] for place in places])
        side_px = np.array([self.layout.crop_side_m * place[1] for place in places])
        outputs, centre_px, side_px = self._look(image, centre_px, side_px)
        made = _poses(camera, outputs, centre_px, side_px, self.layout.crop_side_m)
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

    def _look(
        self, image: ImageRgb, centre_px: FloatArray, side_px: FloatArray
    ) -> tuple[HeadOutputs, FloatArray, FloatArray]:
        """Outputs of the last pass with the crops that they belong to."""
        outputs = self._run(image, centre_px, side_px)
        for _ in range(self._passes - 1):
            if outputs.centre is None or outputs.side_m is None or outputs.head is None:
                break
            larger = outputs.side_m / self.layout.crop_side_m
            off = np.abs(outputs.centre - 0.5).max(axis=1) > _CENTRED
            off |= np.abs(np.log(larger)) > _SIZED
            again = np.flatnonzero(off & (outputs.head >= 0.5 * self._min_head))
            if not len(again):
                break
            centre_px, side_px = centre_px.copy(), side_px.copy()
            centre_px[again] = crop_to_image(
                outputs.centre[again], centre_px[again], side_px[again, None]
            )
            # A wild answer must not end in a crop of the whole picture or of one pixel.
            side_px[again] /= np.clip(larger[again], 0.5, 2.0)
            outputs = _replaced(outputs, again, self._run(image, centre_px[again], side_px[again]))
        return outputs, centre_px, side_px

    def _run(self, image: ImageRgb, centre_px: FloatArray, side_px: FloatArray) -> HeadOutputs:
        layout, size, count = self.layout, self.layout.size_px, len(centre_px)
        blob = layout.pixels.blob(count, size, size)
        for row in range(count):
            crop = head_crop(image, centre_px[row], float(side_px[row]), size)
            layout.pixels.write(crop, blob[row])
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
        return read_outputs(layout, self.model, arrays)


def _replaced(outputs: HeadOutputs, rows: NDArray[np.intp], new: HeadOutputs) -> HeadOutputs:
    """The outputs with those of some rows taken from another run."""
    fields = {}
    for name in HeadOutputs.__slots__:
        old_values, new_values = getattr(outputs, name), getattr(new, name)
        if old_values is not None:
            old_values = old_values.copy()
            old_values[rows] = new_values
        fields[name] = old_values
    return HeadOutputs(**fields)


def ray_axes(rays: FloatArray) -> FloatArray:
    """Rotations (N, 3, 3) from ray axes to the camera for rays (N, 2) given as x/z and y/z.

    The smallest rotation that takes the camera's z axis onto the ray: its third column is the ray.
    """
    unit = np.column_stack([rays, np.ones(len(rays))])
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    x, y, z = unit.T
    # Rodrigues with axis z × ray = (−y, x, 0) and cosine z.
    shared = 1.0 / (1.0 + z)
    return np.stack(
        [
            np.stack([1.0 - x * x * shared, -x * y * shared, x], axis=1),
            np.stack([-x * y * shared, 1.0 - y * y * shared, y], axis=1),
            np.stack([-x, -y, z], axis=1),
        ],
        axis=1,
    )


def _poses(
    camera: Camera,
    outputs: HeadOutputs,
    centre_px: FloatArray,
    side_px: FloatArray,
    crop_side_m: float,
) -> list[HeadPose | None]:
    """Head poses in the camera frame from what the network said of each crop.

    The crop's side in metres and, through the lens, in radians gives the depth of the head's centre
    C; the nose is C less the rotated arm from nose to C, whose turning couples the two halves of
    the covariance.
    """
    count = len(centre_px)
    half = 0.5 * side_px[:, None] * np.array([1.0, 0.0])
    middle = (
        centre_px
        if outputs.centre is None
        else crop_to_image(outputs.centre, centre_px, side_px[:, None])
    )
    looked = camera.normalise(np.concatenate([centre_px, middle, centre_px - half,
                                              centre_px + half, centre_px - half[:, ::-1],
                                              centre_px + half[:, ::-1]]))  # fmt: skip
    ray, towards, left, right, top, bottom = looked.reshape(6, count, 2)
    spread = 0.5 * (np.hypot(*(right - left).T) + np.hypot(*(bottom - top).T))
    side_m = np.full(count, crop_side_m) if outputs.side_m is None else outputs.side_m
    log_std = (
        np.full(count, _BODY_LOG_STD)
        if outputs.side_log_std is None
        else np.maximum(outputs.side_log_std, _MIN_LOG_STD)
    )
    across_m = (
        np.full(count, _CENTRE_STD_M)
        if outputs.keypoints_std is None
        else outputs.keypoints_std.mean(axis=1) * side_m
    )
    axes = ray_axes(ray)
    rotation = axes @ outputs.rotation_ray_head
    turn = axes @ outputs.covariance_ray @ np.swapaxes(axes, 1, 2)
    turn = turn + _MIN_ROTATION_STD_RAD**2 * np.eye(3)
    centre = (side_m / spread)[:, None] * np.column_stack([towards, np.ones(count)])
    arm = rotation @ HEAD_CENTRE_HEAD_M
    nose = centre - arm
    position = (log_std**2)[:, None, None] * (centre[:, :, None] * centre[:, None, :])
    position = position + (across_m**2)[:, None, None] * np.eye(3)
    lever = skew(arm)
    covariance = np.zeros((count, 6, 6))
    covariance[:, :3, :3] = turn
    covariance[:, :3, 3:] = turn @ np.swapaxes(lever, 1, 2)
    covariance[:, 3:, :3] = lever @ turn
    covariance[:, 3:, 3:] = lever @ turn @ np.swapaxes(lever, 1, 2) + position
    lowest, highest = np.linalg.eigvalsh(turn)[:, [0, -1]].T
    usable = (lowest > 0.0) & (highest <= _MAX_ROTATION_STD_RAD**2) & np.isfinite(spread)
    error_px = _reprojection(camera, outputs, centre_px, side_px, rotation, nose)
    return [
        HeadPose(
            nose[row],
            rotation[row],
            0.5 * (covariance[row] + covariance[row].T),
            float(error_px[row]),
            face_seen=_face_seen(outputs, row),
            range_relative_std=None if outputs.side_m is None else float(log_std[row]),
        )
        if usable[row]
        else None
        for row in range(count)
    ]


def _face_seen(outputs: HeadOutputs, row: int) -> float | None:
    """Probability that there is a head and at least two of nose and eyes are visible."""
    if outputs.visible is None or outputs.head is None:
        return None
    a, b, c = outputs.visible[row, :3].tolist()
    return float(np.clip((a * b + a * c + b * c - 2.0 * a * b * c) * outputs.head[row], 0.0, 1.0))


def _reprojection(
    camera: Camera,
    outputs: HeadOutputs,
    centre_px: FloatArray,
    side_px: FloatArray,
    rotation: FloatArray,
    nose: FloatArray,
) -> FloatArray:
    """(N,) root mean square distance of the visible keypoints from the template's, in pixels."""
    count = len(centre_px)
    if outputs.keypoints is None or outputs.visible is None:
        return np.zeros(count)
    points = HEAD_TEMPLATE_M @ np.swapaxes(rotation, 1, 2) + nose[:, None]
    expected = camera.project(points.reshape(-1, 3)).reshape(count, 5, 2)
    found = crop_to_image(outputs.keypoints, centre_px[:, None], side_px[:, None, None])
    seen = outputs.visible >= 0.5
    squared = np.where(seen, np.sum((expected - found) ** 2, axis=2), 0.0)
    return np.asarray(np.sqrt(np.nan_to_num(squared).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)))
