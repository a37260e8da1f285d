"""The height and width of a network's input: its own, or the caller's where it leaves them free."""

from __future__ import annotations

from typing import Any

from ..errors import PerceptionError
from ._session import OnnxModel


def batch_of(model: OnnxModel) -> int | None:
    """Extent of the batch axis of a network of one picture-shaped input; None when it is free.

    Raises:
        PerceptionError: for any other inputs.
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


def input_size(
    model: OnnxModel, asked_hw_px: Any, default_hw_px: tuple[int, int] | None
) -> tuple[int, int]:
    """Height and width to run ``model`` at.

    Args:
        model: a network with an input (N, 3, height, width).
        asked_hw_px: what the caller wants, or None; must agree with extents that are fixed.
        default_hw_px: for a network that leaves them free, when the caller says nothing.

    Raises:
        PerceptionError: for a size that is no two whole numbers ≥ 1 or not the network's, and for
            a free one that nobody gives.
    """
    fixed = model.inputs[0].shape[2:]
    asked = None if asked_hw_px is None else _checked(asked_hw_px)
    size = []
    for axis, extent in enumerate(fixed):
        wanted = None if asked is None else asked[axis]
        if extent is not None and wanted is not None and wanted != extent:
            raise PerceptionError(
                f"{model.name} takes an input of {fixed[0]} x {fixed[1]} pixels (height x width), "
                f"got input_size_hw_px={asked}"
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


def _checked(asked_hw_px: Any) -> tuple[int, int]:
    try:
        height, width = (int(side) for side in asked_hw_px)
        exact = [height, width] == list(asked_hw_px)
    except (TypeError, ValueError):
        exact = False
    if not exact or height < 1 or width < 1:
        raise PerceptionError(
            "input_size_hw_px must be (height, width), two whole numbers of pixels of at least 1, "
            f"got {asked_hw_px!r:.80}"
        )
    return height, width
