"""The head network is symmetric under mirroring, and its outputs have their shapes."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; only training needs it")

from training.networks._head_net import (  # noqa: E402
    HeadExport,
    HeadNet,
    averaged,
    head_rotation,
    keypoint_means,
    spread_factor,
)

MIRROR = np.diag([-1.0, 1.0, 1.0])
MIRROR_HEAD = np.diag([1.0, 1.0, -1.0])
SWAP = [0, 2, 1, 4, 3]


@pytest.fixture(scope="module")
def net():
    torch.manual_seed(3)
    return HeadNet().eval()


def test_the_output_for_a_mirrored_crop_is_the_mirrored_output(net):
    x = torch.rand(3, 3, 64, 64)
    with torch.no_grad():
        one, other = averaged(net, x), averaged(net, x.flip(3))
    turned = MIRROR @ head_rotation(other["rotation_6d"]).numpy() @ MIRROR_HEAD
    np.testing.assert_allclose(head_rotation(one["rotation_6d"]).numpy(), turned, atol=1e-4)
    np.testing.assert_allclose(
        keypoint_means(one["u"]), 1.0 - keypoint_means(other["u"][:, SWAP]), atol=1e-4
    )
    np.testing.assert_allclose(
        keypoint_means(one["v"]), keypoint_means(other["v"][:, SWAP]), atol=1e-4
    )
    factors = [spread_factor(out["rotation_spread"]).numpy() for out in (one, other)]
    covariance, mirrored = (factor @ factor.swapaxes(1, 2) for factor in factors)
    np.testing.assert_allclose(covariance, MIRROR @ mirrored @ MIRROR, atol=1e-5)


def test_the_exported_outputs_follow_the_layout(net):
    with torch.no_grad():
        outputs = dict(
            zip(HeadExport.names, HeadExport(net)(torch.rand(2, 3, 64, 64)), strict=True)
        )
    rotation = outputs["rotation"].numpy()
    np.testing.assert_allclose(
        rotation @ rotation.swapaxes(1, 2), np.eye(3)[None].repeat(2, 0), atol=1e-5
    )
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-5)
    assert (np.linalg.eigvalsh(outputs["rotation_covariance"].numpy()) > 0.0).all()
    shapes = {name: tuple(value.shape) for name, value in outputs.items()}
    assert shapes["keypoints"] == (2, 5, 2)
    assert shapes["visible"] == shapes["keypoints_std"] == (2, 5)
    assert shapes["head"] == shapes["side_m"] == (2,)
