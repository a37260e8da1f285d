"""RetinaFace with MobileNet0.25: a face and five points of it, from a checkpoint of PyTorch.

It finds faces from about ten pixels of width, of which MediaPipe's mesh misses half below twenty.

Contract of ``mobilenet0.25_Final.pth``: a pickle of PyTorch before version 1.6 with the weights of
``RetinaFace`` (stages of a MobileNet of a quarter of the width, a feature pyramid of 64 channels,
SSH context modules and heads for two anchors at each place of strides 8, 16 and 32). Its graph is
written here as ONNX. Input: BGR minus (104, 117, 123). Output for each anchor: a box (centre, size)
relative to the anchor, the logits of background and face, and right eye, left eye, nose, right and
left corner of the mouth, seen from the person.

Source: Deng et al., "RetinaFace: Single-stage Dense Face Localisation in the Wild", 2019; the
implementation of github.com/biubug6/Pytorch_Retinaface, trained on WIDER FACE.
"""

from __future__ import annotations

import io
import os
import pickle
import struct
from collections import OrderedDict
from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from ..arrays import FloatArray, ImageRgb
from ._model import OnnxModel, read_as
from ._settings import OnnxSettings
from .heads import head_crop

# A face of ten pixels, a quarter of the square about its head, is four times as large here.
_SIDE_PX: Final = 160
_MIN_SIDE_PX: Final = 8.0
#: Smallest probability of a face.
_FACE: Final = 0.9
_MEAN_BGR: Final = (104.0, 117.0, 123.0)
_STRIDES: Final = (8, 16, 32)
_ANCHORS_PX: Final = ((16, 32), (64, 128), (256, 512))
_CENTRE_VARIANCE: Final = 0.1
_LEAK: Final = 0.1
_NORMALISED_EPSILON: Final = 1e-5
_MAGIC: Final = 0x1950A86A20F9469CFC6C
_STORED_TYPES: Final = {"FloatStorage": "<f4", "LongStorage": "<i8"}


class RetinaFace:
    """The most probable face in a square of a picture; the contract is in the module's text.

    Args:
        path: the ``.pth`` file, or its bytes.
        settings: threads.
        sha256: expected SHA-256 of the file, 64 hexadecimal digits; None takes any.

    Raises:
        PerceptionError: for a file that cannot be read, and for another network.
    """

    def __init__(
        self,
        path: str | os.PathLike[str] | bytes,
        *,
        settings: OnnxSettings | None = None,
        sha256: str | None = None,
    ) -> None:
        what = "RetinaFace's mobilenet0.25_Final.pth"
        _, graph = read_as(what, _onnx_of, path, sha256)
        self._model = OnnxModel(graph, settings=settings)

    def find(
        self, image_rgb: ImageRgb, centre_px: FloatArray, side_px: float, farthest_px: float
    ) -> FloatArray | None:
        """Return the points (5, 2) of the most probable face in a square; None without a face.

        They are u and v of right eye, left eye, nose, and right and left corner of the mouth. The
        arguments are those of :meth:`~perception.networks.faces.FaceMesh.find`.
        """
        if not (side_px >= _MIN_SIDE_PX and np.isfinite(centre_px).all()):
            return None
        crop = head_crop(image_rgb, centre_px, side_px, _SIDE_PX, np.eye(2))
        planes = (crop[..., ::-1] - np.array(_MEAN_BGR, np.float32)).transpose(2, 0, 1)
        (found,) = self._model.run({"image": np.ascontiguousarray(planes[None])})
        logits = found[0, :, 4:6].astype(np.float64)
        scores = expit(logits[:, 1] - logits[:, 0])
        middles = _PRIORS[:, :2] - 0.5 * _SIDE_PX
        near = (middles**2).sum(axis=1) <= (farthest_px * _SIDE_PX / side_px) ** 2
        best = int(np.where(near, scores, 0.0).argmax())
        points = found[0, best, 6:].reshape(5, 2).astype(np.float64)
        if not (near[best] and scores[best] >= _FACE and np.isfinite(points).all()):
            return None
        x, y, size = _PRIORS[best].tolist()
        in_crop = (x, y) + points * (_CENTRE_VARIANCE * size)
        # The network counts from the corner, image points from the middle of the first pixel.
        in_image: FloatArray = centre_px + (in_crop - 0.5 * _SIDE_PX) * (side_px / _SIDE_PX)
        return in_image


# (N, 3) middle and side of each anchor, in pixels of the input: places row by row, then sizes.
_PRIORS: Final = np.array(
    [
        ((column + 0.5) * stride, (row + 0.5) * stride, size)
        for stride, sizes in zip(_STRIDES, _ANCHORS_PX, strict=True)
        for row in range(_SIDE_PX // stride)
        for column in range(_SIDE_PX // stride)
        for size in sizes
    ]
)


def _onnx_of(content: bytes) -> bytes:
    """Return the network of a checkpoint as ONNX."""
    graph = _Graph(_tensors(content))
    graph.retinaface()
    return graph.onnx()


class _Pickle(pickle.Unpickler):
    """The pickle of a state dictionary, of which nothing else than tensors is made."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return lambda storage, start, shape, *_: (storage, start, shape)
        if module == "torch" and name in _STORED_TYPES:
            return _STORED_TYPES[name]
        raise pickle.UnpicklingError(f"{module}.{name} is no part of a network's weights")

    def persistent_load(self, pid: Any) -> Any:
        _, dtype, key, _, count, *_ = pid
        return dtype, key, count


def _tensors(content: bytes) -> dict[str, NDArray[Any]]:
    """Return the tensors of a checkpoint by their names, which may begin with ``module.``."""
    file = io.BytesIO(content)
    if _Pickle(file).load() != _MAGIC:
        raise ValueError("it has another format")
    _Pickle(file).load()  # version
    _Pickle(file).load()  # byte order and sizes of numbers
    listed = _Pickle(file).load()
    storages = {storage[1]: storage[0] for storage, *_ in listed.values()}
    values = {}
    for key in _Pickle(file).load():
        (count,) = struct.unpack("<q", file.read(8))
        dtype = np.dtype(storages[key])
        values[key] = np.frombuffer(file.read(count * dtype.itemsize), dtype)
    return {
        name.removeprefix("module."): values[key][start:][: int(np.prod(shape))].reshape(shape)
        for name, ((_, key, _), start, shape) in listed.items()
    }


class _Graph:
    """The graph as ONNX, built from its weights; tensors are named as they come."""

    def __init__(self, weights: Mapping[str, NDArray[Any]]) -> None:
        self._weights = weights
        self._nodes: list[bytes] = []
        self._initializers: list[bytes] = []

    def retinaface(self) -> None:
        body, levels = "image", []
        for stage, blocks in ((1, 6), (2, 6), (3, 2)):
            for block in range(blocks):
                name = f"body.stage{stage}.{block}"
                stride = 2 if (stage, block) in _HALVED else 1
                body = self._conv(body, f"{name}.0", f"{name}.1", stride)
                if (stage, block) != (1, 0):
                    body = self._conv(body, f"{name}.3", f"{name}.4")
            levels.append(body)
        fine, middle, coarse = (
            self._conv(level, f"fpn.output{row}.0", f"fpn.output{row}.1")
            for row, level in enumerate(levels, 1)
        )
        middle = self._conv(self._sum(middle, coarse), "fpn.merge2.0", "fpn.merge2.1")
        fine = self._conv(self._sum(fine, middle), "fpn.merge1.0", "fpn.merge1.1")
        outputs = []
        for row, level in enumerate((fine, middle, coarse)):
            context = self._context(level, f"ssh{row + 1}")
            heads = [
                self._rows(self._conv(context, f"{head}.{row}.conv1x1", leak=None), extent)
                for head, extent in (("BboxHead", 4), ("ClassHead", 2), ("LandmarkHead", 10))
            ]
            outputs.append(self._node("Concat", *heads, axis=2))
        self._node("Concat", *outputs, axis=1, output="found")

    def _context(self, level: str, name: str) -> str:
        def conv(source: str, part: str, leak: float | None = None) -> str:
            return self._conv(source, f"{name}.{part}.0", f"{name}.{part}.1", leak=leak)

        wide = conv(level, "conv5X5_1", _LEAK)
        parts = (
            conv(level, "conv3X3"),
            conv(wide, "conv5X5_2"),
            conv(conv(wide, "conv7X7_2", _LEAK), "conv7x7_3"),
        )
        return self._node("Relu", self._node("Concat", *parts, axis=1))

    def _sum(self, level: str, coarse: str) -> str:
        scales = self._initializer(np.array([1.0, 1.0, 2.0, 2.0], np.float32))
        larger = self._node(
            "Resize", coarse, "", scales,
            mode="nearest", coordinate_transformation_mode="asymmetric", nearest_mode="floor",
        )  # fmt: skip
        return self._node("Add", level, larger)

    def _rows(self, level: str, extent: int) -> str:
        shape = self._initializer(np.array([1, -1, extent], np.int64))
        return self._node("Reshape", self._node("Transpose", level, perm=(0, 2, 3, 1)), shape)

    def _conv(
        self,
        source: str,
        name: str,
        normalised: str | None = None,
        stride: int = 1,
        leak: float | None = _LEAK,
    ) -> str:
        """Add a convolution with the batch normalisation after it folded in, and its leaky ReLU."""
        kernel = self._weights[f"{name}.weight"].astype(np.float64)
        if normalised is None:
            bias = self._weights[f"{name}.bias"].astype(np.float64)
        else:
            gain, shift, mean, variance = (
                self._weights[f"{normalised}.{part}"].astype(np.float64)
                for part in ("weight", "bias", "running_mean", "running_var")
            )
            gain = gain / np.sqrt(variance + _NORMALISED_EPSILON)
            kernel, bias = kernel * gain[:, None, None, None], shift - gain * mean
        inputs = [self._initializer(each.astype(np.float32)) for each in (kernel, bias)]
        side = kernel.shape[2]
        convolved = self._node(
            "Conv", source, *inputs,
            group=len(kernel) if kernel.shape[1] == 1 else 1,
            kernel_shape=(side, side), pads=(side // 2,) * 4, strides=(stride, stride),
        )  # fmt: skip
        return convolved if leak is None else self._node("LeakyRelu", convolved, alpha=leak)

    def _node(self, operator: str, *inputs: str, output: str = "", **attributes: Any) -> str:
        output = output or f"t{len(self._nodes)}"
        self._nodes.append(
            b"".join(_text(1, each) for each in inputs)
            + _text(2, output)
            + _text(4, operator)
            + b"".join(_field(5, _attribute(*each)) for each in attributes.items())
        )
        return output

    def _initializer(self, values: NDArray[Any]) -> str:
        name = f"w{len(self._initializers)}"
        self._initializers.append(
            b"".join(_number(1, extent) for extent in values.shape)
            + _number(2, 1 if values.dtype == np.float32 else 7)
            + _text(8, name)
            + _field(9, values.tobytes())
        )
        return name

    def onnx(self) -> bytes:
        """Return the file. The numbers of fields are those of onnx.proto3."""
        graph = (
            _fields(1, self._nodes)
            + _text(2, "retinaface")
            + _fields(5, self._initializers)
            + _field(11, _tensor_type("image", (1, 3, _SIDE_PX, _SIDE_PX)))
            + _field(12, _tensor_type("found", (1, len(_PRIORS), 16)))
        )
        return _number(1, 8) + _field(7, graph) + _field(8, _number(2, 13))


# Stages and blocks of the MobileNet whose convolution halves the picture.
_HALVED: Final = {(1, 0), (1, 2), (1, 4), (2, 0), (3, 0)}


def _varint(value: int) -> bytes:
    digits = b""
    while value > 0x7F:
        digits += bytes((value & 0x7F | 0x80,))
        value >>= 7
    return digits + bytes((value,))


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _field(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(content)) + content


def _fields(field: int, contents: Iterable[bytes]) -> bytes:
    return b"".join(_field(field, each) for each in contents)


def _text(field: int, text: str) -> bytes:
    return _field(field, text.encode())


def _attribute(name: str, value: Any) -> bytes:
    if isinstance(value, float):
        return _text(1, name) + _varint(2 << 3 | 5) + struct.pack("<f", value) + _number(20, 1)
    if isinstance(value, int):
        return _text(1, name) + _number(3, value) + _number(20, 2)
    if isinstance(value, str):
        return _text(1, name) + _text(4, value) + _number(20, 3)
    return _text(1, name) + b"".join(_number(8, each) for each in value) + _number(20, 7)


def _tensor_type(name: str, shape: tuple[int, ...]) -> bytes:
    extents = b"".join(_field(1, _number(1, extent)) for extent in shape)
    return _text(1, name) + _field(2, _field(1, _number(1, 1) + _field(2, extents)))
