"""``--detector yolox:FILE`` says what a file is that does not tell it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from awarenav.errors import AwarenavError
from awarenav.estimate import choose_networks
from perception import PerceptionError


@pytest.fixture
def unnamed(tmp_path: Path) -> Path:
    """A network with the outputs dets and labels, and no name that tells its family."""
    pixels = helper.make_tensor_value_info("input", TensorProto.FLOAT, [1, 3, 64, 64])
    outputs = [
        helper.make_tensor_value_info("dets", TensorProto.FLOAT, [1, 1, 5]),
        helper.make_tensor_value_info("labels", TensorProto.INT64, [1, 1]),
    ]
    values = {"a": np.zeros((1, 1, 5), np.float32), "b": np.zeros((1, 1), np.int64)}
    weights = [numpy_helper.from_array(value, name) for name, value in values.items()]
    nodes = [
        helper.make_node("Identity", [name], [output.name])
        for name, output in zip(values, outputs, strict=True)
    ]
    graph = helper.make_graph(nodes, "graph", [pixels], outputs, weights)
    path = tmp_path / "end2end.onnx"
    onnx.save(
        helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8),
        str(path),
    )
    return path


@pytest.mark.parametrize(("family", "layout"), [("rtmdet", "RTMDet"), ("yolox", "YOLOX with NMS")])
def test_a_prefix_tells_it(unnamed: Path, family: str, layout: str) -> None:
    networks = choose_networks(f"{family}:{unnamed}", "shipped", "pnp")
    assert networks.detector.layout == layout  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("prefix", "error", "message"),
    [
        ("", PerceptionError, "--detector rtmdet:FILE or yolox:FILE"),
        ("ultralytics:", PerceptionError, "--detector rtmdet:FILE or yolox:FILE"),
        ("yolo:", AwarenavError, "there is no file 'yolo:"),
    ],
)
def test_another_prefix_or_none_is_refused(unnamed: Path, prefix, error, message) -> None:
    with pytest.raises(error, match=message):
        choose_networks(f"{prefix}{unnamed}", "shipped", "pnp")
