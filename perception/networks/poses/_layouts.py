"""Layouts of pose networks: what all of them give, and the message about one that is not known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Protocol

from numpy.typing import NDArray

from ...arrays import FloatArray, finite_number
from ...errors import PerceptionError
from .._model import OnnxModel, output_shapes

_KNOWN: Final = (
    "RTMPose and RTMW: simcc_x (N, K, s * width), simcc_y (N, K, s * height); "
    "RTMW3D: simcc_z (N, K, depth bins) beside them; K = 17 (COCO) or 133 (COCO-WholeBody); "
    "MoveNet: (1, size, size, 3) int32, uint8 or float32 -> (1, 1, 17, 3)"
)


class PoseLayout(Protocol):
    """Layout of a pose network's outputs."""

    @property
    def keypoints(self) -> str:
        """Name of the keypoint layout: ``"coco"`` or ``"coco_wholebody"``."""

    @property
    def has_depth(self) -> bool:
        """True if the network gives the depths of the keypoints."""

    def decode(
        self, outputs: Sequence[NDArray[Any]]
    ) -> tuple[FloatArray, FloatArray | None, FloatArray]:
        """Return the keypoints of n crops from the network's outputs.

        Returns:
            Pixels (n, K, 2) of the crop, whose first pixel has its centre at (0, 0); depths (n, K)
            in metres from the mid-hip, or None; scores (n, K) in [0, 1], 0 where a value is not
            finite.
        """


def unknown_layout(
    model: OnnxModel, image: str, outputs: Sequence[NDArray[Any]], reason: str
) -> PerceptionError:
    """Return the error about an unknown layout: why, what was found, and what is known.

    Args:
        model: the network.
        image: shape of its input.
        outputs: of a trial run.
        reason: why it is none of the known ones.
    """
    return PerceptionError(
        f"{model.name} is not a pose network of a known layout: {reason}. Found input "
        f"{image} -> {output_shapes(model, outputs)}. Known: {_KNOWN}"
    )


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
