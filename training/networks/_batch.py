"""Batches for training: stacked samples, photographic distortion, and networks run on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

Batch = dict[str, Tensor]


def stacked_images(images: Sequence[NDArray[np.uint8]]) -> Tensor:
    """Return (N, 3, H, W) of N images (H, W, 3)."""
    return torch.from_numpy(np.stack(images)).permute(0, 3, 1, 2)


def stacked(samples: Sequence[Mapping[str, Any]]) -> Batch:
    """Return the samples as one batch; every entry but ``"image"`` becomes float32."""
    batch = {
        key: torch.from_numpy(np.stack([np.asarray(s[key], np.float32) for s in samples]))
        for key in samples[0]
        if key != "image"
    }
    batch["image"] = stacked_images([sample["image"] for sample in samples])
    return batch


def photographed(images: Tensor, generator: torch.Generator, strength: float = 1.0) -> Tensor:
    """Return images with random brightness, contrast, colour cast and faded colour.

    A scene's and a screen's variety; noise and exposure are the camera's (``_degradation``).

    Args:
        images: (N, 3, H, W) in 0–255.
        generator: source of all randomness.
        strength: 1 for the full effect, 0 for none.
    """
    n = len(images)

    def uniform(low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand(n, *shape, generator=generator)

    out = images.float()
    out = (out - 128.0) * uniform(0.6, 1.4, 1, 1, 1) + 128.0 + uniform(-35.0, 35.0, 1, 1, 1)
    out = out * uniform(0.85, 1.15, 3, 1, 1)
    fade = uniform(-0.6, 0.6, 1, 1, 1).clamp(min=0.0)
    out = out * (1.0 - fade) + fade * out.mean(1, keepdim=True)
    gamma = torch.exp(uniform(-0.35, 0.35, 1, 1, 1))
    out = 255.0 * (out.clamp(1.0, 255.0) / 255.0) ** gamma
    return torch.lerp(images.float(), out.clamp(0.0, 255.0), strength)


def output_on_photographed(
    net: nn.Module,
    batch: Batch,
    normalised: Callable[[Tensor], Tensor],
    seed: int,
    strength: float = 1.0,
) -> Any:
    """Return the network's output on the distorted images of a batch, computed in bfloat16.

    Args:
        net: the network.
        batch: its ``"image"`` is the input.
        normalised: converts pixels to the network's input.
        seed: of the distortion; the same batch gives the same images.
        strength: see :func:`photographed`.
    """
    generator = torch.Generator().manual_seed(seed % (2**31))
    device = batch["image"].device
    images = photographed(batch["image"].cpu(), generator, strength).to(device)
    with torch.autocast(device.type, dtype=torch.bfloat16):
        return net(normalised(images))
