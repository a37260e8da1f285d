"""Building blocks: dense convolutions, which a CPU trains far faster than depthwise ones."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - PyTorch's own habit


def conv(
    inward: int, outward: int, kernel: int = 3, stride: int = 1, *, act: bool = True
) -> nn.Sequential:
    """Return convolution, batch normalisation and, by default, ReLU."""
    layers: list[nn.Module] = [
        nn.Conv2d(inward, outward, kernel, stride, kernel // 2, bias=False),
        nn.BatchNorm2d(outward),
    ]
    if act:
        layers.append(nn.ReLU(inplace=True))
    return nn.Sequential(*layers)


class Residual(nn.Module):
    """Two 3 × 3 convolutions beside the identity (He et al. 2016)."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.first = conv(channels, channels)
        self.second = conv(channels, channels, act=False)

    def forward(self, x: Tensor) -> Tensor:
        """Return a tensor of the same shape."""
        return F.relu(x + self.second(self.first(x)))


class Backbone(nn.Module):
    """Features at strides 8, 16 and 32."""

    channels = (64, 128, 192)

    def __init__(self) -> None:
        super().__init__()
        self.stride8 = nn.Sequential(
            conv(3, 16, 3, 2), conv(16, 32, 3, 2), Residual(32), conv(32, 64, 3, 2), Residual(64)
        )
        self.stride16 = nn.Sequential(conv(64, 128, 3, 2), Residual(128))
        self.stride32 = nn.Sequential(conv(128, 192, 3, 2), Residual(192))

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return three feature maps of (N, 3, H, W), finest first."""
        fine = self.stride8(x)
        middle = self.stride16(fine)
        return fine, middle, self.stride32(middle)


def enlarged(x: Tensor, like: Tensor) -> Tensor:
    """Return a map enlarged to the size of another one by nearest neighbour."""
    return F.interpolate(x, size=like.shape[-2:], mode="nearest")


def rotation_from_6d(x: Tensor) -> Tensor:
    """Return rotations (N, 3, 3) of (N, 6): Gram–Schmidt on two columns (Zhou et al. 2019)."""
    first = F.normalize(x[:, :3], dim=1)
    second = x[:, 3:] - (first * x[:, 3:]).sum(1, keepdim=True) * first
    second = F.normalize(second, dim=1)
    return torch.stack([first, second, cross(first, second)], dim=2)


def cross(a: Tensor, b: Tensor) -> Tensor:
    """Return the cross product of (N, 3) in plain arithmetic, which every exporter supports."""
    return torch.stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ],
        dim=1,
    )


def soft_labels(position: Tensor, bins: int, per_unit: float, sigma_bins: float) -> Tensor:
    """Return Gaussian labels (…, bins) of positions (…,), each with sum one (SimCC)."""
    index = torch.arange(bins, dtype=torch.float32, device=position.device)
    label = torch.exp(-0.5 * ((index - position[..., None] * per_unit) / sigma_bins) ** 2)
    return label / (label.sum(-1, keepdim=True) + 1e-6)


def cross_entropy(logits: Tensor, label: Tensor) -> Tensor:
    """Return the cross entropy against soft labels over the last axis."""
    return -(label * logits.log_softmax(-1)).sum(-1)
