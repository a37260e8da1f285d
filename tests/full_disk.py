"""A disk that is full: files of this process cannot grow beyond a size."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import pytest

resource = pytest.importorskip("resource")  # Windows has no such limits


@contextlib.contextmanager
def files_up_to(size_bytes: int) -> Iterator[None]:
    """Make the system write a file only up to a size, with a short write, and then fail."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
