"""Training that goes on from an exported network begins with the same function."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; only training needs it")

import onnxruntime as ort  # noqa: E402

from perception.shipped import HEAD, shipped_model_path  # noqa: E402
from training.networks._head_net import HeadExport, HeadNet  # noqa: E402
from training.networks._pose_net import PoseNet  # noqa: E402
from training.networks._start import start_from  # noqa: E402


@pytest.fixture(scope="module")
def started():
    torch.manual_seed(5)
    net = HeadNet()
    start_from(net, shipped_model_path(HEAD), [torch.randn(16, 3, 64, 64) for _ in range(2)])
    return net


def test_it_is_the_function_of_the_file(started):
    x = torch.randn(4, 3, 64, 64)
    started.eval()
    with torch.no_grad():
        ours = dict(zip(HeadExport.names, HeadExport(started)(x), strict=True))
    session = ort.InferenceSession(str(shipped_model_path(HEAD)))
    theirs = session.run(None, {session.get_inputs()[0].name: x.numpy()})
    # Standard deviations have factors in the file, from the calibration.
    for name in ("rotation", "keypoints", "visible", "centre", "side_m", "head"):
        other = theirs[[each.name for each in session.get_outputs()].index(name)]
        np.testing.assert_allclose(ours[name].numpy(), other, atol=1e-4)


def test_normalisation_has_the_statistics_of_the_data(started):
    """In training mode, batches of such data are normalised to about the same function."""
    x = torch.randn(64, 3, 64, 64)
    norms = [m for m in started.modules() if isinstance(m, torch.nn.BatchNorm2d)]
    assert all(float(norm.weight.detach().min()) > 0.0 for norm in norms)
    before = [norm.running_mean.clone() for norm in norms]
    started.eval()
    with torch.no_grad():
        fixed = started.fine(x)
        started.train()
        batch = started.fine(x)
        started.eval()
    for norm, mean in zip(norms, before, strict=True):
        norm.running_mean.copy_(mean)
    spread = float(fixed.std())
    assert float((fixed - batch).abs().mean()) < 0.1 * spread


def test_a_file_of_another_network_is_refused():
    with pytest.raises(ValueError, match="is not a file of PoseNet"):
        start_from(PoseNet(), shipped_model_path(HEAD), [])
