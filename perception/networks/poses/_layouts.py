"""Layouts of pose networks, recognised from the shapes of the outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from numpy.typing import NDArray

from ...arrays import finite_number
from ...errors import PerceptionError
from .._model import OnnxModel, output_shapes
from ._simcc import Z_RANGE_M

_KNOWN: Final = (
    "RTMPose and RTMW: simcc_x (N, K, s * width), simcc_y (N, K, s * height); "
    "RTMW3D: simcc_z (N, K, depth bins) beside them; K = 17 (COCO) or 133 (COCO-WholeBody)"
)
_KEYPOINTS: Final = {17: "coco", 133: "coco_wholebody"}
_AXES: Final = ("simcc_x", "simcc_y", "simcc_z")


@dataclass(frozen=True, slots=True)
class PoseLayout:
    """Layout of a pose network's outputs.

    Attributes:
        keypoints: name of the keypoint layout: ``"coco"`` or ``"coco_wholebody"``.
        axes: indices of the outputs x, y and, if there is one, z.
        split_ratio: bins per pixel of the input along x and y.
        z_range_m: half the depth that the z axis spans.
    """

    keypoints: str
    axes: tuple[int, ...]
    split_ratio: float
    z_range_m: float

    @property
    def has_depth(self) -> bool:
        """True if the network gives the depths of the keypoints."""
        return len(self.axes) == 3


def recognise(
    model: OnnxModel, outputs: Sequence[NDArray[Any]], height_px: int, width_px: int
) -> PoseLayout:
    """Recognise the layout of a pose network from the outputs of a trial run.

    Outputs called simcc_x, simcc_y and simcc_z are found by their names; outputs with other names
    are taken in this order.

    Raises:
        PerceptionError: for an unknown layout; the message says what was found and what is known.
    """

    def refusal(reason: str) -> PerceptionError:
        return PerceptionError(
            f"{model.name} is not a pose network of a known layout: {reason}. Found input "
            f"(N, 3, {height_px}, {width_px}) -> {output_shapes(model, outputs)}. Known: {_KNOWN}"
        )

    if len(outputs) not in (2, 3) or any(output.ndim != 3 for output in outputs):
        raise refusal("it does not have two or three outputs (N, K, bins)")
    names = [tensor.name for tensor in model.outputs]
    axes = tuple(range(len(outputs)))
    if set(names) == set(_AXES[: len(names)]):
        axes = tuple(names.index(axis) for axis in _AXES[: len(names)])
    count = {output.shape[1] for output in outputs}
    if len(count) != 1 or not count <= set(_KEYPOINTS):
        raise refusal(f"{' and '.join(map(str, sorted(count)))} keypoints are not known")
    bins_x, bins_y = (outputs[axis].shape[2] for axis in axes[:2])
    split = bins_x / width_px
    if split < 1.0 or bins_y != split * height_px:
        raise refusal(
            f"{bins_x} bins along x and {bins_y} along y are not the same number per pixel"
        )
    if min(output.shape[2] for output in outputs) < 3:
        raise refusal("an axis has fewer than three bins")
    z_range_m = metadata_number(model, "z_range_m", Z_RANGE_M)
    return PoseLayout(_KEYPOINTS[count.pop()], axes, split, z_range_m)


def metadata_number(model: OnnxModel, key: str, default: float) -> float:
    """Return a number > 0 from the metadata, which awarenav's exports have, or the default."""
    if key not in model.metadata:
        return default
    return finite_number(
        f"metadata {key} of {model.name}",
        model.metadata[key],
        minimum=0.0,
        exclusive_minimum=True,
    )
