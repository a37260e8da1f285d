"""Training loop with averaged weights and checkpoints to continue from."""

from __future__ import annotations

import copy
import json
import math
import os
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

import torch
from torch import Tensor, nn

from ._batch import Batch

# Steps between two checkpoints, and batches that are prepared ahead.
_CHECKPOINT_STEPS: Final = 500
_AHEAD: Final = 4
#: The device that PyTorch finds: the first GPU, or the processor.
AUTO: Final = "auto"


def torch_device(name: str) -> torch.device:
    """Return the device of a name such as ``cpu``, ``cuda`` or ``cuda:1``; ``auto`` finds one.

    Raises:
        ValueError: for a name that PyTorch does not know, and for a GPU that it does not have.
    """
    if name == AUTO:
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
    except RuntimeError as cause:
        raise ValueError(f"device must be auto, cpu, cuda or cuda:N, got {name!r}") from cause
    if device.type == "cuda" and (device.index or 0) >= torch.cuda.device_count():
        raise ValueError(
            f"device {name} is not here: this build of PyTorch finds "
            f"{torch.cuda.device_count()} GPUs"
        )
    return device


def fit(
    name: str,
    net: nn.Module,
    batch_of: Callable[[int], Batch],
    loss_of: Callable[[nn.Module, Batch, float], dict[str, Tensor]],
    *,
    steps: int,
    folder: Path,
    learning_rate: float = 2e-3,
    weight_decay: float = 0.02,
    judge: Callable[[nn.Module], dict[str, float]] | None = None,
    device: str = AUTO,
    helpers: int | None = None,
) -> nn.Module:
    """Train, or continue from the last checkpoint; return the averaged network.

    Args:
        name: name of the checkpoint file.
        net: the network.
        batch_of: returns the batch of a step; the same step must give the same batch, so that
            training can be resumed.
        loss_of: returns named losses of the network, a batch and the share of training done.
        steps: optimiser steps, under a cosine schedule.
        folder: folder of the checkpoints and the log.
        learning_rate: highest learning rate.
        weight_decay: weight decay of AdamW.
        judge: returns figures on held-out data, called at every fourth checkpoint.
        device: see :func:`torch_device`.
        helpers: threads that prepare batches; None is two beside a processor, and all but one core
            beside a GPU.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.pt"
    place = torch_device(device)
    helpers = _helpers(place) if helpers is None else helpers
    ahead = max(_AHEAD, 2 * helpers)
    net = net.to(place, memory_format=torch.channels_last)
    average = copy.deepcopy(net).eval()
    optimiser = _optimiser(net, learning_rate, weight_decay)
    first = 0
    if path.exists():
        saved = torch.load(path, map_location=place, weights_only=True)
        net.load_state_dict(saved["net"])
        average.load_state_dict(saved["average"])
        optimiser.load_state_dict(saved["optimiser"])
        first = saved["step"]
    log = (folder / f"{name}.jsonl").open("a", encoding="utf-8")
    sums: dict[str, float] = {}
    started = time.perf_counter()
    with ThreadPoolExecutor(helpers) as pool, log:
        queue: list[Future[Batch]] = [
            pool.submit(batch_of, step) for step in range(first, min(first + ahead, steps))
        ]
        for step in range(first, steps):
            batch = {key: value.to(place) for key, value in queue.pop(0).result().items()}
            if step + ahead < steps:
                queue.append(pool.submit(batch_of, step + ahead))
            done = step / steps
            warm = min(1.0, (step + 1) / min(300.0, 0.1 * steps + 1.0))
            for group in optimiser.param_groups:
                group["lr"] = learning_rate * warm * (0.5 * (1 + math.cos(math.pi * done)) + 0.004)
            net.train()
            losses = loss_of(net, batch, done)
            total = torch.stack(list(losses.values())).sum()
            optimiser.zero_grad()
            if torch.isfinite(total):
                total.backward()
                nn.utils.clip_grad_norm_(net.parameters(), 5.0)
                optimiser.step()
            _update_average(average, net, min(0.998, (step + 1) / (step + 10)))
            for key, value in losses.items():
                sums[key] = sums.get(key, 0.0) + float(value.detach())
            if (step + 1) % _CHECKPOINT_STEPS == 0 or step + 1 == steps:
                since = (step % _CHECKPOINT_STEPS) + 1
                record: dict[str, Any] = {
                    "step": step + 1,
                    "minutes": (time.perf_counter() - started) / 60,
                }
                record |= {key: value / since for key, value in sums.items()}
                is_judged = (step + 1) % (4 * _CHECKPOINT_STEPS) == 0 or step + 1 == steps
                if judge is not None and is_judged:
                    record |= judge(average)
                sums = {}
                text = json.dumps({k: round(v, 4) for k, v in record.items()})
                log.write(text + "\n")
                log.flush()
                print(name, text, flush=True)
                _save(path, net, average, optimiser, step + 1)
    return average


def _optimiser(net: nn.Module, learning_rate: float, weight_decay: float) -> torch.optim.AdamW:
    """Return AdamW with weight decay on matrices and kernels only."""
    decay = [p for p in net.parameters() if p.ndim > 1]
    rest = [p for p in net.parameters() if p.ndim <= 1]
    return torch.optim.AdamW(
        [{"params": decay, "weight_decay": weight_decay}, {"params": rest, "weight_decay": 0.0}],
        lr=learning_rate,
    )


def _helpers(place: torch.device) -> int:
    """Return the threads that prepare batches beside a device that trains."""
    return 2 if place.type == "cpu" else max(2, (os.cpu_count() or 2) - 1)


def _update_average(average: nn.Module, net: nn.Module, keep: float) -> None:
    """Update the moving average of weights and normalisation statistics."""
    with torch.no_grad():
        for old, new in zip(average.state_dict().values(), net.state_dict().values(), strict=True):
            if old.dtype.is_floating_point:
                old.mul_(keep).add_(new, alpha=1.0 - keep)
            else:
                old.copy_(new)


def _save(path: Path, net: nn.Module, average: nn.Module, optimiser: Any, step: int) -> None:
    part = path.with_suffix(".part")
    torch.save(
        {
            "net": net.state_dict(),
            "average": average.state_dict(),
            "optimiser": optimiser.state_dict(),
            "step": step,
        },
        part,
    )
    part.replace(path)
