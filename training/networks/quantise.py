"""Command ``python -m training.networks.quantise``: networks in 8-bit integers.

    awarenav render --frames 60 --range 1.5 6 --layouts aisles open blind_corner --out images
    python -m training.networks.quantise images --out build/int8
    python -m training.networks.quantise --undo --out build/float

The networks see the images as the pipeline shows them; the ranges of their activations come from
that (static quantisation, QDQ, weights per channel). Convolutions and matrix products become
integer; the last one before each output stays as it is. `awarenav judge` says what is lost, on
other halls than those of the images. Needs no PyTorch.
"""

from __future__ import annotations

import argparse
import itertools
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import onnx
import onnx.numpy_helper
import onnxruntime as ort
from numpy.typing import NDArray
from onnxruntime.quantization import (
    CalibrationDataReader,
    CalibrationMethod,
    QuantFormat,
    QuantType,
    quantize_static,
)

from perception import AwarenessPipeline, Camera
from perception.networks import (
    NETWORK_TIME,
    OnnxModel,
    OnnxPersonDetector,
    OnnxPoseEstimator,
    OnnxSettings,
)
from perception.networks.heads import OnnxHeadPoseEstimator
from perception.shipped import DETECTOR, HEAD, POSE, shipped_model_path

_NAMES: Final = (DETECTOR, POSE, HEAD)
_HEAVY: Final = ("Conv", "MatMul", "Gemm")
# Between two convolutions, these need no way back to floating point.
_BETWEEN: Final = ("Add", "Concat", "MaxPool", "Relu", "Resize", "GlobalAveragePool")
_MOST_FEEDS: Final = 200

Feeds = Mapping[str, NDArray[Any]]


class RecordingModel(OnnxModel):
    """A network that keeps copies of its inputs, at most 200."""

    def __init__(self, path: Path) -> None:
        self.feeds: list[Feeds] = []
        super().__init__(path)

    def run(self, feeds: Feeds, *, timed: bool = True) -> list[NDArray[Any]]:
        """Run the network and keep the inputs."""
        if len(self.feeds) < _MOST_FEEDS:
            self.feeds.append({name: array.copy() for name, array in feeds.items()})
        return super().run(feeds, timed=timed)


class _Reader(CalibrationDataReader):  # type: ignore[misc]
    def __init__(self, feeds: Sequence[Feeds]) -> None:
        self._feeds: Iterator[Feeds] = iter(feeds)

    def get_next(self) -> Feeds | None:
        return next(self._feeds, None)


def calibration_feeds(images: Path, models: Mapping[str, Path]) -> dict[str, list[Feeds]]:
    """Return what each network gets to see in a folder that ``awarenav render`` wrote."""
    loaded = {name: RecordingModel(path) for name, path in models.items()}
    pipeline = AwarenessPipeline(
        Camera.from_yaml(images / "camera.yaml"),
        OnnxPersonDetector(loaded[DETECTOR]),
        OnnxPoseEstimator(loaded[POSE]),
        OnnxHeadPoseEstimator(loaded[HEAD]),
    )
    for model in loaded.values():
        model.feeds.clear()  # empty images that show the shapes
    paths = sorted(images.glob("[0-9]*.png"))
    if not paths:
        raise SystemExit(f"there are no images in {images}: awarenav render writes them")
    for path in paths:
        bgr = cv2.imread(str(path))
        assert bgr is not None, path
        pipeline.process(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), 0.0)
    return {name: model.feeds for name, model in loaded.items()}


def quantise(source: Path, feeds: Sequence[Feeds], out: Path) -> None:
    """Write a network with 8-bit weights and activations; its metadata stay.

    Weights use 7 of their bits: processors without VNNI (older x86) add pairs of products in 16
    bits, which 8 bits overflow without a message.

    Args:
        source: the ONNX file.
        feeds: inputs from which the ranges of the activations come.
        out: file to write.

    Raises:
        ValueError: for a network that has 8 bits already.
    """
    if is_quantised(source):
        raise ValueError(f"{source} has 8 bits already")
    with tempfile.TemporaryDirectory() as folder:
        folded = Path(folder) / "folded.onnx"
        _fold_constants(source, folded)
        quantised = Path(folder) / "int8.onnx"
        quantize_static(
            str(folded),
            str(quantised),
            _Reader(feeds),
            quant_format=QuantFormat.QDQ,
            per_channel=True,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
            reduce_range=True,
            calibrate_method=CalibrationMethod.MinMax,
            op_types_to_quantize=[*_HEAVY, *_BETWEEN],
            nodes_to_exclude=_outer_nodes(folded),
        )
        model = onnx.load(str(quantised))
    model.producer_name, model.producer_version = "awarenav", ""
    # The runtime's own optimiser names every operator set that it knows.
    used = {node.domain for node in model.graph.node}
    sets = [each for each in model.opset_import if each.domain in used]
    del model.opset_import[:]
    model.opset_import.extend(sets)
    original = OnnxModel(source)
    metadata = dict(original.metadata)
    if original.training_domain is not None:
        metadata["training_domain"] = original.training_domain
    del model.metadata_props[:]
    for key in sorted(metadata):
        entry = model.metadata_props.add()
        entry.key, entry.value = key, metadata[key]
    _write(model, out)


def is_quantised(path: Path) -> bool:
    """Return True for a network with 8-bit weights or activations."""
    return any(node.op_type == "DequantizeLinear" for node in onnx.load(str(path)).graph.node)


def in_floating_point(source: Path, out: Path) -> None:
    """Write an 8-bit network in floating point, with its rounded weights.

    Accelerators that take no activations with a zero point, such as TensorRT, need it.

    Args:
        source: file that :func:`quantise` wrote.
        out: file to write.
    """
    model = onnx.load(str(source))
    graph = model.graph
    arrays = {each.name: onnx.numpy_helper.to_array(each) for each in graph.initializer}
    known: dict[str, str] = {}  # tensors that are gone, and what stands for them
    nodes, weights, gone = [], [], set()
    for node in graph.node:
        if node.op_type == "DequantizeLinear" and node.input[0] in arrays:
            name = node.output[0]
            array = dequantised(node, arrays)
            weights.append(onnx.numpy_helper.from_array(array, name))
            gone.update(node.input)
        elif node.op_type == "DequantizeLinear":
            known[node.output[0]] = known[node.input[0]]
        elif node.op_type == "QuantizeLinear":
            name = known.get(node.input[0], node.input[0])
            known[node.output[0]] = name
            if not arrays[node.input[2]].any():
                # Integers from 0 on cut off what is negative: quantisation has left out the ReLU.
                known[node.output[0]] = f"{node.output[0]}_relu"
                nodes.append(onnx.helper.make_node("Relu", [name], [known[node.output[0]]]))
            gone.update(node.input[1:])
        else:
            node.input[:] = [known.get(each, each) for each in node.input]
            nodes.append(node)
    kept = [each for each in graph.initializer if each.name not in gone]
    del graph.node[:], graph.initializer[:], graph.value_info[:]
    graph.node.extend(nodes)
    graph.initializer.extend([*kept, *weights])
    _write(model, out)


def _write(model: onnx.ModelProto, out: Path) -> None:
    """Write a valid network; the same network gives the same file."""
    onnx.checker.check_model(model)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(model.SerializeToString(deterministic=True))


def dequantised(node: onnx.NodeProto, arrays: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
    """Return the weights that a node reads, in floating point, from arrays by name.

    They are integers with a scale and a zero point for each index along an axis, or for all.
    """
    integers, scale, zero = (arrays[name] for name in node.input)
    axis = next((each.i for each in node.attribute if each.name == "axis"), 1)
    shape = [1] * integers.ndim
    if scale.ndim:
        shape[axis] = -1
    less = integers.astype(np.float32) - zero.astype(np.float32).reshape(shape)
    return np.asarray(less * scale.reshape(shape), dtype=np.float32)


def run_ms(path: Path, feeds: Sequence[Feeds]) -> float:
    """Return the processor milliseconds of a run on one thread, the shortest of 20."""
    model = OnnxModel(path, settings=OnnxSettings(intra_op_threads=1))
    times = []
    for feed in itertools.islice(itertools.cycle(feeds), 20):
        before_s = NETWORK_TIME.processor_s
        model.run(feed)
        times.append(NETWORK_TIME.processor_s - before_s)
    return 1e3 * min(times)


def main() -> None:
    """Quantise the networks that are not in 8 bits, and say how much faster they are."""
    parser = argparse.ArgumentParser(prog="python -m training.networks.quantise")
    parser.add_argument(
        "images", type=Path, nargs="?", help="folder that `awarenav render` wrote; not with --undo"
    )
    parser.add_argument("--models", type=Path, help="folder of the networks (default: the shipped)")
    parser.add_argument("--out", type=Path, required=True, help="folder of the 8-bit networks")
    parser.add_argument(
        "--undo",
        action="store_true",
        help="write networks that have 8 bits in floating point, with their rounded weights, for "
        "accelerators that take no activations with a zero point (TensorRT)",
    )
    chosen = parser.parse_args()
    if chosen.undo == (chosen.images is not None):
        parser.error("name a folder of images, or --undo")
    paths = {
        name: shipped_model_path(name)
        if chosen.models is None
        else chosen.models / shipped_model_path(name).name
        for name in _NAMES
    }
    if chosen.undo:
        for path in paths.values():
            out = chosen.out / path.name
            in_floating_point(path, out)
            print(f"{out}: in floating point")
        return
    feeds = calibration_feeds(chosen.images, paths)
    for name, path in paths.items():
        out = chosen.out / path.name
        if is_quantised(path):
            out.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, out)
            print(f"{out}: as it was, in 8 bits already")
            continue
        quantise(path, feeds[name], out)
        before, after = run_ms(path, feeds[name]), run_ms(out, feeds[name])
        print(f"{out}: {before:.2f} ms -> {after:.2f} ms ({before / after:.1f} times as fast)")


def _fold_constants(source: Path, out: Path) -> None:
    """Write the network with constants computed, weights in single precision included."""
    options = ort.SessionOptions()
    options.graph_optimization_level = ort.GraphOptimizationLevel.ORT_ENABLE_BASIC
    options.optimized_model_filepath = str(out)
    options.log_severity_level = 3
    ort.InferenceSession(str(source), options, providers=["CPUExecutionProvider"])


def _outer_nodes(path: Path) -> list[str]:
    """Return the names of the nodes from the last convolutions and products to the outputs.

    Their numbers have units: one scale for boxes in pixels and scores would leave no scores.
    """
    graph = onnx.load(str(path)).graph
    makers = {name: node for node in graph.node for name in node.output}
    outer: dict[str, None] = {}
    todo = [entry.name for entry in graph.output]
    while todo:
        node = makers.get(todo.pop())
        if node is None or node.name in outer or node.op_type == "Shape":
            continue
        outer[node.name] = None
        if node.op_type not in _HEAVY:
            todo.extend(node.input)
    return list(outer)


if __name__ == "__main__":
    main()
