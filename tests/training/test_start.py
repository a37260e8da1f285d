"""Training that goes on from an exported network begins with the same function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; only training needs it")

import onnxruntime as ort  # noqa: E402

from perception.shipped import DETECTOR, HEAD, POSE, shipped_model_path  # noqa: E402
from training.networks._detector_net import DetectorExport, DetectorNet  # noqa: E402
from training.networks._head_net import HeadExport, HeadNet  # noqa: E402
from training.networks._pose_net import PoseExport, PoseNet  # noqa: E402
from training.networks._recipe import Recipe, Run  # noqa: E402
from training.networks._start import start_from, unseen  # noqa: E402

_NETWORKS = {
    HEAD: (HeadNet, HeadExport, (4, 3, 64, 64)),
    POSE: (PoseNet, PoseExport, (2, 3, 192, 144)),
    DETECTOR: (DetectorNet, DetectorExport, (1, 3, 256, 320)),
}


@pytest.mark.parametrize("name", _NETWORKS)
def test_it_is_the_function_of_the_file(name):
    make, export, shape = _NETWORKS[name]
    torch.manual_seed(5)
    net = make()
    start_from(net, shipped_model_path(name), [torch.randn(shape) for _ in range(2)])
    net.eval()
    x = torch.rand(shape)
    with torch.no_grad():
        ours = export(net)(x)
    session = ort.InferenceSession(str(shipped_model_path(name)))
    theirs = session.run(None, {session.get_inputs()[0].name: x.numpy()})
    parts = [ours] if isinstance(ours, torch.Tensor) else ours
    names = [each.name for each in session.get_outputs()]
    compared = 0
    for part, other, output in zip(parts, theirs, names, strict=True):
        # Standard deviations have factors in the file, from the calibration.
        if "std" not in output and "covariance" not in output:
            np.testing.assert_allclose(part.numpy(), other, atol=1e-4, rtol=1e-5)
            compared += 1
    assert compared >= {HEAD: 6, POSE: 3, DETECTOR: 1}[name]


def test_normalisation_has_the_statistics_of_the_data():
    """In training mode, batches of such data are normalised to about the same function."""
    torch.manual_seed(5)
    net = HeadNet()
    start_from(net, shipped_model_path(HEAD), [torch.randn(16, 3, 64, 64) for _ in range(2)])
    x = torch.randn(64, 3, 64, 64)
    norms = [m for m in net.modules() if isinstance(m, torch.nn.BatchNorm2d)]
    assert all(float(norm.weight.detach().min()) > 0.0 for norm in norms)
    net.eval()
    with torch.no_grad():
        fixed = net.fine(x)
        net.train()
        batch = net.fine(x)
    spread = float(fixed.std())
    assert float((fixed - batch).abs().mean()) < 0.1 * spread


def test_learning_is_slower_from_a_trained_network(tmp_path):
    run = Run(Recipe(), tmp_path, tmp_path, tmp_path, "cpu")
    assert run.learning_rate(2e-3, 1e-3) == 2e-3
    run = replace(run, start=shipped_model_path(HEAD))
    assert run.learning_rate(2e-3, 1e-3) == 1e-3


def test_the_statistics_come_from_batches_that_are_not_trained_on():
    recipe = Recipe()
    numbers = [int(batch) for batch in unseen(torch.tensor)]
    assert len(numbers) == len(set(numbers)) >= 2
    steps = max(recipe.head_steps, recipe.pose_steps, recipe.detector_steps)
    assert min(numbers) > steps


def test_a_file_of_another_network_is_refused():
    with pytest.raises(ValueError, match="is not a file of PoseNet"):
        start_from(PoseNet(), shipped_model_path(HEAD), [])
