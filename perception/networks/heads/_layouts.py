"""Head pose networks: which layouts are known, and what their numbers mean."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...arrays import FloatArray
from ...errors import PerceptionError
from .._input_size import batch_of, input_size
from .._pixels import PixelFormat, input_dtype
from .._session import OnnxModel

_OWN_OUTPUTS: Final[dict[str, tuple[int, ...]]] = {
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


def _columns() -> dict[str, slice]:
    """Which columns of a row each own output takes, in the order of :data:`_OWN_OUTPUTS`."""
    ends = np.cumsum([math.prod(tail) for tail in _OWN_OUTPUTS.values()]).tolist()
    return {
        name: slice(end - math.prod(tail), end)
        for (name, tail), end in zip(_OWN_OUTPUTS.items(), ends, strict=True)
    }


_COLUMNS: Final = _columns()
_WIDTH: Final = max(columns.stop for columns in _COLUMNS.values())
_CENTRE, _SIDE, _HEAD = _COLUMNS["centre"], _COLUMNS["side_m"].start, _COLUMNS["head"].start
_KNOWN: Final = (
    "known are awarenav's own head network (input (N, 3, 64, 64); outputs "
    + ", ".join(_OWN_OUTPUTS)
    + ") and full-range networks of the 6DRepNet kind (input (N, 3, 224, 224); one output "
    "(N, 3, 3) or (N, 6))"
)
_OWN_LAYOUT: Final = "1"
_IDENTITY: Final = np.eye(3)
_ROUNDING: Final = 1e-5

_IMAGENET: Final = ((123.675, 116.28, 103.53), (58.395, 57.12, 57.375))
_FULL_RANGE_SIZE_PX: Final = 224
# Their training crops span about a head and its hair: the landmarks of 300W-LP with half as much
# again about them.
_FULL_RANGE_SIDE_M: Final = 0.26
# Mean absolute errors of 3.4°–4.9° an axis on AFLW2000 (Hempel et al. 2022, table 1) are standard
# deviations of about 6°; their forward axis is that of a face model, not the Frankfurt horizontal,
# and heads that face away are harder.
_FULL_RANGE_STD_RAD: Final = float(np.radians(10.0))
# 3DDFA's model frame (x to the person's left, y up, z forward) to the paper's (x down, y forward,
# z right), and its image frame (y up, z to the viewer) to the camera's (y down, z away).
_FACE_MODEL_FROM_HEAD: Final = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_CAMERA_FROM_FACE_IMAGE: Final = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True, slots=True)
class HeadLayout:
    """What a network takes and gives.

    Attributes:
        own: whether it is awarenav's own layout; a full-range network of the 6DRepNet kind gives a
            rotation and nothing else.
        size_px: side of its square input.
        crop_side_m: what that side should measure at the head.
        pixels: how it wants its pixels.
        batch: extent of its batch axis; None when it is free.
        tail: extents of the one output of a full-range network.
    """

    own: bool
    size_px: int
    crop_side_m: float
    pixels: PixelFormat
    batch: int | None
    tail: tuple[int | None, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class HeadOutputs:
    """What a network says of N crops, checked; shapes as in its layout, in float64.

    All but the rotation and its covariance are None for a network that gives nothing else.
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


def recognise(model: OnnxModel) -> HeadLayout:
    """Recognise a network from its shapes and metadata.

    Raises:
        PerceptionError: for a layout that is not known, with what was found and what is known.
    """
    batch = batch_of(model)
    dtype = input_dtype(model.inputs[0], model.name)
    shapes = {tensor.name: tensor.shape for tensor in model.outputs}
    if all(
        name in shapes and len(shapes[name]) == len(tail) + 1 and _agrees(shapes[name][1:], tail)
        for name, tail in _OWN_OUTPUTS.items()
    ):
        layout = model.metadata.get("awarenav_layout", _OWN_LAYOUT)
        if layout != _OWN_LAYOUT:
            raise PerceptionError(
                f"{model.name} is an awarenav head network of layout {layout}; this version reads "
                f"layout {_OWN_LAYOUT}"
            )
        height, width = input_size(model, None, (64, 64))
        mean, std = (_number(model, key, value) for key, value in (("mean", 120), ("std", 60)))
        if height == width and std > 0.0:
            pixels = PixelFormat((mean,) * 3, (std,) * 3, dtype=dtype)
            side_m = _number(model, "crop_side_m", 0.40)
            return HeadLayout(True, height, side_m, pixels, batch)
    tails = [shape[1:] for shape in shapes.values() if shape]
    if len(tails) == 1 and tails[0] in ((3, 3), (6,)):
        size = (_FULL_RANGE_SIZE_PX, _FULL_RANGE_SIZE_PX)
        if input_size(model, None, size) == size:
            pixels = PixelFormat(*_IMAGENET, dtype=dtype)
            side_m = _FULL_RANGE_SIDE_M
            return HeadLayout(False, _FULL_RANGE_SIZE_PX, side_m, pixels, batch, tails[0])
    raise PerceptionError(
        f"{model.name} is no head pose network of a known layout: found {model.layout}; {_KNOWN}"
    )


def read_rows(layout: HeadLayout, model: OnnxModel, arrays: list[NDArray[Any]]) -> FloatArray:
    """Check what a network returned for N crops and put it side by side, one row a crop, float64.

    Raises:
        PerceptionError: for numbers that are not finite and for sizes that cannot be.
    """
    parts = arrays
    if layout.own:
        named = {tensor.name: array for tensor, array in zip(model.outputs, arrays, strict=True)}
        parts = [named[name] for name in _OWN_OUTPUTS]
    rows = np.concatenate(
        [part.reshape(len(part), -1) for part in parts], axis=1, dtype=np.float64, casting="unsafe"
    )
    if layout.own and rows.shape[1] != _WIDTH:
        raise PerceptionError(
            f"{model.name} returned {rows.shape[1]} numbers a crop, wanted {_WIDTH}"
        )
    if not np.isfinite(rows).all():
        bad = [
            tensor.name
            for tensor, array in zip(model.outputs, arrays, strict=True)
            if not np.isfinite(array).all()
        ]
        raise PerceptionError(f"{model.name} returned NaN or infinite numbers in {bad[0]!r}")
    if layout.own and rows[:, _SIDE].min() <= 0.0:
        raise PerceptionError(f"{model.name} returned a side_m of 0 or less: {rows[:, _SIDE]}")
    return rows


def where_it_is(rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of an own network's rows: centres (N, 2), sides in metres (N,) and whether heads (N,)."""
    return rows[:, _CENTRE], rows[:, _SIDE], rows[:, _HEAD]


def read_outputs(layout: HeadLayout, model: OnnxModel, rows: FloatArray) -> HeadOutputs:
    """What the rows of :func:`read_rows` mean.

    Raises:
        PerceptionError: for rotations that are none.
    """
    if not layout.own:
        return _full_range(model, rows.reshape(len(rows), *layout.tail))
    named = {
        name: rows[:, _COLUMNS[name]].reshape(len(rows), *tail)
        for name, tail in _OWN_OUTPUTS.items()
    }
    covariance = named["rotation_covariance"]
    return HeadOutputs(
        _orthonormal(model, named["rotation"]),
        0.5 * (covariance + covariance.swapaxes(1, 2)),
        named["keypoints"],
        np.abs(named["keypoints_std"]),
        np.minimum(np.maximum(named["visible"], 0.0), 1.0),
        named["centre"],
        named["side_m"],
        np.abs(named["side_log_std"]),
        np.minimum(np.maximum(named["head"], 0.0), 1.0),
    )


def _full_range(model: OnnxModel, output: FloatArray) -> HeadOutputs:
    """Rotations of the 6DRepNet kind in the paper's head frame.

    Their matrix is Rz(roll) Ry(yaw) Rx(pitch) of the angles of 300W-LP, which is the transpose of
    3DDFA's rotation from its face model to the image (x right, y up, z to the viewer); their own
    drawing of the axes agrees. Six numbers are the first two columns before orthonormalisation
    (Zhou et al. 2019). Angles are those in the crop: relative to the ray through its centre.
    """
    if output.shape[-1] == 6:
        first = _unit(model, output[:, :3])
        third = _unit(model, np.cross(first, output[:, 3:]))
        output = np.stack([first, np.cross(third, first), third], axis=2)
    face = np.swapaxes(_orthonormal(model, output), 1, 2)
    rotation = _CAMERA_FROM_FACE_IMAGE @ face @ _FACE_MODEL_FROM_HEAD
    covariance = np.broadcast_to(_FULL_RANGE_STD_RAD**2 * np.eye(3), rotation.shape)
    return HeadOutputs(rotation, covariance)


def _orthonormal(model: OnnxModel, rotations: FloatArray) -> FloatArray:
    """The nearest rotations (N, 3, 3), after refusing what is none."""
    # A network that has orthonormalised in float32 is one Newton step of the polar decomposition
    # away from float64.
    gram = rotations @ rotations.swapaxes(1, 2)
    if np.abs(gram - _IDENTITY).max() < _ROUNDING and all(map(_keeps_hands, rotations.tolist())):
        return np.asarray(0.5 * (3.0 * _IDENTITY - gram) @ rotations)
    left, singular, right = np.linalg.svd(rotations)
    nearest = left @ right
    if np.any(np.abs(singular - 1.0) > 0.05) or np.any(np.linalg.det(nearest) < 0.0):
        raise PerceptionError(
            f"{model.name} returned matrices that are no rotations (singular values "
            f"{singular.min():g} to {singular.max():g})"
        )
    return np.asarray(nearest)


def _keeps_hands(rotation: list[list[float]]) -> bool:
    """Whether the determinant is above 0; in plain numbers, since LAPACK is slow to wake."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > 0.0


def _unit(model: OnnxModel, vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    if np.any(length < 1e-6):
        raise PerceptionError(f"{model.name} returned six numbers that span no rotation")
    return np.asarray(vectors / length)


def _agrees(shape: tuple[int | None, ...], wanted: tuple[int, ...]) -> bool:
    return all(extent in (None, want) for extent, want in zip(shape, wanted, strict=True))


def _number(model: OnnxModel, key: str, default: float) -> float:
    text = model.metadata.get(key, str(default))
    try:
        return float(text)
    except ValueError:
        raise PerceptionError(
            f"{model.name}: metadata {key!r} must be a number, got {text!r}"
        ) from None
