"""The person detector: one class, no anchors, exported in the layout of YOLOv8."""

from __future__ import annotations

from typing import Final

import torch
from torch import Tensor, nn

from ._blocks import Backbone, conv, enlarged

HEIGHT, WIDTH = 256, 320
STRIDES: Final = (8, 16, 32)


class DetectorNet(nn.Module):
    """A feature pyramid with a score and the distances to the four sides of the box per cell."""

    inner = 64

    def __init__(self) -> None:
        super().__init__()
        self.backbone = Backbone()
        self.lateral = nn.ModuleList(conv(c, self.inner, 1) for c in Backbone.channels)
        self.fuse = nn.ModuleList(conv(self.inner, self.inner) for _ in Backbone.channels)
        self.head = nn.ModuleList(conv(self.inner, self.inner) for _ in Backbone.channels)
        self.out = nn.ModuleList(nn.Conv2d(self.inner, 5, 1) for _ in Backbone.channels)
        for layer in self.out:
            assert isinstance(layer, nn.Conv2d)
            assert layer.bias is not None
            nn.init.constant_(layer.bias[:1], -4.6)
            nn.init.constant_(layer.bias[1:], 1.0)

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Return logits (N, cells) and corners of boxes (N, cells, 4), px, of (N, 3, 256, 320)."""
        maps = self.backbone(x)
        levels = [lateral(part) for lateral, part in zip(self.lateral, maps, strict=True)]
        for finer in (1, 0):
            levels[finer] = levels[finer] + enlarged(levels[finer + 1], levels[finer])
        rows = [
            out(head(fuse(level))).flatten(2)
            for out, head, fuse, level in zip(self.out, self.head, self.fuse, levels, strict=True)
        ]
        flat = torch.cat(rows, dim=2).transpose(1, 2).float()
        points, strides = cells([(part.shape[2], part.shape[3]) for part in maps], flat.device)
        reach = torch.exp(flat[..., 1:].clamp(-4.0, 4.0)) * strides[:, None]
        boxes = torch.cat([points - reach[..., :2], points + reach[..., 2:]], dim=2)
        return flat[..., 0], boxes


def cells(
    sizes: list[tuple[int, int]], device: torch.device | None = None
) -> tuple[Tensor, Tensor]:
    """Return centres (cells, 2) in pixels and strides (cells,), finest level first, row by row.

    Args:
        sizes: rows and columns of each level. During the export they are read from tensors, so they
            stay open, and the file takes images of any size that 32 divides.
        device: device of the result.
    """
    points, strides = [], []
    for stride, (rows, columns) in zip(STRIDES, sizes, strict=True):
        v = (torch.arange(rows, device=device) + 0.5)[:, None] * stride
        u = (torch.arange(columns, device=device) + 0.5)[None] * stride
        grid = torch.stack([u + 0.0 * v, v + 0.0 * u], dim=2).reshape(-1, 2)
        points.append(grid)
        strides.append(torch.full_like(grid[:, 0], float(stride)))
    return torch.cat(points), torch.cat(strides)


#: Rows and columns of each level for an image of the usual size.
GRID: Final = [(HEIGHT // stride, WIDTH // stride) for stride in STRIDES]


class DetectorExport(nn.Module):
    """The detector with YOLOv8's output (1, 5, cells): centre, width, height (px), and score.

    The image may have any size that 32 divides, because a wide-angle camera needs more pixels.
    """

    names = ("output0",)

    def __init__(self, net: DetectorNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, x: Tensor) -> Tensor:
        """Return the output for RGB (1, 3, 256, 320) in 0–1."""
        logits, boxes = self.net(x)
        centre = 0.5 * (boxes[..., :2] + boxes[..., 2:])
        size = boxes[..., 2:] - boxes[..., :2]
        return torch.cat([centre, size, torch.sigmoid(logits)[..., None]], dim=2).transpose(1, 2)
