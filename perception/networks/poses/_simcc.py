"""SimCC pose networks: the layouts of their outputs, in which a keypoint is a peak along each axis.

SimCC (Li et al., ECCV 2022) gives each keypoint one row of bins per axis, with several bins per
pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...arrays import FloatArray
from .._model import OnnxModel
from ._layouts import metadata_number, unknown_layout

#: Half the depth that RTMW3D's z axis spans about the mid-hip, in metres: ``z_range`` of its codec.
Z_RANGE_M: Final = 2.1744869

_NEIGHBOURS: Final = np.array([-1, 0, 1])


def simcc_peaks(axes: Sequence[NDArray[Any]]) -> tuple[FloatArray, FloatArray]:
    """Return position and height of the peak of each row; positions lie between the bins.

    A parabola through the highest bin and its two neighbours refines the position. It is fitted to
    the logarithms where all three values are positive, which is exact for the Gaussians that such
    networks are trained on, else to the values. A peak that is not finite has position 0 and
    height 0.

    Args:
        axes: activations (N, K, bins) of each axis; the number of bins may differ.

    Returns:
        Positions (axes, N, K) in bins, and values (axes, N, K) of the highest bins.
    """
    shape = (len(axes), *axes[0].shape[:2])
    rows = shape[1] * shape[2]
    starts, last = _row_starts(rows, tuple(activations.shape[2] for activations in axes))
    # Few and large NumPy calls: with 17 keypoints, the number of calls determines the run time.
    top = np.array([activations.argmax(axis=2) for activations in axes]).reshape(-1, rows)
    around = (top + starts)[..., None] + _NEIGHBOURS  # argmax finds the first NaN if there is one
    values = np.array(
        [
            activations.take(place, mode="clip")
            for activations, place in zip(axes, around, strict=True)
        ],
        dtype=np.float64,
    )
    height = values[..., 1]
    with np.errstate(all="ignore"):
        curve = np.log(values)
        if not values.min() > 0.0:
            curve = np.where(values.min(axis=2, keepdims=True) > 0.0, curve, values)
        before, middle, after = curve[..., 0], curve[..., 1], curve[..., 2]
        shift = 0.5 * (before - after) / (before - 2.0 * middle + after)
    # At either end of an axis, and where the three values make no peak, the bin itself is the
    # position. 0.501: midway between two bins, rounding may shift it slightly past the middle.
    inner = (np.abs(shift) < 0.501) & (top > 0) & (top < last)
    place = top + np.where(inner, shift, 0.0)
    good = np.isfinite(height)
    if not good.all():
        place, height = np.where(good, place, 0.0), np.where(good, height, 0.0)
    return place.reshape(shape), height.reshape(shape)


@lru_cache(maxsize=8)
def _row_starts(rows: int, bins: tuple[int, ...]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the flat index of each row's first bin (axes, rows) and each last bin (axes, 1)."""
    counts = np.array(bins, dtype=np.intp)[:, None]
    return counts * np.arange(rows), counts - 1


def simcc_depth_m(places: FloatArray, bins: int, range_m: float = Z_RANGE_M) -> FloatArray:
    """Convert positions along z from bins to metres from the mid-hip, away from the camera.

    ``z = (place / split / (depth / 2) − 1) · 2.1744869`` with depth = bins / split; the split ratio
    cancels.
    """
    return np.asarray((2.0 / bins * range_m) * places - range_m)


def simcc_confidence(heights: FloatArray) -> FloatArray:
    """Return the confidence (N, K) of keypoints in [0, 1]: the lower of the heights along x and y.

    The height along z does not count, as in OpenMMLab's ``get_simcc_maximum`` for two axes and for
    three; but a z that is not finite, for which :func:`simcc_peaks` gives a height of 0, does.

    Args:
        heights: (2 or 3, N, K) heights of the peaks along x, y and z.
    """
    possible = (heights[2:] != 0.0).all(axis=0)
    return np.asarray(possible * np.minimum(np.maximum(heights[:2].min(axis=0), 0.0), 1.0))


_KEYPOINTS: Final = {17: "coco", 133: "coco_wholebody"}
_AXES: Final = ("simcc_x", "simcc_y", "simcc_z")


@dataclass(frozen=True, slots=True)
class SimccLayout:
    """Layout of a SimCC network's outputs.

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

    def decode(
        self, outputs: Sequence[NDArray[Any]]
    ) -> tuple[FloatArray, FloatArray | None, FloatArray]:
        """Return pixels (n, K, 2) of the crop, depths (n, K) or None, and scores (n, K)."""
        axes = [outputs[axis] for axis in self.axes]
        places, heights = simcc_peaks(axes)
        depths = None
        if self.has_depth:
            depths = simcc_depth_m(places[2], axes[2].shape[2], self.z_range_m)
        pixels = places[:2].transpose(1, 2, 0) / self.split_ratio
        return pixels, depths, simcc_confidence(heights)


def recognise_simcc(
    model: OnnxModel, outputs: Sequence[NDArray[Any]], height_px: int, width_px: int
) -> SimccLayout:
    """Recognise the layout of a SimCC network from the outputs of a trial run.

    Outputs called simcc_x, simcc_y and simcc_z are found by their names; outputs with other names
    are taken in this order.

    Raises:
        PerceptionError: for an unknown layout; the message says what was found and what is known.
    """
    refusal = partial(unknown_layout, model, f"(N, 3, {height_px}, {width_px})", outputs)
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
    return SimccLayout(_KEYPOINTS[count.pop()], axes, split, z_range_m)
