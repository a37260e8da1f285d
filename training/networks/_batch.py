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
        images: (N, 3, H, W) in 0–255, on any device.
        generator: source of all randomness, on the processor.
        strength: 1 for the full effect, 0 for none.
    """
    n = len(images)

    def uniform(low: float, high: float, *shape: int) -> Tensor:
        drawn = low + (high - low) * torch.rand(n, *shape, generator=generator)
        return drawn.to(images.device)

    contrast, brightness = uniform(0.6, 1.4, 1, 1, 1), uniform(-35.0, 35.0, 1, 1, 1)
    cast = uniform(0.85, 1.15, 3, 1, 1)
    fade = uniform(-0.6, 0.6, 1, 1, 1).clamp(min=0.0)
    gamma = torch.exp(uniform(-0.35, 0.35, 1, 1, 1))
    # In place: a batch of whole images is large, and new memory costs more than the arithmetic.
    out = images.contiguous().float().mul_(contrast * cast)
    out.add_((128.0 * (1.0 - contrast) + brightness) * cast)
    grey = out.mean(1, keepdim=True).mul_(fade)
    out.mul_(1.0 - fade).add_(grey).clamp_(1.0, 255.0).div_(255.0).pow_(gamma).mul_(255.0)
    if strength >= 1.0:
        return out
    return torch.lerp(images.float(), out, strength)


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
    images = photographed(batch["image"], generator, strength)
    with torch.autocast(images.device.type, dtype=torch.bfloat16):
        return net(normalised(images))
