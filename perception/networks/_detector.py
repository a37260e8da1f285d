"""Finds people with any detector of a known layout."""

from __future__ import annotations

import os
import threading
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from .._detection import PersonDetection
from ..arrays import ImageRgb, finite_number
from ..errors import PerceptionError
from ._detector_decoders import Floats
from ._detector_layouts import DetectorLayout, Trial, metadata_size, recognise
from ._image import rgb_image
from ._input_size import batch_of, input_size
from ._letterbox import Letterbox, LetterboxGeometry
from ._pixels import input_dtype
from ._session import OnnxModel, OnnxSettings, as_onnx_model

#: RTMDet's exports leave their size free; its person detector was trained at this one.
_RTMDET_HW_PX: Final = (320, 320)
# Before overlaps are removed; no scene has so many people.
_MAX_CANDIDATES: Final = 1000
_MIN_SIDE_PX: Final = 1.0


class OnnxPersonDetector:
    """A person detector from an ONNX file, whose layout is told from its shapes and metadata.

    Known are YOLOv8, YOLO11 and relatives; networks without NMS or with NMS inside, which put out
    (1, M, 6); YOLOX with its raw head; RTMDet. Where metadata name the classes, the one called
    "person" counts, else the first, as in COCO. Boxes (1, M, 6) may be corners or centre and size:
    see :class:`._box_format.BoxFormatVote`.

    Calls from several threads take turns.

    Args:
        path: the ONNX file, its bytes, or an :class:`OnnxModel` that is loaded already.
        score_threshold: detections scored below this are dropped, in [0, 1].
        iou_threshold: of two boxes that overlap more than this, the better one stays, in [0, 1].
            At 0.5 a person may hide half of another before the other is taken for an echo.
        input_size_hw_px: (height, width) for a network that leaves its input's size free; default
            the metadata's ``imgsz``, and 320 × 320 for RTMDet.
        person_class: number of the class that counts, where metadata do not tell.
        box_format: ``"xyxy"`` or ``"cxcywh"`` for (1, M, 6), where it is known; None looks.
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
        score_threshold: float = 0.25,
        iou_threshold: float = 0.5,
        input_size_hw_px: tuple[int, int] | None = None,
        person_class: int | None = None,
        box_format: str | None = None,
        settings: OnnxSettings | None = None,
        sha256: str | None = None,
    ) -> None:
        self._score_threshold = finite_number(
            "score_threshold", score_threshold, minimum=0.0, maximum=1.0
        )
        self._iou_threshold = finite_number(
            "iou_threshold", iou_threshold, minimum=0.0, maximum=1.0
        )
        if person_class is not None and (not isinstance(person_class, int) or person_class < 0):
            raise PerceptionError(
                f"person_class must be a whole number of at least 0 or None, got {person_class!r}"
            )
        self.model = as_onnx_model(path, settings, sha256)
        self.input_size_hw_px = _size(self.model, input_size_hw_px)
        self._layout = self._recognise(person_class, box_format)
        self._letterbox = Letterbox(
            *self.input_size_hw_px, self._layout.pixels, centred=self._layout.centred
        )
        self._lock = threading.Lock()

    def __repr__(self) -> str:
        return f"OnnxPersonDetector({self.model.name}: {self.layout})"

    @property
    def layout(self) -> str:
        """Name of the layout that was recognised."""
        return self._layout.name

    def detect(self, image_rgb: ImageRgb) -> tuple[PersonDetection, ...]:
        """Return the people in a picture, the surest first.

        Boxes count pixels from the picture's corner (a whole picture is 0, 0, width, height) and
        are clipped to it; boxes of less than a pixel and numbers that are not finite are dropped.

        Args:
            image_rgb: (H, W, 3) uint8 of any size.

        Raises:
            PerceptionError: for a picture of another type or shape, and when the network fails.
        """
        image = rgb_image(image_rgb)
        with self._lock:
            blob, geometry = self._letterbox.fill(image)
            outputs = self.model.run({self.model.inputs[0].name: blob})
            # Networks may put out anything, which is sorted out below without a warning.
            with np.errstate(all="ignore"):
                boxes, scores = self._layout.decoder.decode(outputs, self._score_threshold)
                sizes = boxes[:, 2:] - boxes[:, :2]
        good = np.isfinite(boxes).all(axis=1) & np.isfinite(scores) & (sizes > 0.0).all(axis=1)
        return self._people(boxes[good], scores[good], geometry)

    def _people(
        self, boxes: Floats, scores: Floats, geometry: LetterboxGeometry
    ) -> tuple[PersonDetection, ...]:
        kept = self._without_overlaps(boxes, scores)
        if not len(kept):
            return ()
        clipped = geometry.to_image(boxes[kept])
        large = np.flatnonzero((clipped[:, 2:] - clipped[:, :2]).min(axis=1) >= _MIN_SIDE_PX)
        return tuple(
            PersonDetection(clipped[row], min(float(scores[kept[row]]), 1.0)) for row in large
        )

    def _without_overlaps(self, boxes: Floats, scores: Floats) -> NDArray[np.intp]:
        """Rows that stay, by falling score."""
        if len(boxes) < 2:
            return np.arange(len(boxes))
        corners_and_sizes = np.concatenate([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]], axis=1)
        kept = cv2.dnn.NMSBoxes(
            corners_and_sizes.tolist(),
            scores.tolist(),
            0.0,  # what lies below the threshold has gone already
            self._iou_threshold,
            top_k=_MAX_CANDIDATES,
        )
        return np.asarray(kept, dtype=np.intp).reshape(-1)

    def _recognise(self, person_class: int | None, box_format: str | None) -> DetectorLayout:
        height, width = self.input_size_hw_px
        tensor = self.model.inputs[0]
        dtype = input_dtype(tensor, self.model.name)
        # Exports may leave extents open that are not: a run on nothing tells them all.
        outputs = self.model.run({tensor.name: np.zeros((1, 3, height, width), dtype)})
        with np.errstate(all="ignore"):
            return recognise(
                Trial(self.model, outputs, height, width, dtype, person_class, box_format)
            )


def _size(model: OnnxModel, asked_hw_px: Any) -> tuple[int, int]:
    batch = batch_of(model)
    if batch not in (1, None):
        raise PerceptionError(
            f"{model.name} takes {batch} pictures at a time, wanted 1: {model.inputs[0]}"
        )
    default = metadata_size(model)
    if default is None and len(model.outputs) == 2:
        default = _RTMDET_HW_PX
    return input_size(model, asked_hw_px, default)
