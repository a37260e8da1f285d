"""Finds the keypoints of people with any SimCC pose network, in the image and in space."""

from __future__ import annotations

import os
import threading
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from .._detection import PersonDetection
from .._keypoints import PersonKeypoints
from ..arrays import FloatArray, ImageRgb, finite_number
from ..errors import PerceptionError
from ..layouts import keypoint_layout
from ._crops import BOX_PADDING, PersonCrops
from ._image import rgb_image
from ._input_size import batch_of, input_size
from ._lift import lift
from ._pixels import PixelFormat, input_dtype
from ._pose_layouts import PoseLayout, metadata_number, recognise_pose
from ._session import OnnxModel, OnnxSettings, as_onnx_model
from ._simcc import confidence, depth_m, peaks

# The data preprocessor of RTMPose, RTMW and RTMW3D, and ours.
_MEAN_RGB: Final = (123.675, 116.28, 103.53)
_STD_RGB: Final = (58.395, 57.12, 57.375)
# A crowd is run in portions: memory grows with the batch, and speed no longer does.
_MAX_BATCH: Final = 16


class OnnxPoseEstimator:
    """A top-down pose network from an ONNX file: RTMPose, RTMW, RTMW3D or our own.

    Keypoints are refined between the bins and scored by the weakest of their axes. With a third
    axis they come with the network's depth; see :func:`._lift.lift` for how they become metres.
    Without one the skeleton is flat, every z is 0, and ``lifted`` is False.

    All people of a picture go through the network together where its batch axis is free, else in
    portions of its size. Calls from several threads take turns.

    Args:
        path: the ONNX file, its bytes, or an :class:`OnnxModel` that is loaded already.
        box_padding: how much larger than the box the network's picture is, > 0; default the
            metadata's ``box_padding``, else 1.25.
        input_size_hw_px: (height, width) for a network that leaves its input's size free.
        settings: providers and threads, for loading.
        sha256: what the file must hash to, for loading.

    Raises:
        PerceptionError: for a file that cannot be loaded, a layout that is not known (saying what
            was found and what is known), and a value that is not valid.
    """

    def __init__(
        self,
        path: OnnxModel | str | os.PathLike[str] | bytes,
        *,
        box_padding: float | None = None,
        input_size_hw_px: tuple[int, int] | None = None,
        settings: OnnxSettings | None = None,
        sha256: str | None = None,
    ) -> None:
        if box_padding is not None:
            box_padding = finite_number(
                "box_padding", box_padding, minimum=0.0, exclusive_minimum=True
            )
        self.model = as_onnx_model(path, settings, sha256)
        self._padding = (
            metadata_number(self.model, "box_padding", BOX_PADDING)
            if box_padding is None
            else box_padding
        )
        # Where a network's keypoints lie in the body is a habit of whoever labelled its data.
        self._limb_scale = metadata_number(self.model, "limb_scale", 1.0)
        self._scale_std = metadata_number(self.model, "scale_relative_std", 0.0)
        batch = batch_of(self.model)
        self.input_size_hw_px = input_size(self.model, input_size_hw_px, None)
        dtype = input_dtype(self.model.inputs[0], self.model.name)
        self._pixels = PixelFormat(_MEAN_RGB, _STD_RGB, dtype=dtype)
        self._batch, self._always_full, self._layout = self._recognise(batch)
        self._crop = np.empty((*self.input_size_hw_px, 3), np.uint8)
        self._blob = self._pixels.blob(1, *self.input_size_hw_px)
        self._lock = threading.Lock()

    def __repr__(self) -> str:
        return f"OnnxPoseEstimator({self.model.name}: {self.layout})"

    @property
    def layout(self) -> str:
        """Name of the keypoint layout: ``"coco"`` or ``"coco_wholebody"``."""
        return self._layout.keypoints

    @property
    def has_depth(self) -> bool:
        """Whether the network gives depths; skeletons are flat where it does not."""
        return self._layout.has_depth

    def estimate(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return the keypoints of each detected person, in the same order.

        Without detections there are no people, and the network is not run. A person whose crop lies
        outside the picture, or whose box has no extent, has every score 0. So has a keypoint that
        the network places outside the picture, or at no finite place.

        Args:
            image_rgb: (H, W, 3) uint8 of any size.
            detections: boxes that count pixels from the picture's corner.

        Raises:
            PerceptionError: for a picture of another type or shape, and when the network fails.
        """
        image = rgb_image(image_rgb)
        if not detections:
            return ()
        boxes = np.array([detection.box_xyxy_px for detection in detections])
        crops = PersonCrops(boxes, *self.input_size_hw_px, self._padding)
        visible = crops.inside(image).nonzero()[0]
        size = keypoint_layout(self.layout).size
        # Those who are not seen stand in the middle of their box, with scores of 0.
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
        """The outputs for the crops ``rows``, x, y and z along the first axis of each."""
        portions = []
        for start in range(0, len(rows), self._batch):
            portion = rows[start : start + self._batch]
            count = self._batch if self._always_full else len(portion)
            if len(self._blob) < count:
                self._blob = self._pixels.blob(count, *self.input_size_hw_px)
            for place, row in enumerate(portion):
                crops.cut(image, int(row), self._crop)
                self._pixels.write(self._crop, self._blob[place])
            outputs = self._feed(self._pixels.fed(self._blob[:count]))
            portions.append([outputs[axis][: len(portion)] for axis in self._layout.axes])
        if len(portions) == 1:
            return portions[0]
        return [np.concatenate(parts) for parts in zip(*portions, strict=True)]

    def _feed(self, blob: NDArray[Any]) -> list[NDArray[Any]]:
        return self.model.run({self.model.inputs[0].name: blob})

    def _decode(
        self,
        outputs: list[NDArray[Any]],
        image: ImageRgb,
        crops: PersonCrops,
        rows: NDArray[np.intp],
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Pixels (n, K, 2), skeletons (n, K, 3) and scores (n, K) of the crops ``rows``."""
        places, heights = peaks(outputs)
        in_crop = places[:2].transpose(1, 2, 0) / self._layout.split_ratio
        pixels = crops.to_image(in_crop, rows)
        # What lies outside the picture was guessed. One pixel of the crop is rounding.
        extent = np.array([image.shape[1], image.shape[0]])
        slack = 0.5 + crops.step_px[rows, None]
        shown = (pixels > -slack) & (pixels < extent - 1.0 + slack)
        scores = confidence(heights, np.asarray(shown.all(axis=2)))
        depths = None
        if self.has_depth:
            depths = depth_m(places[2], outputs[2].shape[2], self._layout.z_range_m)
        return pixels, lift(pixels, depths, scores, self._limb_scale), scores

    def _recognise(self, batch: int | None) -> tuple[int, bool, PoseLayout]:
        """How many crops the network takes at most, whether always so many, and its layout.

        Some exports call the batch free and have a number written into their insides: runs on
        nothing tell.
        """
        height, width = self.input_size_hw_px
        works: dict[int, list[NDArray[Any]]] = {}
        failure: PerceptionError | None = None
        for count in (1, 2) if batch is None else (batch,):
            try:
                outputs = self._feed(self._pixels.fed(self._pixels.blob(count, height, width)))
            except PerceptionError as error:
                failure = failure or error
                continue
            if batch is not None or all(len(output) == count for output in outputs):
                works[count] = outputs
        if not works:
            raise failure or PerceptionError(
                f"{self.model.name} does not put out one result a picture: {self.model.layout}"
            )
        count, outputs = next(iter(works.items()))
        layout = recognise_pose(self.model, outputs, height, width)
        return (_MAX_BATCH, False, layout) if len(works) == 2 else (count, True, layout)
