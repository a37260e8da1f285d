"""Quantised networks: faster files of the same layout, metadata and nearly the same outputs."""

from __future__ import annotations

import numpy as np
import onnx
import pytest

from perception.networks import OnnxModel, OnnxPoseEstimator
from perception.shipped import HEAD, POSE, shipped_model_path
from training.networks.quantise import is_quantised, quantise


@pytest.fixture(scope="module")
def poses(tmp_path_factory):
    """Return the shipped pose network, its 8-bit copy, and inputs that calibration has not seen."""
    rng = np.random.default_rng(5)
    smooth = rng.normal(0.0, 1.0, (16, 3, 24, 18)).repeat(8, axis=2).repeat(8, axis=3)
    images = (smooth + rng.normal(0.0, 0.2, (16, 3, 192, 144))).astype(np.float32)
    path = tmp_path_factory.mktemp("int8") / "person_pose.onnx"
    quantise(shipped_model_path(POSE), [{"input": image[None]} for image in images[:12]], path)
    return OnnxModel(shipped_model_path(POSE)), OnnxModel(path), images[12:]


def test_inputs_outputs_and_metadata_stay(poses):
    before, after, _ = poses
    assert after.inputs == before.inputs
    assert [each.name for each in after.outputs] == [each.name for each in before.outputs]
    assert before.metadata.items() <= after.metadata.items()
    assert OnnxPoseEstimator(after).layout == OnnxPoseEstimator(before).layout


def test_a_quantised_network_of_renders_still_says_that_it_is_one(poses):
    before, after, _ = poses
    assert before.training_domain == "renders"
    assert after.metadata["training_domain"] == after.training_domain == "renders"


def test_weights_have_8_bits_and_outputs_are_nearly_the_same(poses):
    before, after, images = poses
    graph = onnx.load(str(after.path)).graph
    sizes = {}
    for tensor in graph.initializer:
        sizes[tensor.data_type] = sizes.get(tensor.data_type, 0) + int(np.prod(tensor.dims))
    assert sizes[onnx.TensorProto.INT8] > 0.9 * sum(sizes.values())
    for name, wanted, got in zip(
        [each.name for each in before.outputs],
        before.run({"input": images}),
        after.run({"input": images}),
        strict=True,
    ):
        spread = max(float(np.ptp(wanted)), 1e-3)
        assert np.abs(got - wanted).max() < 0.2 * spread, name
        assert not np.array_equal(got, wanted)


def test_a_network_in_8_bits_is_not_quantised_again(tmp_path):
    assert is_quantised(shipped_model_path(HEAD))
    assert not is_quantised(shipped_model_path(POSE))
    with pytest.raises(ValueError, match="8 bits already"):
        quantise(shipped_model_path(HEAD), [], tmp_path / "again.onnx")
    assert not (tmp_path / "again.onnx").exists()


def test_a_shipped_network_names_only_the_operator_sets_that_it_uses():
    model = onnx.load(str(shipped_model_path(HEAD)))
    assert [each.domain for each in model.opset_import] == [""]
