"""Layouts of head pose networks, recognised from shapes and metadata."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ...errors import PerceptionError
from .._image_input import input_batch, input_dtype, input_size
from .._model import OnnxModel
from .._pixels import IMAGENET_MEAN_RGB, IMAGENET_STD_RGB, PixelFormat

#: Outputs of awarenav's own layout, with their shapes per crop.
AWARENAV_OUTPUTS: Final[dict[str, tuple[int, ...]]] = {
    "rotation": (3, 3),
    "rotation_covariance": (3, 3),
    "keypoints": (5, 2),
    "keypoints_std": (5,),
    "visible": (5,),
    "centre": (2,),
    "side_m": (),
    "side_log_std": (),
    "head": (),
}
_AWARENAV_VERSION: Final = "1"
_KNOWN: Final = (
    "known are awarenav's own head network (input (N, 3, 64, 64); outputs "
    + ", ".join(AWARENAV_OUTPUTS)
    + ") and full-range networks of the 6DRepNet kind (input (N, 3, 224, 224); one output "
    "(N, 3, 3) or (N, 6))"
)
_FULL_RANGE_SIZE_PX: Final = 224
# Training crops of full-range networks show about a head with its hair: the landmarks of 300W-LP,
# enlarged by half.
_FULL_RANGE_SIDE_M: Final = 0.26


@dataclass(frozen=True, slots=True)
class HeadLayout:
    """Layout of a head pose network.

    Attributes:
        is_awarenav: True for awarenav's own layout; False for a full-range network of the 6DRepNet
            kind, which gives a rotation and nothing else.
        size_px: side of the square input.
        crop_side_m: length of that side at the head, in metres.
        pixels: pixel format of the input.
        batch: extent of the batch axis; None if it is free.
        output_shape: shape per crop of the one output of a full-range network.
    """

    is_awarenav: bool
    size_px: int
    crop_side_m: float
    pixels: PixelFormat
    batch: int | None
    output_shape: tuple[int | None, ...] = ()


def recognise(model: OnnxModel) -> HeadLayout:
    """Recognise the layout of a head pose network from its shapes and metadata.

    Raises:
        PerceptionError: for an unknown layout; the message says what was found and what is known.
    """
    batch = input_batch(model)
    dtype = input_dtype(model)
    shapes = {tensor.name: tensor.shape for tensor in model.outputs}
    if all(
        name in shapes and len(shapes[name]) == len(shape) + 1 and _fits(shapes[name][1:], shape)
        for name, shape in AWARENAV_OUTPUTS.items()
    ):
        version = model.metadata.get("awarenav_layout", _AWARENAV_VERSION)
        if version != _AWARENAV_VERSION:
            raise PerceptionError(
                f"{model.name} is an awarenav head network of layout {version}; this version of "
                f"awarenav reads layout {_AWARENAV_VERSION}"
            )
        height, width = input_size(model, None, (64, 64))
        mean = _metadata_float(model, "mean", 120)
        std = _metadata_float(model, "std", 60)
        if height == width and std > 0.0:
            pixels = PixelFormat((mean,) * 3, (std,) * 3, dtype=dtype)
            side_m = _metadata_float(model, "crop_side_m", 0.40)
            return HeadLayout(True, height, side_m, pixels, batch)
    per_crop = [shape[1:] for shape in shapes.values() if shape]
    if len(per_crop) == 1 and per_crop[0] in ((3, 3), (6,)):
        size = (_FULL_RANGE_SIZE_PX, _FULL_RANGE_SIZE_PX)
        if input_size(model, None, size) == size:
            pixels = PixelFormat(IMAGENET_MEAN_RGB, IMAGENET_STD_RGB, dtype=dtype)
            side_m = _FULL_RANGE_SIDE_M
            return HeadLayout(False, _FULL_RANGE_SIZE_PX, side_m, pixels, batch, per_crop[0])
    raise PerceptionError(
        f"{model.name} is not a head pose network of a known layout: found {model.layout}; {_KNOWN}"
    )


def _fits(found: tuple[int | None, ...], wanted: tuple[int, ...]) -> bool:
    return all(extent in (None, want) for extent, want in zip(found, wanted, strict=True))


def _metadata_float(model: OnnxModel, key: str, default: float) -> float:
    text = model.metadata.get(key, str(default))
    try:
        return float(text)
    except ValueError:
        raise PerceptionError(
            f"{model.name}: metadata {key!r} must be a number, got {text!r}"
        ) from None
