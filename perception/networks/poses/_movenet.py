"""MoveNet for one person: the layout of its output, and its pixels.

The input is (1, S, S, 3): RGB from 0 to 255, of a square picture with the person in its middle. S
is 192 for Lightning and 256 for Thunder. The numbers are int32, and in TFLite's variants uint8 or
float32. The output (1, 1, 17, 3) has y, x and score of each of COCO's keypoints; y and x go from 0
to 1 across the picture, from edge to edge. Of several people the network takes the one nearest to
the middle. It also places keypoints that are covered.

Source: MoveNet.SinglePose model card (Google, 2021), and the networks' page on TensorFlow Hub. The
latter recommends a threshold of 0.3 for the scores.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...arrays import FloatArray
from .._model import OnnxModel
from ._layouts import unknown_layout

#: Number types of the input.
MOVENET_DTYPES: Final = ("int32", "uint8", "float32")


@dataclass(frozen=True, slots=True)
class MoveNetLayout:
    """Layout of MoveNet's output.

    Attributes:
        size_px: side of the square input.
    """

    size_px: int
    keypoints: str = "coco"
    has_depth: bool = False

    def decode(self, outputs: Sequence[NDArray[Any]]) -> tuple[FloatArray, None, FloatArray]:
        """Return pixels (n, 17, 2) of the crop, no depths, and scores (n, 17)."""
        rows = outputs[0][:, 0].astype(np.float64)
        good = np.asarray(np.isfinite(rows).all(axis=2))
        rows = np.where(good[..., None], rows, 0.0)
        return rows[..., 1::-1] * self.size_px - 0.5, None, np.clip(rows[..., 2], 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class RawPixels:
    """Pixels as they are, with the channels last.

    Attributes:
        dtype: number type of the network's input.
    """

    dtype: str

    def empty_blob(self, count: int, height: int, width: int) -> NDArray[Any]:
        """Return zeros (count, height, width, 3) to be filled by :meth:`write`."""
        return np.zeros((count, height, width, 3), np.uint8)

    def write(self, image_rgb: NDArray[np.uint8], out: NDArray[Any]) -> None:
        """Write an RGB image (h, w, 3) into ``out``."""
        out[...] = image_rgb

    def as_input(self, blob: NDArray[Any]) -> NDArray[Any]:
        """Return the blob in the number type of the network's input."""
        return blob.astype(self.dtype, copy=False)


def recognise_movenet(
    model: OnnxModel, outputs: Sequence[NDArray[Any]], height_px: int, width_px: int
) -> MoveNetLayout:
    """Recognise MoveNet from the outputs of a trial run on an input with the channels last.

    Raises:
        PerceptionError: for an unknown layout; the message says what was found and what is known.
    """
    if height_px != width_px or [output.shape[1:] for output in outputs] != [(1, 17, 3)]:
        reason = "with the channels last, only MoveNet for one person is known"
        raise unknown_layout(model, f"(N, {height_px}, {width_px}, 3)", outputs, reason)
    return MoveNetLayout(height_px)
