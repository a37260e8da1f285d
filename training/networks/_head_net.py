"""Head network: rotation, keypoints and place of a 64 × 64 crop, with their uncertainty."""

from __future__ import annotations

from typing import Final

import torch
from torch import Tensor, nn

from ._blocks import Residual, conv, rotation_from_6d

#: Bins of a keypoint coordinate, over the crop's side and a quarter beyond either end.
BINS: Final = 96
SPAN: Final = (-0.25, 1.25)
KEYPOINTS: Final = 5
# Channels at strides 2, 4, 8 and 16.
_WIDTHS: Final = (32, 64, 144, 288)
_SWAP: Final = [0, 2, 1, 4, 3]


class HeadNet(nn.Module):
    """A dense residual network with flattened heads (pooling loses the direction of a face).

    The forward pass returns raw tensors; :class:`HeadExport` converts them to the shipped layout.
    """

    size = 64

    def __init__(self) -> None:
        super().__init__()
        first, second, third, fourth = _WIDTHS
        self.fine = nn.Sequential(
            conv(3, first, 3, 2),
            conv(first, second, 3, 2),
            Residual(second),
            conv(second, third, 3, 2),
            *(Residual(third) for _ in range(3)),
        )
        self.coarse = nn.Sequential(
            conv(third, fourth, 3, 2), *(Residual(fourth) for _ in range(3))
        )
        self.trunk = nn.Sequential(
            nn.Flatten(), nn.Dropout(0.1), nn.Linear(fourth * 16, 320), nn.ReLU(inplace=True)
        )
        self.maps = nn.Conv2d(third, KEYPOINTS, 3, padding=1)
        self.tokens = nn.Sequential(nn.Linear(64, 128), nn.ReLU(inplace=True))
        self.u, self.v = nn.Linear(128, BINS), nn.Linear(128, BINS)
        self.rotation = nn.Linear(320, 6)
        self.spread = nn.Sequential(nn.Linear(320, 64), nn.ReLU(inplace=True), nn.Linear(64, 12))
        self.place = nn.Linear(320, 3)
        self.seen = nn.Linear(320, KEYPOINTS + 1)

    def forward(self, x: Tensor) -> dict[str, Tensor]:
        """Return named tensors of crops (N, 3, 64, 64)."""
        fine = self.fine(x)
        trunk = self.trunk(self.coarse(fine))
        tokens = self.tokens(self.maps(fine).flatten(2))
        # The losses of the uncertainty must not change the estimates.
        spread = self.spread(trunk.detach())
        return {
            "rotation_6d": self.rotation(trunk),
            "u": self.u(tokens),
            "v": self.v(tokens),
            "place": self.place(trunk),
            "seen": self.seen(trunk),
            "rotation_spread": spread[:, :6],
            "side_log_std": spread[:, 6],
            "keypoint_log_std": spread[:, 7:],
        }


def head_rotation(rotation_6d: Tensor) -> Tensor:
    """Return R_ray_head (N, 3, 3) in the paper's head frame; the six numbers: forward, right."""
    columns = rotation_from_6d(rotation_6d)
    return torch.stack([columns[:, :, 2], columns[:, :, 0], columns[:, :, 1]], dim=2)


def keypoint_means(logits: Tensor) -> Tensor:
    """Return the mean (…,) over bins (…, bins), in units of the crop's side."""
    low, high = SPAN
    centres = low + (high - low) * (torch.arange(BINS, device=logits.device) + 0.5) / BINS
    return (logits.softmax(-1) * centres).sum(-1)


def spread_factor(raw: Tensor) -> Tensor:
    """Return the lower Cholesky factor (N, 3, 3) of the rotation's covariance, rad, of (N, 6)."""
    scale = torch.exp(raw[:, :3].clamp(-5.0, 1.0))
    zero = torch.zeros_like(raw[:, 0])
    rows = [
        torch.stack([scale[:, 0], zero, zero], dim=1),
        torch.stack([raw[:, 3] * scale[:, 0], scale[:, 1], zero], dim=1),
        torch.stack([raw[:, 4] * scale[:, 0], raw[:, 5] * scale[:, 1], scale[:, 2]], dim=1),
    ]
    return torch.stack(rows, dim=1)


def averaged(net: nn.Module, x: Tensor) -> dict[str, Tensor]:
    """Return the mean output for crops and for their mirror images, mirrored back."""
    count = x.shape[0]
    out = net(torch.cat([x, x.flip(3)]))
    mean = {}
    for name, values in out.items():
        straight, other = values[:count], values[count:]
        if name == "rotation_6d":
            # Columns forward and right of diag(−1, 1, 1) R diag(1, 1, −1).
            straight, other = (
                torch.cat([_unit(v[:, :3]), _unit(v[:, 3:])], 1) for v in (straight, other)
            )
            other = other * other.new_tensor([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
        elif name == "u":
            other = other[:, _SWAP].flip(2)
        elif name in ("v", "keypoint_log_std"):
            other = other[:, _SWAP]
        elif name == "place":
            other = other * other.new_tensor([-1.0, 1.0, 1.0])
        elif name == "seen":
            other = other[:, [*_SWAP, KEYPOINTS]]
        elif name == "rotation_spread":
            # The mirror image of a rotation vector δ is −diag(−1, 1, 1) δ.
            other = other * other.new_tensor([1.0, 1.0, 1.0, -1.0, -1.0, 1.0])
        mean[name] = 0.5 * (straight + other)
    return mean


def _unit(x: Tensor) -> Tensor:
    return x / (x.norm(dim=1, keepdim=True) + 1e-9)


class HeadExport(nn.Module):
    """The network with the outputs of the shipped layout (see ``perception/models/head_pose.md``).

    Every crop is processed twice, once mirrored, which reduces the errors by a tenth.

    Args:
        net: trained network.
        rotation_factor: factor on the rotation's standard deviations, from the calibration.
        side_factor: factor on that of the crop's side.
        keypoint_factor: factor on those of the keypoints.
    """

    names = (
        "rotation",
        "rotation_covariance",
        "keypoints",
        "keypoints_std",
        "visible",
        "centre",
        "side_m",
        "side_log_std",
        "head",
    )

    def __init__(
        self,
        net: HeadNet,
        rotation_factor: float = 1.0,
        side_factor: float = 1.0,
        keypoint_factor: float = 1.0,
    ) -> None:
        super().__init__()
        self.net = net
        self.factors = (rotation_factor, side_factor, keypoint_factor)

    def forward(self, x: Tensor) -> tuple[Tensor, ...]:
        """Return the nine outputs for crops (N, 3, 64, 64), in the order of :attr:`names`."""
        out = averaged(self.net, x)
        factor = spread_factor(out["rotation_spread"]) * self.factors[0]
        seen = torch.sigmoid(out["seen"])
        return (
            head_rotation(out["rotation_6d"]),
            factor @ factor.transpose(1, 2),
            torch.stack([keypoint_means(out["u"]), keypoint_means(out["v"])], dim=2),
            torch.exp(out["keypoint_log_std"].clamp(-7.0, 1.0)) * self.factors[2],
            seen[:, :KEYPOINTS],
            0.5 + 0.25 * out["place"][:, :2],
            0.40 * torch.exp(0.25 * out["place"][:, 2]),
            torch.exp(out["side_log_std"].clamp(-5.0, 1.0)) * self.factors[1],
            seen[:, KEYPOINTS],
        )
