"""A pose estimator that runs SimCC networks and MoveNet: keypoints in the image and in metres."""

from __future__ import annotations

import threading
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..._stages import PersonDetection, PersonKeypoints
from ...arrays import FloatArray, ImageRgb
from ...errors import PerceptionError
from ...layouts import keypoint_count
from .._images import (
    IMAGENET_MEAN_RGB,
    IMAGENET_STD_RGB,
    PixelFormat,
    has_channels_last,
    input_batch,
    input_dtype,
    input_size,
    rgb_image,
    run_on_images,
)
from .._model import ModelSource, as_onnx_model
from .._settings import OnnxSettings
from ._crops import BOX_PADDING, PersonCrops
from ._layouts import PoseLayout, metadata_number
from ._lift import lift_keypoints
from ._movenet import MOVENET_DTYPES, RawPixels, recognise_movenet
from ._simcc import recognise_simcc

# Larger batches need more memory and are not faster per person.
_MAX_BATCH: Final = 16


class OnnxPoseEstimator:
    """A top-down pose network from an ONNX file: RTMPose, RTMW, RTMW3D, MoveNet or the shipped one.

    Keypoint positions of SimCC networks are refined between the bins; the score of a keypoint is
    the lower of its heights along x and y. A network with a third axis gives depths;
    :func:`~perception.networks.poses.lift_keypoints` describes how the skeleton becomes metric.
    Without a third axis, and from MoveNet, the skeleton is flat: every z is 0, and ``lifted`` is
    False.

    MoveNet, for one person: input (1, S, S, 3) int32, uint8 or float32, RGB from 0 to 255; output
    (1, 1, 17, 3), y, x and score of COCO's keypoints, y and x from 0 to 1 across the input
    (MoveNet.SinglePose model card, Google, 2021). It sees a square about each box, and takes the
    person who is nearest to its middle.

    The people of an image form one batch if the network's batch axis is free, else batches of the
    network's size. Several threads may share an estimator; their calls run one after another.

    Args:
        path: the ONNX file, its bytes, or a loaded :class:`~perception.networks.OnnxModel`.
        input_size_hw_px: (height, width) for a network that leaves its input size free.
        settings: providers and threads, for a model that is not loaded yet.

    Raises:
        PerceptionError: for a file that cannot be loaded, an unknown layout (the message says what
            was found and what is known), and an invalid value.
    """

    def __init__(
        self,
        path: ModelSource,
        *,
        input_size_hw_px: tuple[int, int] | None = None,
        settings: OnnxSettings | None = None,
    ) -> None:
        self.model = as_onnx_model(path, settings)
        self._padding = metadata_number(self.model, "box_padding", BOX_PADDING)
        # Data sets place keypoints differently on the body, so limbs differ in length.
        self._limb_scale = metadata_number(self.model, "limb_scale", 1.0)
        self._scale_std = metadata_number(self.model, "scale_relative_std", 0.0)
        self._channels_last = has_channels_last(self.model)
        self._pixels: PixelFormat | RawPixels
        if self._channels_last:
            batch = self.model.inputs[0].shape[0]
            self._pixels = RawPixels(input_dtype(self.model, MOVENET_DTYPES))
        else:
            batch = input_batch(self.model)
            dtype = input_dtype(self.model)
            self._pixels = PixelFormat(IMAGENET_MEAN_RGB, IMAGENET_STD_RGB, dtype=dtype)
        self.input_size_hw_px = input_size(self.model, input_size_hw_px, None)
        self._batch, self._always_full, self._layout = self._recognise(batch)
        self._crop = np.empty((*self.input_size_hw_px, 3), np.uint8)
        self._blob = self._pixels.empty_blob(1, *self.input_size_hw_px)
        self._lock = threading.Lock()

    def __repr__(self) -> str:
        return f"OnnxPoseEstimator({self.model.name}: {self.layout})"

    @property
    def layout(self) -> str:
        """Name of the keypoint layout: ``"coco"`` or ``"coco_wholebody"``."""
        return self._layout.keypoints

    @property
    def has_depth(self) -> bool:
        """True if the network gives depths; without them skeletons are flat."""
        return self._layout.has_depth

    def estimate(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return the keypoints of each detected person, in the same order.

        All scores are 0 for a person whose crop lies outside the image or whose box has no extent.
        The score of a keypoint is 0 if the network places it outside the image or at a non-finite
        position. Without detections the network does not run.

        Args:
            image_rgb: (H, W, 3) uint8 of any size.
            detections: people; box coordinates count from the image's corner.

        Raises:
            PerceptionError: for an image of another type or shape, and when the network fails.
        """
        image = rgb_image(image_rgb)
        if not detections:
            return ()
        boxes = np.array([detection.box_xyxy_px for detection in detections])
        crops = PersonCrops(boxes, *self.input_size_hw_px, self._padding)
        visible = crops.inside(image).nonzero()[0]
        size = keypoint_count(self.layout)
        # The keypoints of people outside the image lie in the middle of the box, with scores of 0.
        middle = 0.5 * (boxes[:, :2] + boxes[:, 2:]) - 0.5
        pixels = np.empty((len(boxes), size, 2))
        pixels[:] = middle[:, None]
        skeletons = np.zeros((len(boxes), size, 3))
        scores = np.zeros((len(boxes), size))
        if len(visible):
            with self._lock:
                outputs = self._run(image, crops, visible)
            pixels[visible], skeletons[visible], scores[visible] = self._decode(
                outputs, image, crops, visible
            )
        return tuple(
            PersonKeypoints(
                pixels[row],
                skeletons[row],
                scores[row],
                self.layout,
                lifted=self.has_depth,
                scale_relative_std=self._scale_std,
            )
            for row in range(len(boxes))
        )

    def _run(
        self, image: ImageRgb, crops: PersonCrops, rows: NDArray[np.intp]
    ) -> list[NDArray[Any]]:
        """Return the network's outputs for the crops ``rows``."""
        batches = []
        for start in range(0, len(rows), self._batch):
            batch = rows[start : start + self._batch]
            count = self._batch if self._always_full else len(batch)
            if len(self._blob) < count:
                self._blob = self._pixels.empty_blob(count, *self.input_size_hw_px)
            for place, row in enumerate(batch):
                crops.cut(image, int(row), self._crop)
                self._pixels.write(self._crop, self._blob[place])
            outputs = run_on_images(self.model, self._pixels.as_input(self._blob[:count]))
            batches.append([output[: len(batch)] for output in outputs])
        if len(batches) == 1:
            return batches[0]
        return [np.concatenate(parts) for parts in zip(*batches, strict=True)]

    def _decode(
        self,
        outputs: list[NDArray[Any]],
        image: ImageRgb,
        crops: PersonCrops,
        rows: NDArray[np.intp],
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return pixels (n, K, 2), skeletons (n, K, 3) and scores (n, K) of the crops ``rows``."""
        in_crop, depths, scores = self._layout.decode(outputs)
        pixels = crops.to_image(in_crop, rows)
        # Keypoints outside the image were guessed. The slack of one crop pixel allows for rounding.
        extent = np.array([image.shape[1], image.shape[0]])
        slack = 0.5 + crops.step_px[rows, None]
        shown = (pixels > -slack) & (pixels < extent - 1.0 + slack)
        scores = scores * shown.all(axis=2)
        return pixels, lift_keypoints(pixels, depths, scores, self._limb_scale), scores

    def _recognise(self, batch: int | None) -> tuple[int, bool, PoseLayout]:
        """Return the largest batch, whether every batch must have that size, and the layout.

        Some exports declare a free batch axis but work with one fixed number only. Runs on empty
        inputs show this.
        """
        height, width = self.input_size_hw_px
        works: dict[int, list[NDArray[Any]]] = {}
        failure: PerceptionError | None = None
        for count in (1, 2) if batch is None else (batch,):
            try:
                blob = self._pixels.as_input(self._pixels.empty_blob(count, height, width))
                outputs = run_on_images(self.model, blob)
            except PerceptionError as error:
                failure = failure or error
                continue
            if batch is not None or all(len(output) == count for output in outputs):
                works[count] = outputs
        if not works:
            raise failure or PerceptionError(
                f"{self.model.name} does not return one result per image: {self.model.layout}"
            )
        count, outputs = next(iter(works.items()))
        recognise = recognise_movenet if self._channels_last else recognise_simcc
        layout: PoseLayout = recognise(self.model, outputs, height, width)
        return (_MAX_BATCH, False, layout) if len(works) == 2 else (count, True, layout)
