"""Quantised networks: files of the same layout and metadata, and nearly the same outputs."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from perception.networks import OnnxModel
from perception.shipped import DETECTOR, HEAD, POSE, shipped_model_path
from training.networks.quantise import in_floating_point, is_quantised, quantise

_WIDTHS = (3, 16, 24, 4)


@pytest.fixture(scope="module")
def networks(tmp_path_factory):
    """Return a small network, its 8-bit copy, and inputs that calibration has not seen."""
    rng = np.random.default_rng(5)
    folder = tmp_path_factory.mktemp("int8")
    whole, small = folder / "whole.onnx", folder / "small.onnx"
    onnx.save(_network(rng), str(whole))
    smooth = rng.normal(0.0, 1.0, (40, 3, 4, 4)).repeat(4, axis=2).repeat(4, axis=3)
    images = (smooth + rng.normal(0.0, 0.2, smooth.shape)).astype(np.float32)
    quantise(whole, [{"image": image[None]} for image in images[:32]], small)
    return OnnxModel(whole), OnnxModel(small), images[32:]


def _network(rng):
    """Return three convolutions with ReLU between them, and a layout in the metadata."""
    weights, nodes, name = [], [], "image"
    for number, (inward, outward) in enumerate(pairwise(_WIDTHS)):
        kernel = rng.normal(0.0, (9 * inward) ** -0.5, (outward, inward, 3, 3)).astype(np.float32)
        weights.append(numpy_helper.from_array(kernel, f"kernel{number}"))
        last = number == len(_WIDTHS) - 2
        made = "scores" if last else f"sum{number}"
        nodes.append(
            helper.make_node(
                "Conv", [name, f"kernel{number}"], [made], name=f"conv{number}", pads=[1] * 4
            )
        )
        if not last:
            name = f"relu{number}"
            nodes.append(helper.make_node("Relu", [made], [name], name=name))
    graph = helper.make_graph(
        nodes,
        "small",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, ["batch", 3, 16, 16])],
        [helper.make_tensor_value_info("scores", TensorProto.FLOAT, ["batch", 4, 16, 16])],
        weights,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(model, {"task": "detect", "training_domain": "renders"})
    return model


def test_a_quantised_network_of_renders_still_says_that_it_is_one(networks):
    before, after, _ = networks
    assert before.training_domain == "renders"
    assert after.metadata["training_domain"] == after.training_domain == "renders"


def test_inner_weights_have_8_bits_and_outputs_are_nearly_the_same(networks):
    before, after, images = networks
    integers = {
        each.name.removesuffix("_quantized"): numpy_helper.to_array(each)
        for each in onnx.load(str(after.path)).graph.initializer
        if each.data_type == TensorProto.INT8 and len(each.dims) == 4
    }
    # The last product before an output keeps its numbers.
    assert set(integers) == {"kernel0", "kernel1"}
    # Seven bits: sums of two products fit in 16 bits, as processors without VNNI need.
    assert max(int(np.abs(each.astype(int)).max()) for each in integers.values()) <= 64
    wanted = before.run({"image": images})[0]
    got = after.run({"image": images})[0]
    assert np.abs(got - wanted).max() < 0.1 * np.ptp(wanted)
    assert np.corrcoef(got.ravel(), wanted.ravel())[0, 1] > 0.999
    assert not np.array_equal(got, wanted)


@pytest.mark.parametrize("name", [DETECTOR, POSE, HEAD])
def test_the_shipped_networks_have_8_bits_and_are_not_quantised_again(name, tmp_path):
    path = shipped_model_path(name)
    assert is_quantised(path)
    model = onnx.load(str(path))
    # Operator sets of one runtime alone would keep others from loading the file.
    assert [each.domain for each in model.opset_import] == [""]
    kernels = [
        numpy_helper.to_array(each)
        for each in model.graph.initializer
        if each.data_type == TensorProto.INT8 and len(each.dims) == 4
    ]
    assert kernels
    assert max(int(np.abs(each.astype(int)).max()) for each in kernels) <= 64
    sizes = {}
    for tensor in model.graph.initializer:
        sizes[tensor.data_type] = sizes.get(tensor.data_type, 0) + int(np.prod(tensor.dims))
    assert sizes[TensorProto.INT8] > 0.9 * sum(sizes.values())
    with pytest.raises(ValueError, match="8 bits already"):
        quantise(path, [], tmp_path / "again.onnx")
    assert not (tmp_path / "again.onnx").exists()


def test_in_floating_point_it_is_the_network_with_rounded_weights(networks, tmp_path):
    before, after, images = networks
    path = tmp_path / "float.onnx"
    in_floating_point(after.path, path)
    assert not is_quantised(path)
    network = OnnxModel(path)
    assert network.training_domain == "renders"
    wanted, got = before.run({"image": images})[0], network.run({"image": images})[0]
    # Without rounded activations it is nearer to the network than the one in 8 bits.
    error = np.abs(got - wanted).mean()
    assert 0.0 < error < np.abs(after.run({"image": images})[0] - wanted).mean()
