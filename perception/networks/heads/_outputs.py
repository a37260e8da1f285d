"""Layouts of head pose networks, and their outputs in the paper's head frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...arrays import FloatArray
from ...errors import PerceptionError
from .._images import (
    IMAGENET_MEAN_RGB,
    IMAGENET_STD_RGB,
    PixelFormat,
    input_batch,
    input_dtype,
    input_size,
)
from .._model import OnnxModel

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


def _columns() -> dict[str, slice]:
    """Return the columns of each output of awarenav's layout in a row of all outputs."""
    ends = np.cumsum([math.prod(shape) for shape in AWARENAV_OUTPUTS.values()]).tolist()
    return {
        name: slice(end - math.prod(shape), end)
        for (name, shape), end in zip(AWARENAV_OUTPUTS.items(), ends, strict=True)
    }


_COLUMNS: Final = _columns()
_ROW_LENGTH: Final = max(columns.stop for columns in _COLUMNS.values())
_CENTRE, _SIDE, _HEAD = _COLUMNS["centre"], _COLUMNS["side_m"].start, _COLUMNS["head"].start
_ROTATION: Final = _COLUMNS["rotation"]
_IDENTITY: Final = np.eye(3)
# Largest error of a rotation that comes from rounding to float32.
_ROUNDING: Final = 1e-5
# Full-range networks have mean absolute errors of 3.4°–4.9° per axis on AFLW2000 (Hempel et al.
# 2022, table 1), standard deviations of about 6°. This is larger, because their forward axis is
# that of a face model instead of the Frankfurt horizontal, and heads that face away are harder.
_FULL_RANGE_STD_RAD: Final = float(np.radians(10.0))
# 3DDFA's model frame (x to the person's left, y up, z forward) to the paper's (x down, y forward,
# z right), and its image frame (y up, z to the viewer) to the camera's (y down, z away).
_FACE_MODEL_FROM_HEAD: Final = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_CAMERA_FROM_FACE_IMAGE: Final = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True, slots=True, eq=False)
class HeadOutputs:
    """Checked outputs of a network for N crops, in float64.

    ``rotation_ray_head`` (N, 3, 3) turns from the paper's head frame to ray axes;
    ``covariance_ray`` (N, 3, 3) is in ray axes. The others have the shapes of
    :data:`~._layouts.AWARENAV_OUTPUTS` after N, and are None for a full-range network.
    """

    rotation_ray_head: FloatArray
    covariance_ray: FloatArray
    keypoints: FloatArray | None = None
    keypoints_std: FloatArray | None = None
    visible: FloatArray | None = None
    centre: FloatArray | None = None
    side_m: FloatArray | None = None
    side_log_std: FloatArray | None = None
    head: FloatArray | None = None


def read_rows(layout: HeadLayout, model: OnnxModel, arrays: list[NDArray[Any]]) -> FloatArray:
    """Check the outputs for N crops and join them to one float64 row per crop.

    Raises:
        PerceptionError: for non-finite numbers, a wrong number of them, and a size ≤ 0.
    """
    parts = arrays
    if layout.is_awarenav:
        named = {tensor.name: array for tensor, array in zip(model.outputs, arrays, strict=True)}
        parts = [named[name] for name in AWARENAV_OUTPUTS]
    rows = np.concatenate(
        [part.reshape(len(part), -1) for part in parts], axis=1, dtype=np.float64, casting="unsafe"
    )
    if layout.is_awarenav and rows.shape[1] != _ROW_LENGTH:
        raise PerceptionError(
            f"{model.name} returned {rows.shape[1]} numbers per crop, wanted {_ROW_LENGTH}"
        )
    if not np.isfinite(rows).all():
        bad = [
            tensor.name
            for tensor, array in zip(model.outputs, arrays, strict=True)
            if not np.isfinite(array).all()
        ]
        raise PerceptionError(f"{model.name} returned NaN or infinite numbers in {bad[0]!r}")
    if layout.is_awarenav and rows[:, _SIDE].min() <= 0.0:
        raise PerceptionError(f"{model.name} returned a side_m of 0 or less: {rows[:, _SIDE]}")
    return rows


def read_placement(rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return centres (N, 2), sides in metres (N,) and probabilities of a head (N,).

    ``rows`` are those of a network of awarenav's layout.
    """
    return rows[:, _CENTRE], rows[:, _SIDE], rows[:, _HEAD]


def read_rotations(model: OnnxModel, rows: FloatArray) -> FloatArray:
    """Return the rotations (N, 3, 3) from the paper's head frame to ray axes.

    ``rows`` are those of a network of awarenav's layout.

    Raises:
        PerceptionError: for matrices that are not rotations.
    """
    return nearest_rotations(model, rows[:, _ROTATION].reshape(-1, 3, 3))


def read_outputs(layout: HeadLayout, model: OnnxModel, rows: FloatArray) -> HeadOutputs:
    """Convert the rows of :func:`read_rows` to outputs.

    Raises:
        PerceptionError: for matrices that are not rotations.
    """
    if not layout.is_awarenav:
        return _read_full_range(model, rows.reshape(len(rows), *layout.output_shape))
    named = {
        name: rows[:, _COLUMNS[name]].reshape(len(rows), *shape)
        for name, shape in AWARENAV_OUTPUTS.items()
    }
    covariance = named["rotation_covariance"]
    return HeadOutputs(
        read_rotations(model, rows),
        0.5 * (covariance + covariance.swapaxes(1, 2)),
        named["keypoints"],
        np.abs(named["keypoints_std"]),
        np.minimum(np.maximum(named["visible"], 0.0), 1.0),
        named["centre"],
        named["side_m"],
        np.abs(named["side_log_std"]),
        np.minimum(np.maximum(named["head"], 0.0), 1.0),
    )


def _read_full_range(model: OnnxModel, output: FloatArray) -> HeadOutputs:
    """Convert rotations of the 6DRepNet kind to the paper's head frame.

    Their matrix is Rz(roll) Ry(yaw) Rx(pitch) of the angles of 300W-LP. This is the transpose of
    3DDFA's rotation from its face model to the image (x right, y up, z to the viewer); the axes
    that 6DRepNet's own code draws agree. Six numbers are the first two columns before
    orthonormalisation (Zhou et al. 2019). The angles are relative to the ray through the crop's
    centre.
    """
    if output.shape[-1] == 6:
        first = _unit(model, output[:, :3])
        third = _unit(model, np.cross(first, output[:, 3:]))
        output = np.stack([first, np.cross(third, first), third], axis=2)
    face = np.swapaxes(nearest_rotations(model, output), 1, 2)
    rotation = _CAMERA_FROM_FACE_IMAGE @ face @ _FACE_MODEL_FROM_HEAD
    covariance = np.broadcast_to(_FULL_RANGE_STD_RAD**2 * np.eye(3), rotation.shape)
    return HeadOutputs(rotation, covariance)


def nearest_rotations(model: OnnxModel, matrices: FloatArray) -> FloatArray:
    """Return the rotations (N, 3, 3) nearest to the matrices of a network.

    Raises:
        PerceptionError: for matrices too far from a rotation: a singular value more than 0.05 from
            1, or a negative determinant.
    """
    # For a network that orthonormalises in float32, one Newton step of the polar decomposition
    # gives the rotation in float64.
    gram = matrices @ matrices.swapaxes(1, 2)
    if np.abs(gram - _IDENTITY).max() < _ROUNDING and all(
        map(_has_positive_determinant, matrices.tolist())
    ):
        return np.asarray(0.5 * (3.0 * _IDENTITY - gram) @ matrices)
    left, singular, right = np.linalg.svd(matrices)
    nearest = left @ right
    if np.any(np.abs(singular - 1.0) > 0.05) or np.any(np.linalg.det(nearest) < 0.0):
        raise PerceptionError(
            f"{model.name} returned matrices that are not rotations (singular values "
            f"{singular.min():g} to {singular.max():g})"
        )
    return np.asarray(nearest)


def _has_positive_determinant(matrix: list[list[float]]) -> bool:
    """Return True for a determinant > 0; in plain Python, which is faster than LAPACK here."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > 0.0


def _unit(model: OnnxModel, vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    if np.any(length < 1e-6):
        raise PerceptionError(f"{model.name} returned six numbers that span no rotation")
    return np.asarray(vectors / length)
