"""Samples on disk, and the training with its checkpoints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from sim_tests.actors.body import worker_names

from ._net import Weights, forward, fresh_weights, gradients, mirrored
from ._samples import Samples, samples_of
from ._scenes import (
    FIRST_VARIANT,
    TRAINING_HALLS,
    TRAINING_WORKERS,
    LabelledScan,
    random_hall,
    raw_scans,
)

_TRAINED: Final = ("w0", "b0", "w1", "b1", "w2", "b2")
_BETA1: Final = 0.9
_BETA2: Final = 0.999


@dataclass(frozen=True, slots=True)
class Recipe:
    """Every number of the training.

    Attributes:
        seed: seed of scenes, weights and order.
        halls: random halls of the training.
        check_halls: random halls with held-out people, for calibration.
        scans: scans per hall.
        people: people per hall.
        steps: steps of the optimiser.
        batch: hypotheses per step.
        rate: learning rate at the start; it falls to 0 as a cosine.
        decay: weight decay.
        checkpoint: steps between checkpoints.
    """

    seed: int = 0
    halls: int = 300
    check_halls: int = 20
    scans: int = 50
    people: int = 5
    steps: int = 24000
    batch: int = 1024
    rate: float = 3e-3
    decay: float = 1e-5
    checkpoint: int = 2000

    def quick(self) -> Recipe:
        """Return a tiny run that checks every stage."""
        return replace(self, halls=2, check_halls=1, scans=4, steps=40, batch=64, checkpoint=20)


def make_shard(recipe: Recipe, folder: Path, number: int, *, check: bool) -> Path:
    """Make the samples of one hall, unless they exist; return their file."""
    path = folder / f"{'check' if check else 'train'}_{number:04d}.npz"
    if path.exists():
        return path
    rng = np.random.default_rng([recipe.seed, 40 + check, number])
    names = [name for name in worker_names() if (name in TRAINING_WORKERS) != check]
    workers = rng.permutation(names)[: recipe.people].tolist()
    hall = random_hall(TRAINING_HALLS[number % len(TRAINING_HALLS)], rng)
    variant = FIRST_VARIANT + int(rng.integers(1000))
    scans = list(raw_scans(hall, variant, workers, recipe.scans, rng))
    partial = path.with_suffix(".part")
    with partial.open("wb") as file:
        np.savez_compressed(
            file,
            mount=np.array([scan.mount for scan in scans]),
            rays=np.array([len(scan.ranges_m) for scan in scans]),
            ranges_m=np.concatenate([scan.ranges_m for scan in scans]).astype(np.float32),
            person=np.concatenate([scan.person for scan in scans]).astype(np.int16),
            people_m=np.array([scan.people_m for scan in scans]),
        )
    partial.replace(path)
    return path


def read_shard(path: Path) -> Samples:
    """Return the samples of a file; nothing in it is executed."""
    with np.load(path, allow_pickle=False) as data:
        mounts, rays, people = data["mount"], data["rays"], data["people_m"]
        ends = np.cumsum(rays)[:-1]
        ranges = np.split(data["ranges_m"].astype(np.float64), ends)
        person = np.split(data["person"].astype(np.int64), ends)
    return samples_of(map(LabelledScan.of, mounts, ranges, person, people))


def joined(parts: Sequence[Samples]) -> Samples:
    """Return all samples of several files."""
    return Samples(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def train(recipe: Recipe, samples: Samples, check: Samples, folder: Path) -> Weights:
    """Train from the last checkpoint on, and return the weights."""
    path = folder / "checkpoint.npz"
    step, weights, moments = 0, fresh_weights(samples, np.random.default_rng(recipe.seed)), {}
    moments = {f"{kind}{name}": np.zeros_like(weights[name]) for name in _TRAINED for kind in "mv"}
    if path.exists():
        with np.load(path, allow_pickle=False) as data:
            step = int(data["step"])
            weights = {name: data[name] for name in weights}
            moments = {name: data[name] for name in moments}
    features = samples.features.astype(np.float64)
    while step < recipe.steps:
        rng = np.random.default_rng([recipe.seed, 50, step])
        rows = rng.integers(len(features), size=recipe.batch)
        batch, offset = features[rows], samples.offset_m[rows]
        if step % 2:
            batch, offset = mirrored(batch, offset)
        loss, found = gradients(weights, batch, samples.person[rows], offset)
        rate = 0.5 * recipe.rate * (1.0 + np.cos(np.pi * step / recipe.steps))
        step += 1
        for name in _TRAINED:
            m = moments[f"m{name}"] = _BETA1 * moments[f"m{name}"] + (1.0 - _BETA1) * found[name]
            v = moments[f"v{name}"] = (
                _BETA2 * moments[f"v{name}"] + (1.0 - _BETA2) * found[name] ** 2
            )
            m_hat, v_hat = m / (1.0 - _BETA1**step), v / (1.0 - _BETA2**step)
            weights[name] = (1.0 - recipe.decay) * weights[name] - rate * m_hat / (
                np.sqrt(v_hat) + 1e-8
            )
        if step % recipe.checkpoint == 0 or step == recipe.steps:
            partial = path.with_suffix(".part")
            with partial.open("wb") as file:
                np.savez(file, step=step, **weights, **moments)
            partial.replace(path)
            print(f"step {step}: loss {loss:.4f}, {figures(weights, check)}", flush=True)
    return weights


def figures(weights: Weights, check: Samples) -> str:
    """Return how well the weights judge held-out hypotheses, in a line."""
    out, _ = forward(weights, check.features.astype(np.float64))
    found, person = out[:, 0] > 0.0, check.person > 0.5
    error = np.abs(out[person, 1:3] - check.offset_m[person])
    return (
        f"recall {found[person].mean():.4f}, precision {person[found].mean():.4f}, "
        f"place {np.median(error, axis=0).round(3).tolist()} m"
    )


def deviation_factors(weights: Weights, check: Samples) -> np.ndarray:
    """Return (2,) factors with which the standard deviations hold on held-out people."""
    out, _ = forward(weights, check.features.astype(np.float64))
    sure = (check.person > 0.5) & (out[:, 0] > 0.0)
    error = (out[sure, 1:3] - check.offset_m[sure]) * np.exp(-np.clip(out[sure, 3:], -4.5, -0.5))
    return np.maximum(np.sqrt((error * error).mean(axis=0)), 1.0)
