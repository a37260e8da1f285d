"""The one place that imports PyBullet.

PyBullet is the optional dependency ``awarenav[sim]``. Its extension module writes its build time to
the process's standard error when it is loaded; that line is dropped so that a command's output
holds only what the command says.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

from ._errors import MissingSimulatorError


@contextlib.contextmanager
def _muted_stderr() -> Iterator[None]:
    """Send file descriptor 2 to the null device; C code bypasses ``sys.stderr``."""
    try:
        kept = os.dup(2)
    except OSError:  # no standard error to mute
        yield
        return
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(null)
        os.close(kept)


try:
    with _muted_stderr():
        import pybullet
except ImportError as cause:
    raise MissingSimulatorError(
        "the simulation needs PyBullet, which is not installed; it is the extra 'sim': "
        "pip install 'awarenav[sim]' (wheels exist for Python 3.10 and 3.11)"
    ) from cause

__all__ = ["pybullet"]
