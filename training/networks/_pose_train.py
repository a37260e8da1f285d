"""Training and evaluation of the pose network."""

from __future__ import annotations

from typing import Final

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812

from ._batch import Batch, output_on_photographed
from ._blocks import cross_entropy, soft_labels
from ._fit import fit
from ._pose_data import PoseData
from ._pose_net import BINS_X, BINS_Y, BINS_Z, SPLIT, PoseNet, z_bins, z_metres
from ._recipe import Run

MEAN: Final = (123.675, 116.28, 103.53)
STD: Final = (58.395, 57.12, 57.375)
_SIGMA_XY_BINS: Final = 3.0
_SIGMA_Z_BINS: Final = 2.5
_LEARNING_RATE: Final = 2e-3  # the highest


def train_pose(run: Run) -> nn.Module:
    """Train the pose network; figures on held-out people go to the log."""
    recipe = run.recipe
    torch.manual_seed(recipe.seed + 1)
    data = PoseData(run.shards, recipe.seed, recipe.backgrounds)
    check = PoseData(run.held_out, recipe.seed, recipe.check_backgrounds)
    print(f"{len(data.people)} people for training, {len(check.people)} held out", flush=True)
    return fit(
        "pose",
        PoseNet(),
        data.batch,
        pose_loss,
        steps=recipe.pose_steps,
        folder=run.checkpoints,
        device=run.device,
        learning_rate=_LEARNING_RATE,
        judge=lambda net: judge_pose(net, check),
    )


def normalised(images: Tensor) -> Tensor:
    """Return pixels as RTMPose takes them."""
    mean = torch.tensor(MEAN, device=images.device).view(1, 3, 1, 1)
    std = torch.tensor(STD, device=images.device).view(1, 3, 1, 1)
    return ((images.float() - mean) / std).contiguous(memory_format=torch.channels_last)


def _bins(batch: Batch) -> tuple[Tensor, Tensor, Tensor]:
    """Return the targets in bins: RTMPose's bin b is the pixel centre at b / 2."""
    pixels = batch["keypoints"] - 0.5
    return pixels[..., 0] * SPLIT, pixels[..., 1] * SPLIT, z_bins(batch["depth"])


def pose_loss(net: nn.Module, batch: Batch, done: float) -> dict[str, Tensor]:
    """Return the losses of a batch by name."""
    out = output_on_photographed(net, batch, normalised, int(batch["keypoints"].sum().abs()))
    x, y, z, seen = (part.float() for part in out)
    target_x, target_y, target_z = _bins(batch)
    # Hidden keypoints are guesses and weigh less.
    weight = batch["within"] * (0.3 + 0.7 * batch["visible"])
    count = weight.sum().clamp(min=1.0)

    def label(target: Tensor, bins: int, sigma: float) -> Tensor:
        return soft_labels(target, bins, 1.0, sigma)

    entropy = cross_entropy(x, label(target_x, BINS_X, _SIGMA_XY_BINS))
    entropy = entropy + cross_entropy(y, label(target_y, BINS_Y, _SIGMA_XY_BINS))
    away = (_mean(x) - target_x).abs() + (_mean(y) - target_y).abs()
    depth = cross_entropy(z, label(target_z, BINS_Z, _SIGMA_Z_BINS))
    deep = (_mean(z) - target_z).abs()
    weight_z = 0.4 + 0.6 * weight
    return {
        "keypoints": (0.5 * (entropy + 0.05 * away) * weight).sum() / count,
        "depth": (0.25 * (depth + 0.1 * deep) * weight_z).sum() / weight_z.sum(),
        "seen": F.binary_cross_entropy_with_logits(seen, batch["visible"]),
    }


def _mean(logits: Tensor) -> Tensor:
    """Return the mean bin."""
    index = torch.arange(logits.shape[-1], dtype=torch.float32, device=logits.device)
    return (logits.softmax(-1) * index).sum(-1)


def _peak(logits: Tensor) -> Tensor:
    """Return the bin of the peak, refined by the mean of its neighbourhood."""
    bins = logits.shape[-1]
    top = logits.argmax(-1, keepdim=True)
    near = (top + torch.arange(-4, 5, device=logits.device)).clamp(0, bins - 1)
    weight = torch.exp(logits.gather(-1, near) - logits.amax(-1, keepdim=True))
    return (weight * near).sum(-1) / weight.sum(-1)


def judge_pose(net: nn.Module, data: PoseData, step: int = 64) -> dict[str, float]:
    """Return figures on held-out people: pixels of the crop, metres of depth, visibility."""
    net.eval()
    device = next(net.parameters()).device
    pixels, depths, right, shown = [], [], [], []
    with torch.no_grad():
        for start in range(0, len(data.people), step):
            batch = data.still(start, min(start + step, len(data.people)))
            x, y, z, seen = (
                part.float().cpu() for part in net(normalised(batch["image"]).to(device))
            )
            target_x, target_y, _ = _bins(batch)
            error = torch.hypot(_peak(x) - target_x, _peak(y) - target_y) / SPLIT
            pixels.append(error.numpy())
            depths.append((z_metres(_peak(z)) - batch["depth"]).abs().numpy())
            right.append(((seen > 0.0).float() == batch["visible"]).numpy())
            shown.append((batch["visible"] > 0.5).numpy())
    error, visible = np.concatenate(pixels), np.concatenate(shown)
    depth = np.concatenate(depths)
    return {
        "head_median_px": float(np.median(error[:, :5][visible[:, :5]])),
        "body_median_px": float(np.median(error[:, 5:][visible[:, 5:]])),
        "p95_px": float(np.percentile(error[visible], 95)),
        "depth_median_m": float(np.median(depth[visible])),
        "depth_p95_m": float(np.percentile(depth[visible], 95)),
        "visible_right": float(np.concatenate(right).mean()),
    }
