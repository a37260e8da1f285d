"""As much of torch as seeding needs, over a NumPy generator.

Tests put a copy of it on the import path as ``torch``. Like torch, it begins with a seed of its
own, and a result depends on the number of threads.
"""

from __future__ import annotations

import numpy as np

_FIRST_SEED = 67280421310721
_generator = np.random.RandomState(_FIRST_SEED % 2**32)
_threads = 4


def manual_seed(seed):
    _generator.seed(seed % 2**32)


def get_rng_state():
    return _generator.get_state()


def set_rng_state(state):
    _generator.set_state(state)


def get_num_threads():
    return _threads


def set_num_threads(threads):
    global _threads  # noqa: PLW0603 - as torch does
    _threads = threads


def rand():
    return float(_generator.random_sample()) + 1e-3 * _threads


class Tensor:
    """SciPy asks for it."""


class cuda:  # noqa: N801 - as in torch
    @staticmethod
    def is_initialized():
        return False
