"""Training that goes on from an exported network begins with the same function."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; only training needs it")

import onnxruntime as ort  # noqa: E402

from perception.shipped import DETECTOR, HEAD, POSE, shipped_model_path  # noqa: E402
from training.networks._detector_net import DetectorExport, DetectorNet  # noqa: E402
from training.networks._export import export_detector, export_head, export_pose  # noqa: E402
from training.networks._head_net import HeadExport, HeadNet  # noqa: E402
from training.networks._pose_net import PoseExport, PoseNet  # noqa: E402
from training.networks._start import start_from  # noqa: E402
from training.networks.quantise import quantise  # noqa: E402

_NETWORKS = {
    HEAD: (HeadNet, HeadExport, (4, 3, 64, 64)),
    POSE: (PoseNet, PoseExport, (2, 3, 192, 144)),
    DETECTOR: (DetectorNet, DetectorExport, (1, 3, 256, 320)),
}
_EXPORTS = {
    HEAD: lambda net, path: export_head(net, path, {"rotation": 1, "side": 1, "keypoint": 1}),
    POSE: lambda net, path: export_pose(net, path, 1.0),
    DETECTOR: export_detector,
}
_OLD_EXPORTER = pytest.mark.filterwarnings(
    "ignore::DeprecationWarning", "ignore::torch.jit.TracerWarning"
)


@_OLD_EXPORTER
@pytest.mark.parametrize("name", _NETWORKS)
def test_it_is_the_function_of_the_file(name, tmp_path):
    make, export, shape = _NETWORKS[name]
    torch.manual_seed(5)
    path = tmp_path / "whole.onnx"
    _EXPORTS[name](make(), path)
    net = make()
    start_from(net, path, [torch.randn(shape) for _ in range(2)])
    compared = 0
    for _, ours, theirs in _outputs(net, export, path, torch.rand(shape)):
        np.testing.assert_allclose(ours, theirs, atol=1e-4, rtol=1e-5)
        compared += 1
    assert compared == {HEAD: 9, POSE: 3, DETECTOR: 1}[name]


def _outputs(net, export, path, x):
    """Return the name of each output, and its values of the network and of the file."""
    net.eval()
    with torch.no_grad():
        ours = export(net)(x)
    session = ort.InferenceSession(str(path))
    theirs = session.run(None, {session.get_inputs()[0].name: x.numpy()})
    parts = [ours] if isinstance(ours, torch.Tensor) else ours
    names = [each.name for each in session.get_outputs()]
    return [
        (name, part.numpy(), other) for name, part, other in zip(names, parts, theirs, strict=True)
    ]


@_OLD_EXPORTER
def test_weights_in_8_bits_are_read_to_half_a_step(tmp_path):
    """Training goes on from the rounded weights of the same layers."""
    torch.manual_seed(6)
    net = HeadNet().eval()
    crops = torch.randn(6, 3, 64, 64)
    whole, small = tmp_path / "whole.onnx", tmp_path / "small.onnx"
    export_head(net, whole, {"rotation": 1.0, "side": 1.0, "keypoint": 1.0})
    quantise(whole, [{"image": crop[None].numpy()} for crop in crops], small)
    again = HeadNet()
    start_from(again, small, [crops])
    again.eval()
    # Convolutions, a product whose weight has no name in the file, and one that has.
    pairs = [
        (net.fine[3], again.fine[3]),
        (net.coarse[0], again.coarse[0]),
        (net.tokens[0], again.tokens[0]),
        (net.trunk[2], again.trunk[2]),
    ]
    for one, other in pairs:
        wanted, got = _folded(one), _folded(other)
        # Seven bits of weight; half precision before them adds a little.
        step = np.abs(wanted).max() / 63.0
        assert 0.0 < np.abs(got - wanted).max() <= 0.55 * step
    # Two products of the same shape are not exchanged.
    np.testing.assert_allclose(again.u.weight.detach(), net.u.weight.detach(), atol=1e-4)
    np.testing.assert_allclose(again.v.weight.detach(), net.v.weight.detach(), atol=1e-4)


def _folded(layer):
    """Return the weights of a layer with the normalisation that follows it."""
    if isinstance(layer, torch.nn.Linear):
        return layer.weight.detach().numpy()
    conv, norm = layer[0], layer[1]
    factor = norm.weight / (norm.running_var + norm.eps).sqrt()
    return (conv.weight * factor[:, None, None, None]).detach().numpy()


def test_a_file_of_another_network_is_refused():
    with pytest.raises(ValueError, match="is not a file of PoseNet"):
        start_from(PoseNet(), shipped_model_path(HEAD), [])
