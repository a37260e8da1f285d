"""Small ONNX graphs in the layouts of detectors, pose and head networks, with known results.

Some return fixed rows. Others depend on the image: the score of a detector's cell is the mean of
one colour in it, all keypoints of a pose network lie at the reddest point, and a head pose network
finds one bright disc on black.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

STRIDES = (8, 16, 32)
MEAN_RGB = np.array([123.675, 116.28, 103.53])
STD_RGB = np.array([58.395, 57.12, 57.375])
_TYPES = {
    "float32": TensorProto.FLOAT,
    "float16": TensorProto.FLOAT16,
    "uint8": TensorProto.UINT8,
    "int32": TensorProto.INT32,
}
# Names of weights in the heads of OpenMMLab's detectors.
RTMDET_HEAD = "bbox_head.rtm_cls.0.weight"
YOLOX_HEAD = "bbox_head.multi_level_conv_obj.0.weight"
#: Diameter of the disc that a head pose network takes for a head.
DISC_M = 0.20


class Graph:
    """Collects nodes and constants and writes a model."""

    def __init__(
        self,
        input_name: str,
        shape: Sequence[int | str],
        *,
        dtype: str = "float32",
        opset: int = 13,
        part: str = "constant",
    ) -> None:
        self._part = part
        self._nodes: list[Any] = []
        self._constants: list[Any] = []
        self._outputs: list[Any] = []
        self._input = helper.make_tensor_value_info(input_name, _TYPES[dtype], list(shape))
        self._opset = opset
        self.pixels = input_name
        if dtype != "float32":
            self.pixels = self.node("Cast", input_name, to=TensorProto.FLOAT)

    def constant(self, values: Any, dtype: Any = np.float32) -> str:
        name = f"{self._part}_{len(self._constants)}"
        self._constants.append(numpy_helper.from_array(np.asarray(values, dtype), name))
        return name

    def node(self, kind: str, *inputs: str, name: str | None = None, **attributes: Any) -> str:
        output = name or f"{kind}_{len(self._nodes)}"
        self._nodes.append(helper.make_node(kind, list(inputs), [output], **attributes))
        return output

    def zero(self) -> str:
        """Return a number that depends on the image, and is 0 for every finite image."""
        mean = self.node("ReduceMean", self.pixels, axes=[1, 2, 3], keepdims=0)
        bounded = self.node("Clip", mean, self.constant(-1.0), self.constant(1.0))
        return self.node("Mul", bounded, self.constant([0.0]))

    def output(
        self, value: str, name: str, shape: Sequence[int | str | None], dtype: int | None = None
    ) -> None:
        self.node("Identity", value, name=name)
        kind = TensorProto.FLOAT if dtype is None else dtype
        self._outputs.append(helper.make_tensor_value_info(name, kind, list(shape)))

    def bytes(self, metadata: dict[str, str] | None = None) -> bytes:
        graph = helper.make_graph(
            self._nodes, "graph", [self._input], self._outputs, self._constants
        )
        model = helper.make_model(
            graph, opset_imports=[helper.make_opsetid("", self._opset)], ir_version=8
        )
        helper.set_model_props(model, metadata or {})
        onnx.checker.check_model(model)
        content: bytes = model.SerializeToString()
        return content


def fixed(
    outputs: dict[str, np.ndarray],
    size: tuple[int | str, int | str],
    *,
    metadata: dict[str, str] | None = None,
    batch: int | str = 1,
    dtype: str = "float32",
    declared: dict[str, Sequence[int | str | None]] | None = None,
    part: str = "constant",
) -> bytes:
    """Return a network with fixed outputs; a NaN in the image makes them NaN.

    ``part`` begins the names of its weights.
    """
    graph = Graph("images", (batch, 3, *size), dtype=dtype, part=part)
    zero = graph.zero()
    for name, value in outputs.items():
        shape = (declared or {}).get(name, value.shape)
        if np.issubdtype(value.dtype, np.integer):
            whole = graph.node("Cast", zero, to=TensorProto.INT64)
            total = graph.node("Add", graph.constant(value, np.int64), whole)
            graph.output(total, name, shape, TensorProto.INT64)
        else:
            graph.output(graph.node("Add", graph.constant(value), zero), name, shape)
    return graph.bytes(metadata)


def cell_count(height: int, width: int) -> int:
    return sum((height // stride) * (width // stride) for stride in STRIDES)


def cell_centres(height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (N, 2) in pixels of the input, and strides (N,)."""
    centres, strides = [], []
    for stride in STRIDES:
        for row in range(height // stride):
            for column in range(width // stride):
                centres.append(((column + 0.5) * stride, (row + 0.5) * stride))
                strides.append(stride)
    return np.array(centres), np.array(strides)


def colour_scores(graph: Graph, channel: int, gain: float, offset: float) -> str:
    """Return (1, 1, N) means of one channel over each cell, times gain, plus offset."""
    parts = []
    for stride in STRIDES:
        weight = np.zeros((1, 3, stride, stride))
        weight[0, channel] = gain / stride**2
        cells = graph.node(
            "Conv",
            graph.pixels,
            graph.constant(weight),
            graph.constant([offset]),
            kernel_shape=[stride, stride],
            strides=[stride, stride],
        )
        parts.append(graph.node("Reshape", cells, graph.constant([1, 1, -1], np.int64)))
    return graph.node("Concat", *parts, axis=2)


def colour_yolov8(height: int, width: int, *, dtype: str = "float32") -> bytes:
    """Return a YOLOv8 of one class; the boxes are the cells, the scores their mean red."""
    graph = Graph("images", (1, 3, height, width), dtype=dtype)
    centres, strides = cell_centres(height, width)
    boxes = np.concatenate([centres, np.repeat(strides[:, None], 2, axis=1)], axis=1).T
    gain = 1 / 255.0 if dtype == "uint8" else 1.0
    scores = colour_scores(graph, 0, gain, 0.0)
    rows = graph.node("Concat", graph.constant(boxes[None]), scores, axis=1)
    graph.output(rows, "output0", (1, 5, len(centres)))
    return graph.bytes({"names": "{0: 'person'}", "task": "detect"})


def colour_yolox(height: int, width: int) -> bytes:
    """Return a YOLOX of one class; the boxes are the cells, the scores their mean red.

    Its input is in the order blue, green, red, in 0–255.
    """
    graph = Graph("images", (1, 3, height, width))
    count = cell_count(height, width)
    # With offsets of half a cell and log sizes of 0, the box is the cell.
    boxes = np.tile([[0.5], [0.5], [0.0], [0.0]], (1, count))
    scores = colour_scores(graph, 2, 1 / 255.0, 0.0)
    ones = graph.constant(np.ones((1, 1, count)))
    columns = graph.node("Concat", graph.constant(boxes[None]), scores, ones, axis=1)
    graph.output(graph.node("Transpose", columns, perm=[0, 2, 1]), "output", (1, count, 6))
    return graph.bytes()


def colour_dets(height: int, width: int, part: str = RTMDET_HEAD, *, rtmdet: bool = True) -> bytes:
    """Return an RTMDet or a YOLOX with NMS of free input size; scores are each cell's mean red.

    ``dets`` are the cells of an input of height × width. ``part`` begins the names of its weights.
    """
    graph = Graph("input", ("batch", 3, "height", "width"), part=part)
    centres, strides = cell_centres(height, width)
    half = 0.5 * strides[:, None]
    boxes = np.concatenate([centres - half, centres + half], axis=1).T
    # From standardised red back to 0–1.
    std, mean = (STD_RGB[0], MEAN_RGB[0]) if rtmdet else (1.0, 0.0)
    scores = colour_scores(graph, 2, std / 255.0, mean / 255.0)
    columns = graph.node("Concat", graph.constant(boxes[None]), scores, axis=1)
    rows = graph.node("Transpose", columns, perm=[0, 2, 1])
    graph.output(rows, "dets", ("batch", "num", "five"))
    labels = np.zeros((1, len(centres)), np.int64)
    graph.output(
        graph.node("Identity", graph.constant(labels, np.int64)),
        "labels",
        ("batch", "num"),
        TensorProto.INT64,
    )
    return graph.bytes()


def simcc(
    places: Sequence[np.ndarray],
    heights: Sequence[np.ndarray],
    bins: Sequence[int],
    size: tuple[int, int],
    *,
    batch: int | str = "batch",
    sigma: float = 6.0,
    dtype: str = "float32",
    metadata: dict[str, str] | None = None,
) -> bytes:
    """Return a pose network with Gaussians at ``places`` (K,) in bins with ``heights`` (K,)."""
    graph = Graph("input", (batch, 3, *size), dtype=dtype)
    mean = graph.node("ReduceMean", graph.pixels, axes=[1, 2, 3], keepdims=1)
    zero = graph.node("Mul", mean, graph.constant([0.0]))
    zero = graph.node("Squeeze", zero, graph.constant([3], np.int64))
    for axis, place, height, count in zip("xyz", places, heights, bins, strict=False):
        reach = np.arange(count) - place[:, None]
        rows = height[:, None] * np.exp(-0.5 * (reach / sigma) ** 2)
        total = graph.node("Add", zero, graph.constant(rows[None]))
        graph.output(total, f"simcc_{axis}", (batch, len(place), count))
    return graph.bytes(metadata)


def red_point_pose(
    height: int, width: int, *, batch: int | str = "batch", order: str = "xy", named: bool = True
) -> bytes:
    """Return a pose network whose 17 keypoints lie at the reddest column and row of the image.

    It has two bins per pixel; the odd bins are the mean of their neighbours.
    """
    graph = Graph("input", (batch, 3, height, width))
    red = graph.node("Slice", graph.pixels, *(graph.constant([v], np.int64) for v in (0, 1, 1)))
    scaled = graph.node("Mul", red, graph.constant([STD_RGB[0] / 255.0]))
    red = graph.node("Add", scaled, graph.constant([MEAN_RGB[0] / 255.0]))
    outputs = {}
    for axis, across, count in (("x", 2, width), ("y", 3, height)):
        peak = graph.node("ReduceMax", red, axes=[across], keepdims=0)  # (N, 1, count)
        wide = graph.node(
            "ConvTranspose",
            peak,
            graph.constant([[[0.5, 1.0, 0.5]]]),
            strides=[2],
            kernel_shape=[3],
            pads=[1, 0],
        )
        shape = graph.constant([1, 17, 1], np.int64)
        outputs[axis] = (graph.node("Expand", wide, shape), 2 * count)
    for place, axis in enumerate(order):
        value, bins = outputs[axis]
        name = f"simcc_{axis}" if named else f"out_{place}"
        graph.output(value, name, (batch, 17, bins))
    return graph.bytes()


def red_point_movenet(
    size: int, scores: Sequence[float], *, dtype: str = "int32", batch: int | str = 1
) -> bytes:
    """Return a MoveNet whose 17 keypoints lie at the reddest column and row of the image."""
    graph = Graph("input", (batch, size, size, 3), dtype=dtype)
    red = graph.node("Slice", graph.pixels, *(graph.constant([v], np.int64) for v in (0, 1, 3)))
    places = []
    for across in (2, 1):  # y, then x
        peak = graph.node("ReduceMax", red, axes=[across, 3], keepdims=0)  # (1, size)
        place = graph.node("ArgMax", peak, axis=1, keepdims=1)
        place = graph.node("Cast", place, to=TensorProto.FLOAT)
        middle = graph.node("Add", place, graph.constant([0.5]))
        share = graph.node("Div", middle, graph.constant([float(size)]))  # (1, 1)
        places.append(graph.node("Expand", share, graph.constant([1, 1, 17, 1], np.int64)))
    column = graph.constant(np.reshape(scores, (1, 1, 17, 1)))
    graph.output(graph.node("Concat", *places, column, axis=3), "output_0", (1, 1, 17, 3))
    return graph.bytes()


def disc_network(
    rotation: Any = None,
    *,
    head: float = 1.0,
    size: int = 64,
    metadata: dict[str, str] | None = None,
    side_log_std: float = 0.05,
    rotation_std: float = 0.1,
    batch: int | str = "N",
) -> bytes:
    """Return a network of awarenav's layout: the head is the disc, with a diameter of 0.20 m."""
    graph = Graph("image", (batch, 3, size, size))
    grey = graph.node("ReduceMean", "image", axes=[1], keepdims=1)
    light = graph.node("Add", grey, graph.constant(2.0))  # black is −2 in the input
    every = graph.constant([1, 2, 3], np.int64)
    total = graph.node("ReduceSum", light, every, keepdims=1)
    total = graph.node("Add", total, graph.constant(1e-6))
    grid = (np.arange(size) + 0.5) / size
    centre = []
    for shape in ((1, 1, 1, size), (1, 1, size, 1)):
        weighted = graph.node("Mul", light, graph.constant(grid.reshape(shape)))
        moment = graph.node("ReduceSum", weighted, every, keepdims=1)
        mean = graph.node("Div", moment, total)
        centre.append(graph.node("Reshape", mean, graph.constant([-1, 1], np.int64)))
    # The area of a white disc as a share of the crop, and from it the crop's side.
    square = graph.node("Mul", total, graph.constant(4.0 / np.pi / (4.25 * size * size)))
    side = graph.node("Div", graph.constant(DISC_M), graph.node("Sqrt", square))
    side_m = graph.node("Reshape", side, graph.constant([-1], np.int64))
    none = graph.node("Mul", side_m, graph.constant(0.0))
    column = graph.node("Reshape", none, graph.constant([-1, 1], np.int64))
    matrix = graph.node("Reshape", none, graph.constant([-1, 1, 1], np.int64))

    def fixed_output(name: str, like: str, value: Any) -> None:
        value = np.asarray(value)
        graph.output(graph.node("Add", like, graph.constant(value)), name, ("N", *value.shape[1:]))

    turn = np.eye(3) if rotation is None else np.asarray(rotation)
    fixed_output("rotation", matrix, turn[None])
    fixed_output("rotation_covariance", matrix, rotation_std**2 * np.eye(3)[None])
    middle = graph.node("Concat", *centre, axis=1)
    middles = graph.node("Unsqueeze", middle, graph.constant([1], np.int64))
    keypoints = graph.node("Expand", middles, graph.constant([1, 5, 2], np.int64))
    graph.output(keypoints, "keypoints", ("N", 5, 2))
    fixed_output("keypoints_std", column, np.full((1, 5), 0.01))
    fixed_output("visible", column, [(0.95, 0.9, 0.9, 0.8, 0.8)])
    graph.output(middle, "centre", ("N", 2))
    graph.output(side_m, "side_m", ("N",))
    fixed_output("side_log_std", none, [side_log_std])
    fixed_output("head", none, [head])
    facts = {"awarenav_model": "head_pose", "awarenav_layout": "1", "crop_side_m": "0.40"}
    return graph.bytes(facts | (metadata or {}))


def full_range_network(output: Any, size: int = 224) -> bytes:
    """Return a network of the 6DRepNet kind that always returns ``output``: (3, 3) or (6,)."""
    output = np.asarray(output, dtype=np.float32)
    graph = Graph("image", ("N", 3, size, size))
    shape = graph.constant([-1, *[1] * output.ndim], np.int64)
    nones = graph.node("Reshape", graph.zero(), shape)
    answer = graph.node("Add", nones, graph.constant(output[None]))
    graph.output(answer, "output", ("N", *output.shape))
    return graph.bytes()
