"""The pixel format of a network: order of the channels, mean and standard deviation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

#: Mean and standard deviation of ImageNet's pixels (0–255), which many networks are trained with.
IMAGENET_MEAN_RGB: Final = (123.675, 116.28, 103.53)
IMAGENET_STD_RGB: Final = (58.395, 57.12, 57.375)


@dataclass(frozen=True, slots=True)
class PixelFormat:
    """Conversion of pixels to the numbers of a network: (value − mean) / std in each channel.

    A table per channel holds the 256 results, computed in float64 and rounded once. The look-up is
    exact and several times faster than ``cv2.dnn.blobFromImage``.

    Attributes:
        mean_rgb: mean of the channels red, green, blue, in 0–255.
        std_rgb: standard deviation of the same channels.
        bgr: True if the network takes the channels in the order blue, green, red. Mean and
            standard deviation are still given in the order red, green, blue.
        dtype: number type of the network's input; ``"uint8"`` takes the pixels unchanged.
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

    def empty_blob(self, count: int, height: int, width: int) -> NDArray[Any]:
        """Return zeros (count, 3, height, width) to be filled by :meth:`write`."""
        # The tables are float32; :meth:`as_input` rounds them to half precision.
        dtype = np.uint8 if self.dtype == "uint8" else np.float32
        return np.zeros((count, 3, height, width), dtype)

    def write(self, image_rgb: NDArray[np.uint8], out: NDArray[Any]) -> None:
        """Write an RGB image (h, w, 3) into ``out`` (3, h, w), a blob or a part of one."""
        for channel, plane in enumerate(cv2.split(image_rgb)):
            row = 2 - channel if self.bgr else channel
            if self.dtype == "uint8":
                out[row] = plane
            else:
                cv2.LUT(plane, self._tables[channel], dst=out[row])

    def as_input(self, blob: NDArray[Any]) -> NDArray[Any]:
        """Return the blob in the number type of the network's input."""
        return blob.astype(np.float16) if self.dtype == "float16" else blob
