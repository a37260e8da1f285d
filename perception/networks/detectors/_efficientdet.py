"""A person detector that runs EfficientDet-Lite from a TFLite file.

Contract, as MediaPipe publishes these networks: input (1, S, S, 3) uint8 RGB; two outputs, offsets
(1, N, 4) and the scores of 90 classes (1, N, 90), of which the first is the person. The N anchors
lie at the strides 8 to 128, nine at a place: three sizes, and of each a square, a wide and a tall
one. Sizes are 3, 3·2^(1/3) and 3·2^(2/3) strides (``anchor_scale`` of the Lite networks).

Source: Tan et al., "EfficientDet: Scalable and Efficient Object Detection", 2020; google/automl,
``efficientdet/hparams_config.py`` (efficientdet-lite0) and ``efficientdet/tf2/anchors.py``.
"""

from __future__ import annotations

import math
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ..._stages import PersonDetection
from ...arrays import ImageRgb, finite_number
from ...errors import PerceptionError
from .._images import rgb_image
from .._settings import OnnxSettings
from .._tflite import TfliteModel
from ._decoders import Floats, centre_to_corners
from ._letterbox import LetterboxGeometry
from ._overlaps import detections_of

#: On labelled photographs 93 % of the people have such a score, and one false box in seven pictures
#: has.
DEFAULT_THRESHOLD: Final = 0.3

_STRIDES: Final = (8, 16, 32, 64, 128)
_ANCHOR_SCALE: Final = 3.0
# Sizes at a place, and sides of each: (width, height).
_OCTAVES: Final = tuple(2.0 ** (step / 3.0) for step in range(3))
_ASPECTS: Final = tuple((math.sqrt(ratio), 1.0 / math.sqrt(ratio)) for ratio in (1.0, 2.0, 0.5))
_PERSON: Final = 0


class EfficientDetPersonDetector:
    """A person detector that runs EfficientDet-Lite; the contract is in the module's text.

    Several threads may share a detector; their calls run one after another.

    Args:
        path: the TFLite file, its bytes, or a loaded model.
        score_threshold: detections with a lower score are dropped, in [0, 1].
        settings: threads, for a model that is not loaded yet.

    Raises:
        PerceptionError: for a file that cannot be loaded, another layout, and an invalid value.
    """

    def __init__(
        self,
        path: Any,
        *,
        score_threshold: float = DEFAULT_THRESHOLD,
        settings: OnnxSettings | None = None,
    ) -> None:
        self._score_threshold = finite_number(
            "score_threshold", score_threshold, minimum=0.0, maximum=1.0
        )
        self.model = path if isinstance(path, TfliteModel) else TfliteModel(path, settings=settings)
        side = self.model.inputs[0].shape[1] or 0
        self._anchors = _anchors(side)
        shapes = {tensor.name: tensor.shape for tensor in self.model.outputs}
        ends = {shape[-1]: name for name, shape in shapes.items()}
        known = (
            self.model.inputs[0].shape == (1, side, side, 3)
            and self.model.inputs[0].dtype == "uint8"
            and len(shapes) == 2
            and 4 in ends
            and all(shape[:2] == (1, len(self._anchors)) for shape in shapes.values())
        )
        if not known:
            raise PerceptionError(
                f"{self.model.name} is not an EfficientDet-Lite detector: found "
                f"{self.model.layout}; known: (1, S, S, 3) uint8 -> (1, N, 4), (1, N, classes), "
                f"N = {len(self._anchors)} for S = {side}"
            )
        self._offsets = ends.pop(4)
        (self._scores,) = ends.values()
        self.input_size_hw_px = (side, side)

    def __repr__(self) -> str:
        return f"EfficientDetPersonDetector({self.model.name})"

    def detect(self, image_rgb: ImageRgb) -> tuple[PersonDetection, ...]:
        """Return the people in an image, highest score first.

        Box coordinates count from the image's corner (the whole image is 0, 0, width, height).
        Boxes are clipped to the image.

        Args:
            image_rgb: (H, W, 3) uint8 of any size. It lies at the top left of the input, and the
                rest is black.

        Raises:
            PerceptionError: for an image of another type or shape, and when the network fails.
        """
        image = rgb_image(image_rgb)
        geometry = LetterboxGeometry.of(
            (image.shape[1], image.shape[0]), self.input_size_hw_px, centred=False
        )
        batch = np.zeros((1, *self.input_size_hw_px, 3), np.uint8)
        width, height = geometry.scaled_px
        batch[0, :height, :width] = cv2.resize(image, geometry.scaled_px)
        outputs = self.model.run(batch)
        scores = outputs[self._scores][0, :, _PERSON]
        found = np.flatnonzero(scores >= self._score_threshold)
        boxes = _boxes(outputs[self._offsets][0, found], self._anchors[found])
        return detections_of(boxes, scores[found], geometry)


def _anchors(side_px: int) -> Floats:
    """Return the anchors (N, 4) of a square input: centre x, y, width, height in pixels."""
    levels = []
    for stride in _STRIDES:
        shapes = [
            (_ANCHOR_SCALE * stride * octave * width, _ANCHOR_SCALE * stride * octave * height)
            for octave in _OCTAVES
            for width, height in _ASPECTS
        ]
        count = -(-side_px // stride)
        rows, columns = np.mgrid[:count, :count].reshape(2, -1) * stride + 0.5 * stride
        places = np.repeat(np.stack([columns, rows], axis=1), len(shapes), axis=0)
        levels.append(np.hstack([places, np.tile(shapes, (count * count, 1))]))
    return np.concatenate(levels).astype(np.float32)


def _boxes(offsets: NDArray[Any], anchors: Floats) -> Floats:
    """Return corners (n, 4) from offsets (n, 4): y, x, and the logarithms of height and width."""
    centre, size = anchors[:, :2], anchors[:, 2:]
    moved = centre + offsets[:, 1::-1] * size
    return np.asarray(centre_to_corners(moved, np.exp(offsets[:, :1:-1]) * size))
