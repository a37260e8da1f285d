"""Head pose networks with known results: they find one bright disc on black."""

from __future__ import annotations

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

DISC_M = 0.20
VISIBLE = (0.95, 0.9, 0.9, 0.8, 0.8)


def disc_network(
    rotation=None,
    *,
    visible=VISIBLE,
    head=1.0,
    size=64,
    metadata=None,
    side_log_std=0.05,
    rotation_std=0.1,
    batch="N",
    nan=False,
):
    """Return a network of awarenav's layout: the head is the disc, with a diameter of 0.20 m."""
    rotation = np.eye(3) if rotation is None else rotation
    grid = (np.arange(size) + 0.5) / size
    constants = {
        "grid_x": grid.reshape(1, 1, 1, size),
        "grid_y": grid.reshape(1, 1, size, 1),
        "offset": np.array(2.0),  # black is −2 in the input
        "white": np.array(4.25 * size * size),
        "ratio": np.array(4.0 / np.pi),
        "disc_m": np.array(DISC_M),
        "tiny": np.array(1e-6),
        "zero": np.array(0.0),
        "R": np.asarray(rotation).reshape(1, 3, 3),
        "C": rotation_std**2 * np.eye(3).reshape(1, 3, 3),
        "kstd": np.full((1, 5), 0.01),
        "vis": np.array([visible]),
        "logstd": np.array([np.nan if nan else side_log_std]),
        "hd": np.array([head]),
    }
    nodes = [
        helper.make_node("ReduceMean", ["image"], ["grey"], axes=[1], keepdims=1),
        helper.make_node("Add", ["grey", "offset"], ["light"]),
        helper.make_node("ReduceSum", ["light", "all"], ["total4"], keepdims=1),
        helper.make_node("Add", ["total4", "tiny"], ["total"]),
        *_moment("x"),
        *_moment("y"),
        helper.make_node("Concat", ["cx", "cy"], ["centre"], axis=1),
        helper.make_node("Div", ["total", "white"], ["area"]),
        helper.make_node("Mul", ["area", "ratio"], ["square"]),
        helper.make_node("Sqrt", ["square"], ["diameter"]),
        helper.make_node("Div", ["disc_m", "diameter"], ["side4"]),
        helper.make_node("Reshape", ["side4", "flat"], ["side_m"]),
        helper.make_node("Mul", ["side_m", "zero"], ["none"]),
        helper.make_node("Reshape", ["none", "column"], ["none2"]),
        helper.make_node("Reshape", ["none", "matrix"], ["none3"]),
        helper.make_node("Add", ["none3", "R"], ["rotation"]),
        helper.make_node("Add", ["none3", "C"], ["rotation_covariance"]),
        helper.make_node("Add", ["none2", "kstd"], ["keypoints_std"]),
        helper.make_node("Add", ["none2", "vis"], ["visible"]),
        helper.make_node("Add", ["none", "logstd"], ["side_log_std"]),
        helper.make_node("Add", ["none", "hd"], ["head"]),
        helper.make_node("Unsqueeze", ["centre", "axis1"], ["centre3"]),
        helper.make_node("Expand", ["centre3", "five"], ["keypoints"]),
    ]
    whole = {
        "flat": [-1],
        "column": [-1, 1],
        "matrix": [-1, 1, 1],
        "axis1": [1],
        "five": [1, 5, 2],
        "all": [1, 2, 3],
        "pair": [-1, 1],
    }
    outputs = {
        "rotation": ["N", 3, 3],
        "rotation_covariance": ["N", 3, 3],
        "keypoints": ["N", 5, 2],
        "keypoints_std": ["N", 5],
        "visible": ["N", 5],
        "centre": ["N", 2],
        "side_m": ["N"],
        "side_log_std": ["N"],
        "head": ["N"],
    }
    facts = {"awarenav_model": "head_pose", "awarenav_layout": "1", "crop_side_m": "0.40"}
    return build(nodes, [batch, 3, size, size], outputs, constants, whole, facts | (metadata or {}))


def full_range_network(output, size=224):
    """Return a network of the 6DRepNet kind that always returns ``output``: (3, 3) or (6,)."""
    output = np.asarray(output, dtype=np.float32)
    tail = [1] * output.ndim
    nodes = [
        helper.make_node("ReduceMean", ["image"], ["mean"], axes=[1, 2, 3], keepdims=0),
        helper.make_node("Mul", ["mean", "zero"], ["none"]),
        helper.make_node("Reshape", ["none", "shape"], ["nones"]),
        helper.make_node("Add", ["nones", "answer"], ["output"]),
    ]
    constants = {"zero": np.array(0.0), "answer": output[None]}
    return build(
        nodes,
        ["N", 3, size, size],
        {"output": ["N", *output.shape]},
        constants,
        {"shape": [-1, *tail]},
        {},
    )


def build(nodes, input_shape, outputs, constants, whole, metadata):
    graph = helper.make_graph(
        nodes,
        "head",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, input_shape)],
        [
            helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
            for name, shape in outputs.items()
        ],
        [
            *(
                numpy_helper.from_array(np.asarray(value, dtype=np.float32), name)
                for name, value in constants.items()
            ),
            *(
                numpy_helper.from_array(np.asarray(value, dtype=np.int64), name)
                for name, value in whole.items()
            ),
        ],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    helper.set_model_props(model, metadata)
    onnx.checker.check_model(model)
    return model.SerializeToString()


def _moment(axis):
    return [
        helper.make_node("Mul", ["light", f"grid_{axis}"], [f"weighted_{axis}"]),
        helper.make_node("ReduceSum", [f"weighted_{axis}", "all"], [f"sum_{axis}"], keepdims=1),
        helper.make_node("Div", [f"sum_{axis}", "total"], [f"mean_{axis}"]),
        helper.make_node("Reshape", [f"mean_{axis}", "pair"], [f"c{axis}"]),
    ]
