"""A person detector that runs any network of a known layout."""

from __future__ import annotations

import threading
from typing import Any, Final

import numpy as np

from ..._stages import DEFAULT_SCORE_THRESHOLD, PersonDetection
from ...arrays import ImageRgb, finite_number
from ...errors import PerceptionError
from .._images import input_batch, input_dtype, input_size, rgb_image, run_on_images
from .._model import ModelSource, OnnxModel, as_onnx_model
from .._settings import OnnxSettings
from ._layouts import (
    DetectorLayout,
    TrialRun,
    checked_family,
    family_of,
    metadata_size,
    recognise,
)
from ._letterbox import Letterbox
from ._overlaps import detections_of

# RTMDet's exports leave the input size free; its person detector was trained at this size.
_RTMDET_HW_PX: Final = (320, 320)


class OnnxPersonDetector:
    """A person detector from an ONNX file; its layout is recognised from shapes and metadata.

    Known layouts: YOLOv8, YOLO11 and relatives; networks that need no NMS or contain it, with
    output (1, M, 6); YOLOX with its raw head or its own NMS; RTMDet. The class "person" of the
    metadata counts; without class names the first class counts, as in COCO. Boxes of (1, M, 6) are
    x1, y1, x2, y2, as all known exporters write them.

    Several threads may share a detector; their calls run one after another.

    Args:
        path: the ONNX file, its bytes, or a loaded :class:`~perception.networks.OnnxModel`.
        score_threshold: detections with a lower score are dropped, in [0, 1].
        input_size_hw_px: (height, width) for a network that leaves its input size free; default
            the metadata's ``imgsz``, and 320 × 320 for RTMDet.
        person_class: number of the class that counts, where the metadata do not name it.
        family: ``"rtmdet"`` or ``"yolox"`` for a network with the outputs ``dets`` and ``labels``,
            these or ``"ultralytics"`` for one with output (1, M, 6). They want different pixels.
            None takes it from the names of weights and nodes and, for Ultralytics, from the
            metadata, and refuses such a network if they do not tell.
        settings: providers and threads, for a model that is not loaded yet.

    Raises:
        PerceptionError: for a file that cannot be loaded, an unknown layout (the message says what
            was found and what is known), and an invalid value.
    """

    def __init__(
        self,
        path: ModelSource,
        *,
        score_threshold: float = DEFAULT_SCORE_THRESHOLD,
        input_size_hw_px: tuple[int, int] | None = None,
        person_class: int | None = None,
        family: str | None = None,
        settings: OnnxSettings | None = None,
    ) -> None:
        self._score_threshold = finite_number(
            "score_threshold", score_threshold, minimum=0.0, maximum=1.0
        )
        if person_class is not None and (not isinstance(person_class, int) or person_class < 0):
            raise PerceptionError(
                f"person_class must be a whole number of at least 0 or None, got {person_class!r}"
            )
        self.model = as_onnx_model(path, settings)
        self.input_size_hw_px = _detector_input_size(self.model, input_size_hw_px, family)
        self._layout = self._recognise(person_class, checked_family(family))
        self._letterbox = Letterbox(
            *self.input_size_hw_px, self._layout.pixels, centred=self._layout.centred
        )
        self._lock = threading.Lock()

    def __repr__(self) -> str:
        return f"OnnxPersonDetector({self.model.name}: {self.layout})"

    @property
    def layout(self) -> str:
        """Name of the recognised layout."""
        return self._layout.name

    def detect(self, image_rgb: ImageRgb) -> tuple[PersonDetection, ...]:
        """Return the people in an image, highest score first.

        Box coordinates count from the image's corner (the whole image is 0, 0, width, height).
        Boxes are clipped to the image. Boxes smaller than a pixel or with non-finite numbers are
        dropped.

        Args:
            image_rgb: (H, W, 3) uint8 of any size.

        Raises:
            PerceptionError: for an image of another type or shape, and when the network fails.
        """
        image = rgb_image(image_rgb)
        with self._lock:
            blob, geometry = self._letterbox.fill(image)
            outputs = run_on_images(self.model, blob)
            # Non-finite numbers are dropped below; they need no warning here.
            with np.errstate(all="ignore"):
                boxes, scores = self._layout.decoder(outputs, self._score_threshold)
        return detections_of(boxes, scores, geometry)

    def _recognise(self, person_class: int | None, family: str | None) -> DetectorLayout:
        height, width = self.input_size_hw_px
        dtype = input_dtype(self.model)
        # Some exports declare fixed extents as free. A run on an empty input shows all of them.
        outputs = run_on_images(self.model, np.zeros((1, 3, height, width), dtype))
        with np.errstate(all="ignore"):
            return recognise(
                TrialRun(self.model, outputs, height, width, dtype, person_class, family)
            )


def _detector_input_size(
    model: OnnxModel, requested_hw_px: Any, family: str | None
) -> tuple[int, int]:
    batch = input_batch(model)
    if batch not in (1, None):
        raise PerceptionError(
            f"{model.name} takes {batch} images at a time, wanted 1: {model.inputs[0]}"
        )
    default = metadata_size(model)
    if default is None and len(model.outputs) == 2 and (family or family_of(model)) != "yolox":
        default = _RTMDET_HW_PX
    return input_size(model, requested_hw_px, default)
