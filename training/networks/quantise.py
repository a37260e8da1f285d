"""Command ``python -m training.networks.quantise``: networks in 8-bit integers.

    awarenav render --frames 60 --range 1.5 6 --layouts aisles open blind_corner --out images
    python -m training.networks.quantise images --out build/int8

The networks see the images as the pipeline shows them; the ranges of their activations come from
that (static quantisation, QDQ, weights per channel). Convolutions and matrix products become
integer; the last one before each output stays as it is. Needs no PyTorch.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import onnx
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
from perception.networks import OnnxModel, OnnxPersonDetector, OnnxPoseEstimator
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

    Args:
        source: the ONNX file.
        feeds: inputs from which the ranges of the activations come.
        out: file to write.
    """
    with tempfile.TemporaryDirectory() as folder:
        folded = Path(folder) / "folded.onnx"
        _fold_constants(source, folded)
        nodes = onnx.load(str(folded)).graph.node
        quantised = Path(folder) / "int8.onnx"
        quantize_static(
            str(folded),
            str(quantised),
            _Reader(feeds),
            quant_format=QuantFormat.QDQ,
            per_channel=True,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
            calibrate_method=CalibrationMethod.MinMax,
            op_types_to_quantize=[*_HEAVY, *_BETWEEN],
            nodes_to_exclude=_last_products(folded),
        )
        model = onnx.load(str(quantised))
        assert nodes
    model.producer_name, model.producer_version = "awarenav", ""
    del model.metadata_props[:]
    model.metadata_props.extend(onnx.load(str(source)).metadata_props)
    onnx.checker.check_model(model)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(model.SerializeToString(deterministic=True))


def _fold_constants(source: Path, out: Path) -> None:
    """Write the network with constants computed, weights in single precision included."""
    options = ort.SessionOptions()
    options.graph_optimization_level = ort.GraphOptimizationLevel.ORT_ENABLE_BASIC
    options.optimized_model_filepath = str(out)
    options.log_severity_level = 3
    ort.InferenceSession(str(source), options, providers=["CPUExecutionProvider"])


def _last_products(path: Path) -> list[str]:
    """Return the names of the convolutions and products that no other one follows."""
    graph = onnx.load(str(path)).graph
    makers = {name: node for node in graph.node for name in node.output}
    last: list[str] = []
    todo, seen = [entry.name for entry in graph.output], set()
    while todo:
        name = todo.pop()
        node = makers.get(name)
        if node is None or name in seen:
            continue
        seen.add(name)
        if node.op_type in _HEAVY:
            last.append(node.name)
        else:
            todo.extend(node.input)
    return last
