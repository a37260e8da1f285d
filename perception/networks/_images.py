"""Images as the input of a network: their check, size and number type, and the pixel format."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ..arrays import ImageRgb, check_image
from ..errors import PerceptionError
from ._model import OnnxModel

# OpenCV addresses the pixels of a warped image with 16-bit integers.
_MAX_SIDE_PX: Final = 32766


def rgb_image(image_rgb: Any) -> ImageRgb:
    """Check that ``image_rgb`` is an 8-bit RGB image and return it in a form that OpenCV can read.

    Args:
        image_rgb: (H, W, 3) uint8, with 1 to 32766 pixels per side. A view that OpenCV cannot
            read, such as ``image_bgr[..., ::-1]``, is copied.

    Raises:
        PerceptionError: for anything else; the message says what was given.
    """
    check_image(image_rgb)
    height, width = image_rgb.shape[:2]
    if not (1 <= height <= _MAX_SIDE_PX and 1 <= width <= _MAX_SIDE_PX):
        raise PerceptionError(
            f"image_rgb must have 1 to {_MAX_SIDE_PX} pixels per side, got {width} x {height}"
        )
    if image_rgb.strides[1:] != (3, 1) or image_rgb.strides[0] < 3 * width:
        return np.ascontiguousarray(image_rgb)
    return np.asarray(image_rgb)


_DTYPES: Final = ("float32", "float16", "uint8")


def has_channels_last(model: OnnxModel) -> bool:
    """Return whether the one input of a network is (N, height, width, 3), as in TensorFlow."""
    shape = model.inputs[0].shape if len(model.inputs) == 1 else ()
    return len(shape) == 4 and shape[3] == 3 and shape[1] != 3


def input_batch(model: OnnxModel) -> int | None:
    """Return the extent of the batch axis of a network with one image input; None if it is free.

    Raises:
        PerceptionError: for a network with other inputs.
    """
    if len(model.inputs) != 1:
        found = ", ".join(map(str, model.inputs))
        raise PerceptionError(
            f"{model.name} must have one input (N, 3, height, width), found {found}"
        )
    shape = model.inputs[0].shape
    if len(shape) != 4 or shape[1] not in (3, None):
        raise PerceptionError(
            f"{model.name} must have an input (N, 3, height, width), found {model.inputs[0]}"
        )
    return shape[0]


def input_dtype(model: OnnxModel, known: tuple[str, ...] = _DTYPES) -> str:
    """Return the number type of the input, such as ``"float32"``.

    Args:
        model: a network with one input.
        known: types that the network may have.

    Raises:
        PerceptionError: for another type.
    """
    tensor = model.inputs[0]
    if tensor.dtype not in known:
        raise PerceptionError(
            f"{model.name}: input {tensor} is not one of the known types {', '.join(known)}"
        )
    return tensor.dtype


def input_size(
    model: OnnxModel, requested_hw_px: Any, default_hw_px: tuple[int, int] | None
) -> tuple[int, int]:
    """Return the height and width to run ``model`` at.

    Args:
        model: a network with an input (N, 3, height, width) or (N, height, width, 3).
        requested_hw_px: the caller's choice, or None; it must agree with extents that are fixed.
        default_hw_px: for extents that the network leaves free and the caller does not give.

    Raises:
        PerceptionError: for a choice that is not two whole numbers ≥ 1 or does not agree with the
            network, and for a free extent without choice or default.
    """
    shape = model.inputs[0].shape
    fixed = shape[1:3] if has_channels_last(model) else shape[2:]
    requested = None if requested_hw_px is None else _checked_size(requested_hw_px)
    size = []
    for axis, extent in enumerate(fixed):
        wanted = None if requested is None else requested[axis]
        if extent is not None and wanted is not None and wanted != extent:
            raise PerceptionError(
                f"{model.name} takes an input of {fixed[0]} x {fixed[1]} pixels (height x width), "
                f"got {' x '.join(map(str, requested or ()))}"
            )
        known = extent if extent is not None else wanted
        if known is None and default_hw_px is not None:
            known = default_hw_px[axis]
        if known is None:
            raise PerceptionError(
                f"{model.name} leaves the size of its input free: {model.inputs[0]}; give it with "
                "input_size_hw_px=(height, width) in pixels"
            )
        size.append(known)
    return size[0], size[1]


def _checked_size(requested_hw_px: Any) -> tuple[int, int]:
    try:
        height, width = (int(side) for side in requested_hw_px)
        exact = [height, width] == list(requested_hw_px)
    except (TypeError, ValueError):
        exact = False
    if not exact or height < 1 or width < 1:
        raise PerceptionError(
            "input_size_hw_px must be (height, width), two whole numbers of pixels of at least 1, "
            f"got {requested_hw_px!r:.80}"
        )
    return height, width


def run_on_images(model: OnnxModel, blob: NDArray[Any]) -> list[NDArray[Any]]:
    """Run a network with one input on a batch of images, in the shape that it takes."""
    return model.run({model.inputs[0].name: blob})


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
