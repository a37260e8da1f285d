"""Quantised networks: faster files of the same layout, metadata and nearly the same outputs."""

from __future__ import annotations

import numpy as np
import onnx
import pytest

from perception.networks import OnnxModel
from perception.networks.heads import OnnxHeadPoseEstimator
from perception.shipped import HEAD, shipped_model_path
from training.networks.quantise import quantise


@pytest.fixture(scope="module")
def heads(tmp_path_factory):
    """Return the shipped head network, its 8-bit copy, and inputs that calibration has not seen."""
    rng = np.random.default_rng(5)
    smooth = rng.normal(0.0, 1.0, (16, 3, 8, 8)).repeat(8, axis=2).repeat(8, axis=3)
    images = (smooth + rng.normal(0.0, 0.2, (16, 3, 64, 64))).astype(np.float32)
    path = tmp_path_factory.mktemp("int8") / "head_pose.onnx"
    quantise(shipped_model_path(HEAD), [{"image": image[None]} for image in images[:12]], path)
    return OnnxModel(shipped_model_path(HEAD)), OnnxModel(path), images[12:]


def test_inputs_outputs_and_metadata_stay(heads):
    before, after, _ = heads
    assert after.inputs == before.inputs
    assert [each.name for each in after.outputs] == [each.name for each in before.outputs]
    assert before.metadata.items() <= after.metadata.items()
    assert OnnxHeadPoseEstimator(after).layout.is_awarenav


def test_a_quantised_network_of_renders_still_says_that_it_is_one(heads):
    before, after, _ = heads
    assert before.training_domain == "renders"
    assert after.metadata["training_domain"] == after.training_domain == "renders"


def test_weights_have_8_bits_and_outputs_are_nearly_the_same(heads):
    before, after, images = heads
    graph = onnx.load(str(after.path)).graph
    sizes = {}
    for tensor in graph.initializer:
        sizes[tensor.data_type] = sizes.get(tensor.data_type, 0) + int(np.prod(tensor.dims))
    assert sizes[onnx.TensorProto.INT8] > 0.9 * sum(sizes.values())
    for name, wanted, got in zip(
        [each.name for each in before.outputs],
        before.run({"image": images}),
        after.run({"image": images}),
        strict=True,
    ):
        spread = max(float(np.ptp(wanted)), 1e-3)
        assert np.abs(got - wanted).max() < 0.2 * spread, name
        assert not np.array_equal(got, wanted)
