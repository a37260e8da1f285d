"""Training and evaluation of the detector: task-aligned assignment (Feng et al. 2021), GIoU."""

from __future__ import annotations

from typing import Final

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812

from ._batch import Batch, output_on_photographed
from ._detector_data import DetectorData
from ._detector_net import GRID, DetectorNet, cells
from ._fit import fit
from ._recipe import Run

_CANDIDATES: Final = 10
_ALPHA, _BETA = 0.5, 6.0

_LEARNING_RATE: Final = 2e-3  # the highest


def train_detector(run: Run) -> nn.Module:
    """Train the detector; figures on held-out people go to the log."""
    recipe = run.recipe
    torch.manual_seed(recipe.seed + 2)
    data = DetectorData(run.shards, recipe.seed, recipe.backgrounds)
    check = DetectorData(run.held_out, recipe.seed, recipe.check_backgrounds)
    print(f"{len(data.frames)} images for training, {check.stills} held out", flush=True)
    return fit(
        "detector",
        DetectorNet(),
        data.batch,
        detector_loss,
        steps=recipe.detector_steps,
        folder=run.checkpoints,
        device=run.device,
        learning_rate=_LEARNING_RATE,
        judge=lambda net: judge_detector(net, check),
    )


def normalised(images: Tensor) -> Tensor:
    """Return pixels in 0–1, as YOLOv8 takes them."""
    return (images.float() / 255.0).contiguous(memory_format=torch.channels_last)


def detector_loss(net: nn.Module, batch: Batch, done: float) -> dict[str, Tensor]:
    """Return the losses of a batch by name."""
    logits, boxes = output_on_photographed(net, batch, normalised, int(batch["boxes"].sum()))
    logits, boxes = logits.float(), boxes.float()
    points, strides = cells(GRID, batch["image"].device)
    quality, owner, ignored = assigned(logits, boxes, batch, points, strides)
    positive = quality > 0.0
    target = torch.gather(batch["boxes"], 1, owner[..., None].expand(-1, -1, 4))
    # Boxes are weighted by the quality, as in the assignment.
    weight = quality[positive]
    total = weight.sum().clamp(min=1.0)
    overlap = giou(boxes[positive], target[positive])
    entropy = F.binary_cross_entropy_with_logits(logits, quality, reduction="none")
    counted = (~ignored | positive).float()
    return {
        "score": (entropy * counted).sum() / total,
        "box": 2.0 * ((1.0 - overlap) * weight).sum() / total,
    }


@torch.no_grad()
def assigned(
    logits: Tensor, boxes: Tensor, batch: Batch, points: Tensor, strides: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Return the assignment of cells to people.

    Returns:
        quality (N, cells): target of the score, 0 where no person is; owner (N, cells): row of the
        person; ignored (N, cells): cells within a person of whom too little shows.
    """
    truth, kind = batch["boxes"], batch["kind"]
    low, high = truth[:, :, None, :2], truth[:, :, None, 2:]
    inside = ((points > low) & (points < high)).all(-1)  # (N, M, cells)
    wanted = (kind == 1.0)[..., None]
    iou = pairwise_iou(truth, boxes)
    metric = logits.sigmoid()[:, None] ** _ALPHA * iou**_BETA
    metric = metric * (inside & wanted)
    top = metric.topk(_CANDIDATES, dim=2)
    chosen = torch.zeros_like(metric).scatter_(2, top.indices, (top.values > 1e-9).float()) > 0.0
    # While all cells of a person are poor, the nearest ones of the right level are taken.
    centre = 0.5 * (truth[..., :2] + truth[..., 2:])
    size = (truth[..., 2:] - truth[..., :2]).amax(-1)
    right = (torch.log2(size[..., None] / (6.0 * strides)).abs() < 1.0) & inside & wanted
    away = ((points - centre[:, :, None]) ** 2).sum(-1) + 1e9 * (~right).float()
    near = away.topk(4, dim=2, largest=False)
    first = torch.zeros_like(metric).scatter_(2, near.indices, (near.values < 1e8).float()) > 0.0
    poor = (iou * chosen).amax(2, keepdim=True) < 0.3
    chosen = chosen | (first & poor)
    # A cell belongs to the person that it overlaps most.
    rank = torch.where(chosen, iou + 1e-6, torch.zeros_like(iou))
    best, owner = rank.max(1)
    own = chosen & (
        torch.arange(truth.shape[1], device=owner.device)[None, :, None] == owner[:, None]
    )
    score = metric * own
    largest = score.amax(2, keepdim=True).clamp(min=1e-9)
    reach = (iou * own).amax(2, keepdim=True)
    quality = (score / largest * reach.clamp(min=0.05)).amax(1)
    quality = torch.where(best > 0.0, quality.clamp(min=0.02), torch.zeros_like(quality))
    ignored = (inside & (kind == 2.0)[..., None]).any(1)
    return quality, owner, ignored


def pairwise_iou(a: Tensor, b: Tensor) -> Tensor:
    """Return the IoU (N, M, C) of boxes (N, M, 4) and (N, C, 4)."""
    low = torch.maximum(a[:, :, None, :2], b[:, None, :, :2])
    high = torch.minimum(a[:, :, None, 2:], b[:, None, :, 2:])
    shared = (high - low).clamp(min=0.0).prod(-1)
    area_a = (a[..., 2:] - a[..., :2]).clamp(min=0.0).prod(-1)[:, :, None]
    area_b = (b[..., 2:] - b[..., :2]).clamp(min=0.0).prod(-1)[:, None]
    return shared / (area_a + area_b - shared).clamp(min=1e-6)


def giou(a: Tensor, b: Tensor) -> Tensor:
    """Return the generalised IoU (Rezatofighi et al. 2019) of K pairs of boxes (K, 4)."""
    low, high = torch.maximum(a[:, :2], b[:, :2]), torch.minimum(a[:, 2:], b[:, 2:])
    shared = (high - low).clamp(min=0.0).prod(-1)
    area = (a[:, 2:] - a[:, :2]).clamp(min=0.0).prod(-1) + (b[:, 2:] - b[:, :2]).prod(-1)
    union = (area - shared).clamp(min=1e-6)
    hull = (torch.maximum(a[:, 2:], b[:, 2:]) - torch.minimum(a[:, :2], b[:, :2])).prod(-1)
    return shared / union - (hull - union) / hull.clamp(min=1e-6)


def judge_detector(net: nn.Module, data: DetectorData, step: int = 16) -> dict[str, float]:
    """Return average precision at IoU 0.5 on held-out images, and people found at score 0.3."""
    net.eval()
    device = next(net.parameters()).device
    scores, hits, wanted = [], [], 0
    with torch.no_grad():
        for start in range(0, data.stills, step):
            batch = data.still(start, min(start + step, data.stills))
            logits, boxes = (p.cpu() for p in net(normalised(batch["image"]).to(device)))
            for row in range(len(logits)):
                found, confidence = suppressed(boxes[row], logits[row].sigmoid())
                kind = batch["kind"][row]
                iou = pairwise_iou(batch["boxes"][row][None], found[None])[0]
                wanted += int((kind == 1.0).sum())
                taken = torch.zeros(len(kind), dtype=torch.bool)
                for k in range(len(found)):
                    overlap = iou[:, k] * (~taken) * (kind > 0.0)
                    best = int(overlap.argmax()) if len(overlap) else 0
                    if overlap[best] >= 0.5:
                        taken[best] = True
                        if kind[best] == 2.0:
                            continue
                        hits.append(1.0)
                    else:
                        hits.append(0.0)
                    scores.append(float(confidence[k]))
    order = np.argsort(-np.array(scores), kind="stable")
    hit = np.array(hits)[order]
    precision = np.cumsum(hit) / np.arange(1, len(hit) + 1)
    recall = np.cumsum(hit) / max(wanted, 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1] if len(hit) else np.zeros(0)
    ap = float(np.sum(np.diff(np.concatenate([[0.0], recall])) * envelope)) if len(hit) else 0.0
    at = np.array(scores)[order] >= 0.3 if len(hit) else np.zeros(0, bool)
    return {
        "ap50": ap,
        "recall_at_0.3": float(hit[at].sum() / max(wanted, 1)),
        "false_at_0.3": float((1.0 - hit[at]).sum() / max(data.stills, 1)),
    }


def suppressed(boxes: Tensor, scores: Tensor, least: float = 0.02) -> tuple[Tensor, Tensor]:
    """Return boxes and scores after non-maximum suppression at IoU 0.6, best first."""
    order = scores.argsort(descending=True)[:200]
    order = order[scores[order] >= least]
    boxes, scores = boxes[order], scores[order]
    keep: list[int] = []
    iou = pairwise_iou(boxes[None], boxes[None])[0]
    for k in range(len(boxes)):
        if not keep or float(iou[k, keep].max()) < 0.6:
            keep.append(k)
    return boxes[keep], scores[keep]
