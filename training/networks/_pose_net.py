"""Pose network: SimCC coordinates in x, y and depth of a 144 × 192 crop of a person."""

from __future__ import annotations

from typing import Final

import torch
from torch import Tensor, nn

from ._blocks import Backbone, conv, enlarged

KEYPOINTS: Final = 17
WIDTH, HEIGHT = 144, 192
#: Bins per pixel, as in RTMPose.
SPLIT: Final = 2
BINS_X, BINS_Y, BINS_Z = WIDTH * SPLIT, HEIGHT * SPLIT, WIDTH * SPLIT
#: Half of the range of depth, as in RTMW3D.
Z_RANGE_M: Final = 2.1744869


class PoseNet(nn.Module):
    """A feature pyramid to stride 8 with a map per keypoint, flattened to three rows of bins."""

    hidden = 224

    def __init__(self) -> None:
        super().__init__()
        self.backbone = Backbone()
        fine, middle, coarse = Backbone.channels
        self.coarse_to_middle = conv(coarse, middle, 1)
        self.middle_to_fine = conv(middle, fine, 1)
        self.fuse_middle = conv(middle, middle)
        self.fuse_fine = conv(fine, fine)
        self.maps = nn.Conv2d(fine, KEYPOINTS, 3, padding=1)
        tokens = (WIDTH // 8) * (HEIGHT // 8)
        self.tokens = nn.Sequential(nn.Linear(tokens, self.hidden), nn.ReLU(inplace=True))
        self.whole = nn.Sequential(
            conv(middle, 24, 1),
            nn.Flatten(),
            nn.Linear(24 * (WIDTH // 16) * (HEIGHT // 16), 192),
            nn.ReLU(inplace=True),
        )
        self.name = nn.Parameter(torch.randn(KEYPOINTS, 32) * 0.1)
        self.x, self.y = nn.Linear(self.hidden, BINS_X), nn.Linear(self.hidden, BINS_Y)
        self.z = nn.Sequential(
            nn.Linear(self.hidden + 192 + 32, 192), nn.ReLU(inplace=True), nn.Linear(192, BINS_Z)
        )
        self.seen = nn.Sequential(
            nn.Linear(self.hidden + 192 + 32, 64), nn.ReLU(inplace=True), nn.Linear(64, 1)
        )

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return logits (N, 17, bins) of x, y, z and (N, 17) of visibility, of (N, 3, 192, 144)."""
        fine, middle, coarse = self.backbone(x)
        middle = self.fuse_middle(middle + enlarged(self.coarse_to_middle(coarse), middle))
        fine = self.fuse_fine(fine + enlarged(self.middle_to_fine(middle), fine))
        tokens = self.tokens(self.maps(fine).flatten(2))
        whole = self.whole(middle)[:, None].expand(-1, KEYPOINTS, -1)
        name = self.name[None].expand(x.shape[0], -1, -1)
        context = torch.cat([tokens, whole, name], dim=2)
        return self.x(tokens), self.y(tokens), self.z(context), self.seen(context)[..., 0]


class PoseExport(nn.Module):
    """The network with RTMW3D's outputs; peaks of x and y are the probability of visibility."""

    names = ("simcc_x", "simcc_y", "simcc_z")

    def __init__(self, net: PoseNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return (N, 17, 288), (N, 17, 384), (N, 17, 288) of (N, 3, 192, 144)."""
        *rows, seen = self.net(x)
        shown = torch.sigmoid(seen)[..., None]
        peaks = [torch.exp(row - row.amax(-1, keepdim=True)) for row in rows]
        return peaks[0] * shown, peaks[1] * shown, peaks[2]


def z_bins(z_m: Tensor) -> Tensor:
    """Return the bins of depths relative to the middle of the hips."""
    return (z_m / Z_RANGE_M + 1.0) * (0.5 * WIDTH) * SPLIT


def z_metres(bins: Tensor) -> Tensor:
    """Return the depths of bins in metres: (bin / 2 / 72 − 1) · 2.1744869."""
    return (bins / SPLIT / (0.5 * WIDTH) - 1.0) * Z_RANGE_M
