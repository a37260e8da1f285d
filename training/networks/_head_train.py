"""Training, evaluation and calibration of the head network."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812

from ._batch import Batch, output_on_photographed
from ._blocks import cross_entropy, soft_labels
from ._fit import fit
from ._head_data import LATE, HeadData
from ._head_net import BINS, SPAN, HeadNet, averaged, head_rotation, keypoint_means, spread_factor
from ._recipe import Run

MEAN, STD = 120.0, 60.0
_DEGREES_OF_FREEDOM = 5.0
_WEIGHT_DECAY = 0.03


def train_head(run: Run) -> nn.Module:
    """Train the head network; figures on held-out people go to the log."""
    recipe = run.recipe
    torch.manual_seed(recipe.seed)
    data = HeadData(run.shards, recipe.seed, recipe.backgrounds)
    check = HeadData(run.held_out, recipe.seed, recipe.check_backgrounds)
    print(f"{len(data.heads)} heads for training, {len(check.heads)} held out", flush=True)
    return fit(
        "head",
        HeadNet(),
        lambda step: data.batch(
            step, step / recipe.head_steps, recipe.head_batch, recipe.head_crops
        ),
        head_loss,
        steps=recipe.head_steps,
        folder=run.checkpoints,
        device=run.device,
        learning_rate=recipe.head_rate,
        weight_decay=_WEIGHT_DECAY,
        average_over=1000,
        judge=lambda net: judge_head(net, check),
    )


def normalised(images: Tensor) -> Tensor:
    """Return pixels as the network takes them."""
    return ((images.float() - MEAN) / STD).contiguous(memory_format=torch.channels_last)


def head_loss(net: nn.Module, batch: Batch, done: float) -> dict[str, Tensor]:
    """Return the losses of a batch by name."""
    seed = int(batch["keypoints"].sum().abs() * 1e4)
    strength = 1.0 if done < LATE else 0.5
    out = output_on_photographed(net, batch, normalised, seed, strength)
    out = {key: value.float() for key, value in out.items()}
    weight = batch["weight"]
    count = weight.sum().clamp(min=1.0)

    def mean(values: Tensor) -> Tensor:
        return (values * weight).sum() / count

    true = batch["rotation"]
    rotation = head_rotation(out["rotation_6d"])
    squared = ((rotation - true) ** 2).sum((1, 2))
    losses = {"rotation": mean(squared + 0.5 * (squared + 1e-4).sqrt())}

    target = batch["keypoints"]
    low, high = SPAN
    bins = (target - low) / (high - low) * BINS - 0.5
    within = ((target > low) & (target < high)).all(-1).float()
    # Hidden keypoints count too, but weigh less.
    keypoint_weight = within * (0.3 + 0.7 * batch["visible"])
    entropy = cross_entropy(out["u"], soft_labels(bins[..., 0], BINS, 1.0, 1.2))
    entropy = entropy + cross_entropy(out["v"], soft_labels(bins[..., 1], BINS, 1.0, 1.2))
    means = torch.stack([keypoint_means(out["u"]), keypoint_means(out["v"])], dim=2)
    away = (means - target).abs().sum(-1)
    losses["keypoints"] = mean((keypoint_weight * (0.12 * entropy + 4.0 * away)).mean(1))

    place = torch.cat([4.0 * (batch["centre"] - 0.5), 4.0 * batch["log_side"][:, None]], dim=1)
    losses["place"] = mean((out["place"] - place).abs().sum(1))
    seen = torch.cat([batch["visible"], batch["head"][:, None]], dim=1)
    seen_loss = F.binary_cross_entropy_with_logits(out["seen"], seen, reduction="none")
    # Crops without a head count too; only half-hidden heads are left out.
    unsure = ((weight == 0.0) & (batch["head"] > 0.0)).float()
    losses["seen"] = ((seen_loss.mean(1) + seen_loss[:, -1]) * (1.0 - unsure)).mean()

    # The network's own uncertainty: Student's t, so that a few bad cases do not dominate.
    turn = rotation_vector(true @ rotation.detach().transpose(1, 2))
    losses["spread"] = 0.15 * mean(_student(turn, spread_factor(out["rotation_spread"])))
    side_error = (out["place"][:, 2].detach() - place[:, 2]) / 4.0
    losses["side_spread"] = 0.1 * mean(_laplace(side_error.abs(), out["side_log_std"]))
    kp_error = (means.detach() - target).abs().mean(-1)
    losses["keypoint_spread"] = 0.1 * mean(
        (within * _laplace(kp_error, out["keypoint_log_std"].clamp(-7.0, 1.0))).mean(1)
    )
    return losses


def rotation_vector(rotation: Tensor) -> Tensor:
    """Return the rotation vectors (N, 3) of rotations (N, 3, 3), exact up to almost 180°."""
    skew = 0.5 * torch.stack(
        [
            rotation[:, 2, 1] - rotation[:, 1, 2],
            rotation[:, 0, 2] - rotation[:, 2, 0],
            rotation[:, 1, 0] - rotation[:, 0, 1],
        ],
        dim=1,
    )
    sine = skew.norm(dim=1)
    cosine = 0.5 * (rotation.diagonal(dim1=1, dim2=2).sum(1) - 1.0)
    angle = torch.atan2(sine, cosine)
    return skew * (angle / sine.clamp(min=1e-6))[:, None]


def _student(error: Tensor, factor: Tensor) -> Tensor:
    """Return the negative logarithm of Student's t in three dimensions, less a constant."""
    whitened = torch.linalg.solve_triangular(factor, error[:, :, None], upper=False)[:, :, 0]
    nu = _DEGREES_OF_FREEDOM
    log_det = factor.diagonal(dim1=1, dim2=2).log().sum(1)
    return log_det + 0.5 * (nu + 3.0) * torch.log1p((whitened**2).sum(1) / nu)


def _laplace(error: Tensor, log_scale: Tensor) -> Tensor:
    """Return the negative logarithm of the Laplace density, less a constant."""
    log_scale = log_scale.clamp(-7.0, 1.0)
    return log_scale + error * torch.exp(-log_scale)


def predictions(
    net: nn.Module, data: HeadData, step: int = 256, *, degraded: bool = False
) -> dict[str, Any]:
    """Return the errors of every head, cropped as in use; see :meth:`HeadData.still`."""
    net.eval()
    parts: dict[str, list[Any]] = {}
    device = next(net.parameters()).device
    with torch.no_grad():
        for start in range(0, len(data.heads), step):
            batch = data.still(start, min(start + step, len(data.heads)), degraded=degraded)
            out = averaged(net, normalised(batch["image"]).to(device))
            out = {key: value.float().cpu() for key, value in out.items()}
            rotation = head_rotation(out["rotation_6d"])
            cosine = (rotation[:, :, 1] * batch["rotation"][:, :, 1]).sum(1).clamp(-1.0, 1.0)
            turn = rotation_vector(batch["rotation"] @ rotation.transpose(1, 2))
            factor = spread_factor(out["rotation_spread"])
            white = torch.linalg.solve_triangular(factor, turn[:, :, None], upper=False)[:, :, 0]
            means = torch.stack([keypoint_means(out["u"]), keypoint_means(out["v"])], dim=2)
            found = {
                "gaze_deg": torch.rad2deg(torch.acos(cosine)),
                "whitened": white,
                "keypoint": (means - batch["keypoints"]).abs(),
                "keypoint_std": torch.exp(out["keypoint_log_std"].clamp(-7.0, 1.0)),
                "log_side": out["place"][:, 2] / 4.0 - batch["log_side"],
                "side_std": torch.exp(out["side_log_std"].clamp(-5.0, 1.0)),
                "visible": (torch.sigmoid(out["seen"][:, :5]) > 0.5).float() == batch["visible"],
                "shown": batch["visible"] > 0.5,
                "head": torch.sigmoid(out["seen"][:, 5]),
                "weight": batch["head"],
            }
            for key, value in found.items():
                parts.setdefault(key, []).append(value.numpy())
    return {key: np.concatenate(value) for key, value in parts.items()}


def judge_head(net: nn.Module, data: HeadData) -> dict[str, float]:
    """Return figures on held-out heads: as rendered, and the direction with degradations too."""
    found = predictions(net, data)
    good = found["weight"] > 0.5
    real = predictions(net, data, degraded=True)
    hard = real["gaze_deg"][real["weight"] > 0.5]
    gaze = found["gaze_deg"][good]
    shown = found["shown"] & good[:, None]
    return {
        "gaze_median_deg": float(np.median(gaze)),
        "gaze_p90_deg": float(np.percentile(gaze, 90)),
        "degraded_median_deg": float(np.median(hard)),
        "degraded_p90_deg": float(np.percentile(hard, 90)),
        "beyond_90": float((gaze > 90).mean()),
        "keypoint_median": float(np.median(found["keypoint"][shown])),
        "side_median": float(np.median(np.abs(found["log_side"][good]))),
        "visible_right": float(found["visible"][good].mean()),
        "rotation_factor": calibration(real)["rotation"],
    }


def calibration(found: dict[str, Any]) -> dict[str, float]:
    """Return factors on the standard deviations that put 68.3 % of the errors within one."""
    good = found["weight"] > 0.5
    shown = found["shown"] & good[:, None]
    rotation = np.abs(found["whitened"][good])
    side = np.abs(found["log_side"][good]) / found["side_std"][good]
    keypoint = (found["keypoint"] / found["keypoint_std"][:, :, None])[shown]
    return {
        "rotation": float(np.quantile(rotation, 0.683)),
        "side": float(np.quantile(side, 0.683)),
        "keypoint": float(np.quantile(keypoint, 0.683)),
    }
