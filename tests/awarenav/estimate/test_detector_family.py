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


def test_a_file_that_does_not_tell_is_asked_for(unnamed: Path) -> None:
    with pytest.raises(PerceptionError, match="--detector rtmdet:FILE or yolox:FILE"):
        choose_networks(str(unnamed), "shipped", "pnp")


@pytest.mark.parametrize(("family", "layout"), [("rtmdet", "RTMDet"), ("yolox", "YOLOX with NMS")])
def test_a_prefix_tells_it(unnamed: Path, family: str, layout: str) -> None:
    networks = choose_networks(f"{family}:{unnamed}", "shipped", "pnp")
    assert networks.detector.layout == layout  # type: ignore[union-attr]


def test_a_prefix_that_does_not_go_with_the_outputs_is_refused(unnamed: Path) -> None:
    with pytest.raises(PerceptionError, match="--detector rtmdet:FILE or yolox:FILE"):
        choose_networks(f"ultralytics:{unnamed}", "shipped", "pnp")


def test_other_prefixes_are_part_of_the_name(unnamed: Path) -> None:
    with pytest.raises(AwarenavError, match="there is no file 'yolo:"):
        choose_networks(f"yolo:{unnamed}", "shipped", "pnp")
