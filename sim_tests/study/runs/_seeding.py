"""The global random generators that a planner may use: seeded for an episode, then restored."""

from __future__ import annotations

import contextlib
import random
import sys
from collections.abc import Iterator
from typing import Any, Final

import numpy as np

#: The seed with which torch is imported (``default_rng_seed_val`` in c10).
FRESH_TORCH_SEED: Final = 67280421310721


def torch_is_loaded() -> bool:
    """Return True if this process has imported torch; this package never does."""
    return _torch() is not None


@contextlib.contextmanager
def seeded_generators(seed: int, torch_seed: int | None = None) -> Iterator[None]:
    """Seed the global generators of ``random``, ``numpy`` and torch; restore them afterwards.

    torch is only seeded where it is imported already, on all of its devices. It computes on one
    thread within the block, as in worker processes: sums over several threads are rounded
    differently.

    Args:
        seed: ≥ 0.
        torch_seed: another seed for torch; None for the same.
    """
    python_state, numpy_state = random.getstate(), np.random.get_state()  # noqa: NPY002 - planners use it
    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002
    try:
        with _seeded_torch(seed if torch_seed is None else torch_seed):
            yield
    finally:
        random.setstate(python_state)
        np.random.set_state(numpy_state)  # noqa: NPY002


@contextlib.contextmanager
def _seeded_torch(seed: int) -> Iterator[None]:
    torch = _torch()
    if torch is None:
        yield
        return
    state, threads = torch.get_rng_state(), torch.get_num_threads()
    cuda = torch.cuda if torch.cuda.is_initialized() else None
    cuda_states = cuda.get_rng_state_all() if cuda is not None else []
    torch.manual_seed(seed % 2**63)  # the processor and every other device
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_rng_state(state)
        torch.set_num_threads(threads)
        if cuda is not None:
            cuda.set_rng_state_all(cuda_states)


def _torch() -> Any:
    """Return torch if it is imported, whole and usable; else None."""
    torch = sys.modules.get("torch")
    return torch if hasattr(torch, "manual_seed") else None
