"""The training loop: bfloat16 on a CPU, averaged weights, checkpoints to go on from."""

from __future__ import annotations

import copy
import json
import math
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

import torch
from torch import Tensor, nn

Batch = dict[str, Tensor]
_EVERY: Final = 500
_AHEAD: Final = 4


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
    helpers: int = 2,
) -> nn.Module:
    """Train, or go on with training from the last checkpoint; returns the averaged network.

    Args:
        name: of the checkpoint file.
        net: to be trained.
        batch_of: the batch of a step; the same for the same step, so that training can be resumed.
        loss_of: network, batch and share of the training done, to named losses to minimise.
        steps: of the optimiser, under a cosine schedule.
        folder: of the checkpoints and the log.
        learning_rate: the highest.
        weight_decay: of AdamW.
        judge: figures on held-out data, now and then.
        helpers: threads that prepare batches.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.pt"
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    net = net.to(device, memory_format=torch.channels_last)
    average = copy.deepcopy(net).eval()
    decay = [p for p in net.parameters() if p.ndim > 1]
    rest = [p for p in net.parameters() if p.ndim <= 1]
    optimiser = torch.optim.AdamW(
        [{"params": decay, "weight_decay": weight_decay}, {"params": rest, "weight_decay": 0.0}],
        lr=learning_rate,
    )
    first = 0
    if path.exists():
        saved = torch.load(path, map_location=device, weights_only=True)
        net.load_state_dict(saved["net"])
        average.load_state_dict(saved["average"])
        optimiser.load_state_dict(saved["optimiser"])
        first = saved["step"]
    log = (folder / f"{name}.jsonl").open("a", encoding="utf-8")
    sums: dict[str, float] = {}
    started = time.perf_counter()
    with ThreadPoolExecutor(helpers) as pool, log:
        queue: list[Future[Batch]] = [
            pool.submit(batch_of, step) for step in range(first, min(first + _AHEAD, steps))
        ]
        for step in range(first, steps):
            batch = {key: value.to(device) for key, value in queue.pop(0).result().items()}
            if step + _AHEAD < steps:
                queue.append(pool.submit(batch_of, step + _AHEAD))
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
            _blend(average, net, min(0.998, (step + 1) / (step + 10)))
            for key, value in losses.items():
                sums[key] = sums.get(key, 0.0) + float(value.detach())
            if (step + 1) % _EVERY == 0 or step + 1 == steps:
                since = (step % _EVERY) + 1
                record: dict[str, Any] = {
                    "step": step + 1,
                    "minutes": (time.perf_counter() - started) / 60,
                }
                record |= {key: value / since for key, value in sums.items()}
                if judge is not None and ((step + 1) % (4 * _EVERY) == 0 or step + 1 == steps):
                    record |= judge(average)
                sums = {}
                text = json.dumps({k: round(v, 4) for k, v in record.items()})
                log.write(text + "\n")
                log.flush()
                print(name, text, flush=True)
                _save(path, net, average, optimiser, step + 1)
    return average


def _blend(average: nn.Module, net: nn.Module, keep: float) -> None:
    """Exponential moving average of weights; statistics of normalisation too."""
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
