"""The input of a network that takes images: batch axis, height and width, number type."""

from __future__ import annotations

from typing import Any, Final

from numpy.typing import NDArray

from ..errors import PerceptionError
from ._model import OnnxModel

_DTYPES: Final = ("float32", "float16", "uint8")


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


def input_dtype(model: OnnxModel) -> str:
    """Return the number type of the input: ``"float32"``, ``"float16"`` or ``"uint8"``.

    Raises:
        PerceptionError: for another type.
    """
    tensor = model.inputs[0]
    if tensor.dtype not in _DTYPES:
        raise PerceptionError(
            f"{model.name}: input {tensor} is not one of the known types {', '.join(_DTYPES)}"
        )
    return tensor.dtype


def input_size(
    model: OnnxModel, requested_hw_px: Any, default_hw_px: tuple[int, int] | None
) -> tuple[int, int]:
    """Return the height and width to run ``model`` at.

    Args:
        model: a network with an input (N, 3, height, width).
        requested_hw_px: the caller's choice, or None; it must agree with extents that are fixed.
        default_hw_px: for extents that the network leaves free and the caller does not give.

    Raises:
        PerceptionError: for a choice that is not two whole numbers ≥ 1 or does not agree with the
            network, and for a free extent without choice or default.
    """
    fixed = model.inputs[0].shape[2:]
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
    """Run a network on a batch of images (N, 3, height, width)."""
    return model.run({model.inputs[0].name: blob})
