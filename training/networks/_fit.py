"""Training loop with averaged weights and checkpoints to continue from."""

from __future__ import annotations

import copy
import json
import math
import multiprocessing
import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

import torch
from torch import Tensor, nn
from torch.utils.data import DataLoader, Dataset

from ._batch import Batch

# Steps between two checkpoints, and batches that every helper prepares ahead.
_CHECKPOINT_STEPS: Final = 500
_AHEAD: Final = 2
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
    average_over: int = 500,
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
        average_over: steps over which the weights are averaged.
        judge: returns figures on held-out data, called at every fourth checkpoint.
        device: see :func:`torch_device`.
        helpers: processes that prepare batches; None is one beside a processor, and all but one
            core beside a GPU. They are forked, so they share the data. Where there is no fork, the
            training prepares them itself.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.pt"
    place = torch_device(device)
    helpers = _helpers(place) if helpers is None else helpers
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
    keep = 1.0 - 1.0 / average_over
    sums: dict[str, Tensor] = {}
    started = time.perf_counter()
    with (folder / f"{name}.jsonl").open("a", encoding="utf-8") as log:
        for step, prepared in enumerate(_prepared(batch_of, first, steps, helpers), first):
            batch = {key: value.to(place, non_blocking=True) for key, value in prepared.items()}
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
            _update_average(average, net, min(keep, (step + 1) / (step + 10)))
            for key, value in losses.items():
                sums[key] = sums.get(key, 0.0) + value.detach()
            if (step + 1) % _CHECKPOINT_STEPS == 0 or step + 1 == steps:
                since = (step % _CHECKPOINT_STEPS) + 1
                record: dict[str, Any] = {
                    "step": step + 1,
                    "minutes": (time.perf_counter() - started) / 60,
                }
                record |= {key: float(value) / since for key, value in sums.items()}
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


class _Steps(Dataset[Batch]):
    """The batches of the steps from ``first`` on."""

    def __init__(self, batch_of: Callable[[int], Batch], first: int, steps: int) -> None:
        self._batch_of, self._first, self._steps = batch_of, first, steps

    def __len__(self) -> int:
        return max(0, self._steps - self._first)

    def __getitem__(self, index: int) -> Batch:
        return self._batch_of(self._first + index)


def _prepared(
    batch_of: Callable[[int], Batch], first: int, steps: int, helpers: int
) -> Iterable[Batch]:
    """Return the batches of the steps in order, prepared ahead by other processes."""
    if "fork" not in multiprocessing.get_all_start_methods():
        helpers = 0
    return DataLoader(
        _Steps(batch_of, first, steps),
        batch_size=None,
        num_workers=helpers,
        prefetch_factor=_AHEAD if helpers else None,
        multiprocessing_context="fork" if helpers else None,
    )


def _helpers(place: torch.device) -> int:
    """Return the number of processes that prepare batches beside a device that trains."""
    return 1 if place.type == "cpu" else max(1, (os.cpu_count() or 2) - 1)


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
