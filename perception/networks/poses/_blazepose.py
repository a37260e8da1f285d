"""A pose estimator that runs BlazePose (MediaPipe Pose) from a TFLite file.

Contract of ``pose_landmarks_detector.tflite``: input (1, 256, 256, 3) float32 RGB in [0, 1], a
square about one person; outputs (1, 195), of which 39 points are x, y, z in pixels of the input and
the logits of visibility and presence; (1, 1), the probability of a person; (1, 117), the same
points in metres from the mid-hip. The first 33 points are the body's. Masks and heat maps are not
read.

Source: Bazarevsky et al., "BlazePose: On-device Real-time Body Pose tracking", 2020; MediaPipe,
``mediapipe/modules/pose_landmark/tensors_to_pose_landmarks_and_segmentation.pbtxt``.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy.special import expit

from ..._stages import PersonDetection, PersonKeypoints
from ...arrays import FloatArray, ImageRgb
from ...errors import PerceptionError
from ...ownership import iou
from .._images import rgb_image
from .._settings import OnnxSettings
from .._tflite import TfliteModel
from ._crops import PersonCrops

# BlazePose's point of each COCO keypoint.
_POINTS: Final = (0, 2, 5, 7, 8, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28)
_COUNT: Final = 39
_SIDE_PX: Final = 256
# Extents of the outputs that are read, in the order: points, person, metres.
_OUTPUTS: Final = (5 * _COUNT, 1, 3 * _COUNT)
# The square about a person, in sides of their box: the best of 1.0 to 1.8 on labelled photographs.
_PADDING: Final = 1.4
# Smallest probability of a person in a box; MediaPipe's own limit.
_PERSON: Final = 0.5
# Where it finds nobody, it is asked again: with a closer square, then about the upper part of the
# box, since shelves hide legs and boxes of people who sit or bend are wide.
_CLOSER: Final = 1.15
_UPPER_SHARE: Final = 0.55
# A box that the image cuts at its top or bottom shows a part of a person. The network would fit a
# whole body into it, so its height becomes so many widths; from there two further points lead to
# the whole person: the mid-hip and one on a circle about the body. A second run begins from them
# where its square shares less than this of both with the first one (IoU): else it is no better
# (0.22 and 0.22 shoulder widths on 42 renders).
_WHOLE_HEIGHT: Final = 3.0
_BORDER_PX: Final = 3.0
_HIP, _CIRCLE = 33, 34
_CIRCLE_PADDING: Final = 1.25
_SAME_SQUARE: Final = 0.7


class BlazePoseEstimator:
    """Keypoints of detected people by BlazePose; the contract is in the module's text.

    Each person is processed alone and each frame by itself. All scores are 0 for a person whom the
    network does not find in the box.

    The scores of a head's keypoints stay near 1 on backs of heads, so ``face_evidence`` is False:
    :class:`~perception.networks.FaceMeshPoseEstimator` adds it.

    Args:
        path: the TFLite file, its bytes, or a loaded model.
        settings: threads, for a model that is not loaded yet.

    Raises:
        PerceptionError: for a file that cannot be loaded, and for another layout.
    """

    def __init__(self, path: Any, *, settings: OnnxSettings | None = None) -> None:
        self.model = path if isinstance(path, TfliteModel) else TfliteModel(path, settings=settings)
        image = self.model.inputs[0]
        ends = {tensor.shape: tensor.name for tensor in self.model.outputs}
        self._names = [ends.get((1, extent)) for extent in _OUTPUTS]
        if (
            image.shape != (1, _SIDE_PX, _SIDE_PX, 3)
            or image.dtype != "float32"
            or None in self._names
        ):
            raise PerceptionError(
                f"{self.model.name} is not a BlazePose network: found {self.model.layout}; known: "
                f"(1, 256, 256, 3) float32 -> {', '.join(f'(1, {extent})' for extent in _OUTPUTS)}"
            )

    def __repr__(self) -> str:
        return f"BlazePoseEstimator({self.model.name})"

    def estimate(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return one set of COCO keypoints per detection, in the same order.

        ``keypoints_root_m`` are in metres from the mid-hip, in the axes of a camera that looks
        straight at the person.

        Args:
            image_rgb: (H, W, 3) uint8 of any size.
            detections: people; box coordinates count from the image's corner.

        Raises:
            PerceptionError: for an image of another type or shape, and when the network fails.
        """
        image = rgb_image(image_rgb)
        return tuple(self._person(image, each.box_xyxy_px) for each in detections)

    def _person(self, image: ImageRgb, box: FloatArray) -> PersonKeypoints:
        whole, cut = _whole_box(box, image.shape[0])
        found = self._run(image, whole, _PADDING)
        if found is None:
            left, top, right, bottom = whole.tolist()
            upper = np.array([left, top, right, top + _UPPER_SHARE * (bottom - top)])
            found = self._run(image, whole, _CLOSER) or self._run(image, upper, _PADDING)
        elif cut:
            points, *_ = found
            radius = float(np.linalg.norm(points[_CIRCLE, :2] - points[_HIP, :2]))
            middle = points[_HIP, :2] + 0.5
            again = np.concatenate([middle - radius, middle + radius])
            squares = _square(whole, _PADDING), _square(again, _CIRCLE_PADDING)
            if iou(*squares) < _SAME_SQUARE:
                found = self._run(image, again, _CIRCLE_PADDING)
        if found is None:
            return _unseen(box)
        points, root_m = (each[list(_POINTS)] for each in found)
        pixels = points[:, :2]
        scores = expit(points[:, 3:].min(axis=1))
        extent = np.array([image.shape[1], image.shape[0]])
        scores[((pixels < -0.5) | (pixels > extent - 0.5)).any(axis=1)] = 0.0
        return PersonKeypoints(pixels, root_m, scores, "coco", face_evidence=False)

    def _run(
        self, image: ImageRgb, box: FloatArray, padding: float
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return points (39, 5), u and v in the image, and metres (39, 3); None if nobody is."""
        crops = PersonCrops(box, _SIDE_PX, _SIDE_PX, padding)
        if not crops.inside(image)[0]:
            return None
        crop = np.empty((_SIDE_PX, _SIDE_PX, 3), np.uint8)
        crops.cut(image, 0, crop)
        outputs = self.model.run(crop[None].astype(np.float32) / np.float32(255.0))
        numbers, person, metres = (outputs[str(name)].ravel() for name in self._names)
        points = numbers.reshape(_COUNT, 5).astype(np.float64)
        root_m = metres.reshape(_COUNT, 3).astype(np.float64)
        if not (person[0] >= _PERSON and np.isfinite(points).all() and np.isfinite(root_m).all()):
            return None
        # The network counts from the crop's corner, keypoints from the middle of the first pixel.
        points[:, :2] = crops.to_image(points[None, :, :2] - 0.5, np.array([0]))[0]
        return points, root_m


def _whole_box(box: FloatArray, height_px: int) -> tuple[FloatArray, bool]:
    """Return the box of a whole person, and whether the image cuts the given one."""
    left, top, right, bottom = box.tolist()
    height = max(_WHOLE_HEIGHT * (right - left), bottom - top)
    if bottom >= height_px - _BORDER_PX:
        return np.array([left, top, right, top + height]), True
    if top <= _BORDER_PX:
        return np.array([left, bottom - height, right, bottom]), True
    return box, False


def _square(box: FloatArray, padding: float) -> FloatArray:
    """Return the square (4,) about a box that is as large as its larger side, padded."""
    middle, half = 0.5 * (box[:2] + box[2:]), 0.5 * padding * float((box[2:] - box[:2]).max())
    return np.concatenate([middle - half, middle + half])


def _unseen(box: FloatArray) -> PersonKeypoints:
    """Return keypoints in the middle of a box, none of which is seen."""
    count = len(_POINTS)
    return PersonKeypoints(
        np.tile(0.5 * (box[:2] + box[2:]) - 0.5, (count, 1)),
        np.zeros((count, 3)),
        np.zeros(count),
        "coco",
        face_evidence=False,
    )
