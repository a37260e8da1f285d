"""The one place that imports PyBullet.

PyBullet is the optional dependency ``awarenav[sim]``. Its extension module writes its build time to
the process's standard error when it is loaded; that line is dropped so that a command's output
holds only what the command says.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
from collections.abc import Iterator

from .errors import MissingSimulatorError


@contextlib.contextmanager
def muted(*descriptors: int) -> Iterator[None]:
    """Send file descriptors to the null device; C code bypasses ``sys.stdout``.

    Args:
        descriptors: which; none given means both standard output and standard error.
    """
    kept = {}
    _flush_c_streams()
    for descriptor in descriptors or (1, 2):
        # A process may have been started without the stream: then there is nothing to mute.
        with contextlib.suppress(OSError):
            kept[descriptor] = os.dup(descriptor)
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        for descriptor in kept:
            os.dup2(null, descriptor)
        yield
    finally:
        # What C code has printed waits in its buffer and would come out later.
        _flush_c_streams()
        for descriptor, copy in kept.items():
            os.dup2(copy, descriptor)
            os.close(copy)
        os.close(null)


def _flush_c_streams() -> None:
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).fflush(None)


try:
    with muted(2):
        import pybullet
except ImportError as cause:
    raise MissingSimulatorError(
        "the simulation needs PyBullet, which is not installed; it is the extra 'sim': "
        "pip install 'awarenav[sim]' (wheels exist for Python 3.10 and 3.11)"
    ) from cause

__all__ = ["muted", "pybullet"]
