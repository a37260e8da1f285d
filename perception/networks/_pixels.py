"""How a network wants its pixels: order of channels, mean and standard deviation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import PerceptionError
from ._session import OnnxTensor

_INPUT_DTYPES: Final = ("float32", "float16", "uint8")


@dataclass(frozen=True, slots=True)
class PixelFormat:
    """Pixels become (value − mean) / std, channel by channel.

    One table a channel holds the 256 results, computed in float64 and rounded once; looking them up
    is exact and several times faster than ``cv2.dnn.blobFromImage``.

    Attributes:
        mean_rgb: of the channels red, green, blue, in 0–255.
        std_rgb: likewise.
        bgr: whether the network takes the channels in the order blue, green, red. Mean and standard
            deviation are given in the order red, green, blue all the same.
        dtype: the network's input; ``"uint8"`` takes the pixels as they are.
    """

    mean_rgb: tuple[float, float, float] = (0.0, 0.0, 0.0)
    std_rgb: tuple[float, float, float] = (1.0, 1.0, 1.0)
    bgr: bool = False
    dtype: str = "float32"
    _tables: tuple[NDArray[Any], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        values = np.arange(256.0)
        lookup = [
            ((values - mean) / std).astype(np.float32).reshape(1, 256)
            for mean, std in zip(self.mean_rgb, self.std_rgb, strict=True)
        ]
        object.__setattr__(self, "_tables", tuple(lookup))

    def blob(self, count: int, height: int, width: int) -> NDArray[Any]:
        """An empty input of the network for ``count`` pictures: (count, 3, height, width)."""
        # Tables are looked up in float32; half precision is rounded from it when fed.
        dtype = np.uint8 if self.dtype == "uint8" else np.float32
        return np.zeros((count, 3, height, width), dtype)

    def write(self, image_rgb: NDArray[np.uint8], out: NDArray[Any]) -> None:
        """Write an (h, w, 3) RGB picture into ``out`` (3, h, w), a blob or a part of one."""
        for channel, plane in enumerate(cv2.split(image_rgb)):
            row = 2 - channel if self.bgr else channel
            if self.dtype == "uint8":
                out[row] = plane
            else:
                cv2.LUT(plane, self._tables[channel], dst=out[row])

    def fed(self, blob: NDArray[Any]) -> NDArray[Any]:
        """The blob as the network takes it."""
        return blob.astype(np.float16) if self.dtype == "float16" else blob


def input_dtype(tensor: OnnxTensor, model_name: str) -> str:
    """The type of a network's pixels, or a refusal."""
    if tensor.dtype not in _INPUT_DTYPES:
        raise PerceptionError(
            f"{model_name}: input {tensor} is not one of the known types {', '.join(_INPUT_DTYPES)}"
        )
    return tensor.dtype
