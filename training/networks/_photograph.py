"""Light and sensor, distorted for a whole batch at once."""

from __future__ import annotations

import torch
from torch import Tensor


def photographed(batch: Tensor, generator: torch.Generator, strength: float = 1.0) -> Tensor:
    """Exposure, contrast, colour cast, faded colour and noise on (N, 3, H, W) in 0–255.

    Args:
        batch: pictures.
        generator: of all of it.
        strength: 1 in full, 0 not at all.
    """
    n = len(batch)

    def uniform(low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand(n, *shape, generator=generator)

    out = batch.float()
    out = (out - 128.0) * uniform(0.6, 1.4, 1, 1, 1) + 128.0 + uniform(-35.0, 35.0, 1, 1, 1)
    out = out * uniform(0.85, 1.15, 3, 1, 1)
    fade = uniform(-0.6, 0.6, 1, 1, 1).clamp(min=0.0)
    out = out * (1.0 - fade) + fade * out.mean(1, keepdim=True)
    gamma = torch.exp(uniform(-0.35, 0.35, 1, 1, 1))
    out = 255.0 * (out.clamp(1.0, 255.0) / 255.0) ** gamma
    noise = uniform(-8.0, 12.0, 1, 1, 1).clamp(min=0.0)
    out = out + noise * torch.randn(out.shape, generator=generator)
    return torch.lerp(batch.float(), out.clamp(0.0, 255.0), strength)
